"""What a step costs: counts that a hand can check, and XLA's own where it counts the same."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import step_cost, step_seconds
from gainful.filters import AbstractEstimator, Info
from gainful.running import samples_of

N, M, TURNS = 4, 3, 7


class Arithmetic(AbstractEstimator):
    """An estimator that does known sums: `TURNS` products of a matrix and a vector, one root, one Cholesky factor."""

    def init(self, model, prior):
        return jnp.full((N, N), 0.01) + jnp.eye(N), prior

    def step(self, model, carry, sample):
        matrix, estimate = carry

        def turn(x, _):
            return matrix @ x + x, None

        x = jax.lax.scan(turn, matrix[0], None, length=TURNS)[0]
        x = jnp.sqrt(x) @ jax.lax.linalg.cholesky(matrix, symmetrize_input=False)
        x = jax.lax.cond(x[0] > 0, lambda x: x + 1.0, lambda x: jnp.linalg.inv(matrix) @ x, x)
        report = Info(estimate, None, x[:M], matrix[:M, :M], x[0], x[1], x[:M], jnp.zeros((), int))
        return carry, report


def problem(n, m):
    """A linear system; one of six states and three readings is small enough to be factored by written-out loops."""
    rng = np.random.default_rng(0)
    model = gf.linear_model(
        np.eye(n) + 0.01 * rng.normal(size=(n, n)), rng.normal(size=(m, n)), Q=0.1 * np.eye(n), R=np.eye(m)
    )
    return model, gf.make_prior(model, np.zeros(n), np.ones(n)), gf.make_log(model, np.arange(5.0), np.zeros((5, m)))


def test_a_loop_counts_as_often_as_it_turns_a_factor_by_the_book_and_of_two_branches_the_cheaper():
    cost = step_cost(Arithmetic(), *problem(2, M))
    assert cost.products == TURNS * 2 * N * N + 2 * N * N
    assert cost.elementwise == TURNS * N + N
    assert cost.special == N
    assert cost.factorizations == round(N**3 / 3)
    assert cost.carried == N * N + 2 + 4
    assert cost.operations == cost.products + cost.elementwise + cost.special + cost.factorizations


@pytest.mark.parametrize("estimator", [gf.kalman_filter(), gf.unscented_kalman_filter()])
def test_a_step_without_loops_costs_what_xla_counts_but_for_comparisons_and_selections(estimator):
    model, prior, log = problem(6, 3)
    cost = step_cost(estimator, model, prior, log)
    sample = jax.tree.map(lambda values: jnp.asarray(values[1]), samples_of(log, float))
    carry = estimator.init(model, prior)
    found = jax.jit(lambda carry, sample: estimator.step(model, carry, sample)).lower(carry, sample).cost_analysis()
    assert found["transcendentals"] == cost.special
    # XLA counts a comparison and a selection as an operation each; they are a share of about n / n^2 of all.
    assert 0.8 * found["flops"] < cost.operations - cost.special < found["flops"]


def test_the_cost_of_a_dense_filter_grows_with_the_cube_of_its_states():
    # The products alone are of n^3 with terms of n^2 m beside them: between 2^2 and 2^3 for twice the states.
    few, many = (step_cost(gf.kalman_filter(), *problem(n, 3)).operations for n in (12, 24))
    assert 2**2.6 < many / few < 2**3


def test_a_step_of_the_dense_filter_costs_at_least_its_textbook_products():
    n, m = 24, 6
    # F P F^T, (I - K H) P (I - K H)^T, K R K^T, H P and its product with K: a count by hand.
    textbook = 4 * n**3 + 4 * n**3 + 2 * n * m * m + 2 * n * n * m + 2 * n * n * m + 2 * m * n * n
    found = step_cost(gf.kalman_filter(), *problem(n, m)).operations
    # Besides these: both derivatives by n directions (2 n^3 + 2 n^2 m), symmetric parts, the factor of S.
    assert textbook < found < 1.6 * textbook


def test_the_cost_in_words_names_its_parts():
    cost = step_cost(gf.kalman_filter(), *problem(2, 1))
    assert cost.sentence.startswith(
        f"{cost.operations:,} operations per step, {cost.special} of them special functions"
    )


def test_times_are_told_for_every_estimator_by_its_name():
    problems = {"kf": (gf.kalman_filter(), *problem(2, 1)), "ukf": (gf.unscented_kalman_filter(), *problem(2, 1))}
    found = step_seconds(problems, repeats=2)
    assert list(found) == ["kf", "ukf"]
    assert all(seconds > 0 for seconds in found.values())
