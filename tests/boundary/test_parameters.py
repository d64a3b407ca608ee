"""Parameters and robust updates in a configuration: what they become, and what is refused."""

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.config import build_filter, build_injections, build_parameters, build_prior, parse_config
from gainful.errors import ConfigError


def spring() -> gf.models.model.Model:
    return gf.continuous_model(
        lambda x, u, t, p: jnp.stack([x[1], -p["stiffness"] * x[0] - p["damping"] * x[1]]),
        lambda x: x[:1],
        states=["x", "v"],
        outputs=["y"],
        Q=[0.0, 0.01],
        R=0.04,
        parameters={"stiffness": 2.0, "damping": 0.1},
    )


def config(**sections):
    base = {
        "model": {"catalogue": "constant_velocity"},
        "data": {"file": "log.csv", "outputs": {"y": "y"}},
        "prior": {"mean": {"x": 0.0, "v": 0.0}, "std": {"x": 1.0, "v": 1.0}},
    }
    return parse_config(base | sections)


def built(**sections):
    made = config(**sections)
    model = build_parameters(made, spring())
    return build_filter(made, model), model, build_prior(made, model)


def test_a_parameter_starts_at_the_models_value_with_its_own_sigma():
    chosen, model, prior = built(parameters={"stiffness": {"sigma": 0.5}, "damping": {"sigma": 0.02, "start": 0.2}})
    assert model.space.names == ("x", "v", "stiffness", "damping")
    assert prior.mean.tolist() == [0.0, 0.0, 2.0, 0.2]
    np.testing.assert_allclose(np.sqrt(np.diag(prior.cov)), [1.0, 1.0, 0.5, 0.02])
    assert chosen == gf.extended_kalman_filter()


def test_a_prior_given_as_a_list_is_continued():
    prior = built(parameters={"stiffness": {"sigma": 0.5}}, prior={"mean": [0.1, 0.2], "std": [1.0, 2.0]})[2]
    assert prior.mean.tolist() == [0.1, 0.2, 2.0]
    np.testing.assert_allclose(np.sqrt(np.diag(prior.cov)), [1.0, 2.0, 0.5])


def test_walks_are_capped_and_jumps_looked_for_in_tangent_units():
    section = {"sigma": 0.5, "walk": 0.01, "bounds": [0.0], "jump": 0.6}
    chosen, model, prior = built(parameters={"stiffness": section}, update={"kind": "student_t", "dof": 5.0})
    # Of a positive parameter the covariance holds the logarithm: sizes are relative to the start, 2.
    assert model.space.tangent_names[-1] == "log(stiffness)"
    assert chosen.noise.limits == pytest.approx({"log(stiffness)": 0.25})
    assert chosen.update.jumps == pytest.approx({"log(stiffness)": 0.3})
    assert chosen.update.inner == gf.StudentT(dof=5.0)
    assert float(prior.cov[-1, -1]) == pytest.approx(0.0625)


def test_an_update_by_its_name_is_gated_where_the_options_ask_for_it():
    chosen = built(update="masreliez_martin", options={"gate": 0.999})[0]
    assert chosen.update == gf.Gated(gf.MasreliezMartin(), 0.999)


@pytest.mark.parametrize(
    ("sections", "expected"),
    [
        (
            {"parameters": {"stifness": {"sigma": 1.0}}},
            "parameters: 'stifness' is not a parameter of the model; did you",
        ),
        (
            {"parameters": {"stiffness": {"sigma": 0.0}}},
            "parameters.stiffness.sigma: expected a number above 0, got 0.0",
        ),
        (
            {"parameters": {"stiffness": {"sigma": 1.0, "walk": -0.1}}},
            "parameters.stiffness.walk: expected a number at least 0, got -0.1",
        ),
        (
            {"parameters": {"stiffness": {"sigma": 1.0, "bounds": [0.0, 1.0, 2.0]}}},
            "parameters.stiffness.bounds: expected one or two numbers, got [0.0, 1.0, 2.0]",
        ),
        ({"parameters": {"stiffness": {"walk": 0.1}}}, "parameters.stiffness.sigma: missing"),
        (
            {"parameters": {"stiffness": {"sigma": 1.0, "jmp": 1.0}}},
            "parameters.stiffness.jmp: unknown key; did you mean",
        ),
        (
            {
                "parameters": {"stiffness": {"sigma": 1.0}},
                "prior": {"mean": {"x": 0, "v": 0, "stiffness": 1}, "std": {"x": 1, "v": 1}},
            },
            "prior.mean.stiffness: expected it in [parameters] alone, got it in both",
        ),
        (
            {
                "parameters": {"stiffness": {"sigma": 1.0}},
                "prior": {"mean": [0.0, 0.0], "cov": [[1.0, 0.0], [0.0, 1.0]]},
            },
            'prior.cov: expected "std" where there are [parameters], which bring their own sigma',
        ),
        ({"update": "student"}, "update.kind: 'student' is not known here; did you mean 'student_t'"),
        (
            {"update": "exact", "filter": {"kind": "ekf", "update": "exact"}},
            "update: expected it here or in filter.update, got it in both",
        ),
        ({"update": "exact", "filter": "glr"}, "update: expected a single filter to have it, got a Generalized"),
        (
            {"parameters": {"stiffness": {"sigma": 1.0, "jump": 1.0}}, "filter": "glr"},
            "parameters: expected a single filter to watch them, got a Generalized",
        ),
    ],
)
def test_what_cannot_be_is_told_with_its_key(sections, expected):
    with pytest.raises(ConfigError) as caught:
        built(**sections)
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ({"kind": "outliers"}, 'inject.share: missing; which share of the values are "outliers"?'),
        ({"kind": "noise", "share": 0.1}, 'inject.share: has no effect with kind = "noise"'),
        ({"kind": "outliers", "share": 1.5}, "share: expected a number from 0 to 1, got 1.5"),
    ],
)
def test_a_share_belongs_to_outliers_alone(fault, expected):
    made = config(inject=[{"signal": "y", "size": 1.0, "onset": 0.0} | fault])
    log = gf.make_log(spring(), [0.0, 1.0], [0.0, 0.0])
    with pytest.raises(ConfigError) as caught:
        build_injections(made, log, spring())
    assert expected in str(caught.value)


def test_a_share_of_a_record_is_made_outliers():
    made = config(inject=[{"kind": "outliers", "signal": "y", "size": 20.0, "onset": 100.0, "share": 0.2}])
    log = gf.make_log(spring(), np.arange(1000.0), np.zeros(1000))
    y = build_injections(made, log, spring()).y[:, 0]
    assert not y[:100].any()
    gross = y[100:] != 0
    # Five standard deviations of a binomial share, and of a standard deviation from 180 values.
    assert abs(gross.mean() - 0.2) < 5 * np.sqrt(0.2 * 0.8 / 900)
    assert abs(y[100:][gross].std() / 20.0 - 1.0) < 5 / np.sqrt(2 * 180)
