"""What a step of an estimator costs: operations counted, and seconds measured."""

from __future__ import annotations

import dataclasses
import math
import time
from collections import Counter
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..errors import ConfigError, ShapeError
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator, Info
from ..models import AbstractModel, Sample
from ..running import Log, samples_of
from ..running.compiled import compiled_call
from ..running.run import scan

Problem = tuple[AbstractEstimator, AbstractModel, AbstractEstimate, Log]
"""Estimator, model, prior and record: what `run` takes."""

_ELEMENTWISE = frozenset(("add", "add_any", "sub", "mul", "div", "neg", "max", "min", "abs", "sign", "square", "clamp"))
_SPECIAL = frozenset(
    (
        "sqrt",
        "rsqrt",
        "cbrt",
        "exp",
        "exp2",
        "expm1",
        "log",
        "log1p",
        "logistic",
        "pow",
        "erf",
        "erfc",
        "erf_inv",
        "lgamma",
    )
) | frozenset(
    ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "digamma")
)
_SUMS = frozenset(("reduce_sum", "reduce_prod", "reduce_max", "reduce_min", "cumsum", "cumprod", "cummax", "cummin"))


@dataclasses.dataclass(frozen=True)
class StepCost:
    """Floating-point operations of one step.

    Attributes:
        products: additions and multiplications in products of matrices and vectors.
        factorizations: in Cholesky, triangular, orthogonal and eigenvalue routines of a library, by textbook counts.
        elementwise: all other additions, multiplications, divisions and comparisons for a maximum.
        special: roots, exponentials, logarithms, trigonometric and other functions.
        carried: numbers that the estimator remembers from step to step.
        open_loops: loops whose number of turns depends on the data; one turn of each is counted.
    """

    products: int
    factorizations: int
    elementwise: int
    special: int
    carried: int
    open_loops: int

    @property
    def operations(self) -> int:
        """All of them, a special function being one."""
        return self.products + self.factorizations + self.elementwise + self.special

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        text = f"{self.operations:,} operations per step, {self.special:,} of them special functions"
        text += f"; {self.carried:,} numbers carried"
        return text + (f"; {self.open_loops} loops counted as one turn each" if self.open_loops else "")


def step_cost(estimator: AbstractEstimator, model: AbstractModel, prior: AbstractEstimate, data: Log) -> StepCost:
    """How many operations a step takes, the model's functions and their derivatives included.

    Counted on the program as JAX traces it, so that the number depends on no machine and nothing is compiled. A loop
    counts as often as it turns. Of two branches the cheaper counts: the dearer ones are for what has gone wrong. Products
    count as they are written, with the zeros of the matrices in them; comparisons, copies and selections count nothing.

    Args:
        estimator: whose step.
        model: of the plant.
        prior: the estimate before the first row.
        data: a record, of which one row is looked at.

    Raises:
        ShapeError: data that are no record.

    Source: Golub and Van Loan (2013), Matrix Computations, 4th ed., 1.1 and 3 to 8, for the counts of products and
        factorizations.

    Example:
        >>> import numpy as np, gainful as gf
        >>> model = gf.linear_model(np.eye(2), np.eye(2), Q=1.0, R=1.0)
        >>> prior = gf.make_prior(model, [0.0, 0.0], [1.0, 1.0])
        >>> log = gf.make_log(model, [0.0, 1.0], np.zeros((2, 2)))
        >>> dense, root = (step_cost(gf.kalman_filter(square_root=s), model, prior, log) for s in (False, True))
        >>> dense.operations < root.operations
        True
    """
    if not isinstance(data, Log):
        raise ShapeError(f"data: expected Log, got {type(data).__name__}; make one with make_log")
    samples = samples_of(data, prior.mean.dtype)
    row = int(np.argmax(data.dt > 0))
    sample = jax.tree.map(lambda values: jax.numpy.asarray(values[row]), samples)
    carry = estimator.init(model, prior)
    carried = sum(leaf.size for leaf in jax.tree.leaves(carry) if eqx.is_inexact_array(leaf))
    traced = eqx.filter_make_jaxpr(_step)((estimator, model), carry, sample)[0]
    found = _count(traced.jaxpr)
    kinds = {name: found[name] for name in ("products", "factorizations", "elementwise", "special")}
    return StepCost(**kinds, carried=carried, open_loops=found["open_loops"])


def step_seconds(problems: Mapping[str, Problem], repeats: int = 9) -> dict[str, float]:
    """Seconds per row of whole runs, the estimators taking turns: medians over the turns, without compilation.

    Turns spread what else the machine does evenly over all. The numbers are this machine's; compare them with each other.

    Args:
        problems: by name, what `run` takes; records of some hundred rows or more, so that a call's own cost vanishes.
        repeats: turns.

    Raises:
        ConfigError: no turns.

    Example:
        >>> import numpy as np, gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=1.0, R=1.0)
        >>> problem = model, gf.make_prior(model, [0.0], [1.0]), gf.make_log(model, np.arange(9.0), np.zeros(9))
        >>> found = step_seconds({"kf": (gf.kalman_filter(), *problem), "ukf": (gf.unscented_kalman_filter(), *problem)})
        >>> min(found.values()) > 0
        True
    """
    if isinstance(repeats, bool) or not isinstance(repeats, int) or repeats < 1:
        raise ConfigError(f"repeats: expected a whole number of at least 1, got {repeats!r}")
    taken: dict[str, list[float]] = {name: [] for name in problems}
    for turn in range(repeats + 1):
        for name, (estimator, model, prior, data) in problems.items():
            samples = samples_of(data, prior.mean.dtype)
            begin = time.perf_counter()
            jax.block_until_ready(compiled_call(_all_rows, (estimator, model), prior, samples)[0])
            # The first turn compiles.
            if turn:
                taken[name].append((time.perf_counter() - begin) / len(data))
    return {name: float(np.median(each)) for name, each in taken.items()}


def _step(parts: tuple[AbstractEstimator, AbstractModel], carry: Any, sample: Sample) -> tuple[Any, Info]:
    estimator, model = parts
    return estimator.step(model, carry, sample)


def _all_rows(
    parts: tuple[AbstractEstimator, AbstractModel], prior: AbstractEstimate, samples: Sample
) -> tuple[Any, Info]:
    return scan(*parts, prior, samples)


def _count(jaxpr: Any) -> Counter[str]:
    """Operations of a traced program by kind."""
    total: Counter[str] = Counter()
    for equation in jaxpr.eqns:
        total.update(_count_one(equation))
    return total


def _count_one(equation: Any) -> Counter[str]:
    name, params = equation.primitive.name, equation.params
    if name == "scan":
        return _times(_count(params["jaxpr"].jaxpr), params["length"])
    if name == "while":
        return _count(params["body_jaxpr"].jaxpr) + Counter(open_loops=1)
    if name == "cond":
        return min((_count(branch.jaxpr) for branch in params["branches"]), key=lambda found: found.total())
    if name == "custom_linear_solve":
        return _count(params["jaxprs"].solve.jaxpr)
    inner = [
        getattr(value, "jaxpr", value) for value in params.values() if hasattr(value, "jaxpr") or hasattr(value, "eqns")
    ]
    if inner:
        return _count(inner[0])
    out, given = equation.outvars[0].aval, [variable.aval for variable in equation.invars]
    if not jax.numpy.issubdtype(out.dtype, jax.numpy.floating):
        return Counter()
    if name == "dot_general":
        (contracted, _), _ = params["dimension_numbers"]
        return Counter(products=2 * out.size * math.prod(given[0].shape[axis] for axis in contracted))
    if name in _SUMS:
        return Counter(elementwise=given[0].size - (out.size if name.startswith("reduce") else 0))
    if name == "integer_pow":
        power = abs(params["y"])
        return Counter(elementwise=out.size * (power.bit_length() + power.bit_count() - 2 + (params["y"] < 0)))
    if name == "scatter-add":
        return Counter(elementwise=given[2].size)
    if name in _ELEMENTWISE:
        return Counter(elementwise=out.size)
    if name in _SPECIAL:
        return Counter(special=out.size)
    return Counter(factorizations=round(_factorization(name, given)))


def _factorization(name: str, given: list[Any]) -> float:
    """Textbook count of a library's routine on its arguments; 0 for what computes nothing."""
    if name not in ("cholesky", "triangular_solve", "geqrf", "qr", "householder_product", "eigh", "lu", "svd"):
        return 0
    shape = given[-1].shape if name == "triangular_solve" else given[0].shape
    *batch, m, n = shape
    k = min(m, n)
    counts = {
        "cholesky": n**3 / 3,
        "triangular_solve": given[0].shape[-1] * m * n,
        "geqrf": 2 * k**2 * (max(m, n) - k / 3),
        "qr": 2 * k**2 * (max(m, n) - k / 3),
        "householder_product": 2 * k**2 * (max(m, n) - k / 3),
        "eigh": 9 * n**3,
        "lu": 2 * n**3 / 3,
        "svd": 4 * m * n**2 + 8 * n**3,
    }
    return math.prod(batch) * counts[name]


def _times(found: Counter[str], turns: int) -> Counter[str]:
    return Counter({name: count if name == "open_loops" else turns * count for name, count in found.items()})
