"""The library against statsmodels, and against published numbers on the flow of the Nile."""

import warnings

import numpy as np
import pytest

import gainful as gf

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    statsmodels = pytest.importorskip(
        "statsmodels.api", reason="statsmodels is a peer to compare with, not a dependency"
    )

IRREGULAR, LEVEL = 15099.0, 1469.1  # (10^8 m^3)^2; Durbin and Koopman (2012), section 2.2.5


def _peer(
    y: np.ndarray, F: np.ndarray, H: np.ndarray, Q: np.ndarray, R: np.ndarray, x: np.ndarray, P: np.ndarray
) -> object:
    """statsmodels' own filter of the same model, which predicts after each row and not before."""
    model = statsmodels.tsa.statespace.MLEModel(y, k_states=len(F), k_posdef=len(F))
    model["transition"], model["design"], model["selection"] = F, H, np.eye(len(F))
    model["state_cov"], model["obs_cov"] = Q, R
    model.ssm.initialize_known(x, P)
    return model.ssm.smooth()


def _compare(ours: gf.Result, theirs: object, tolerance: float) -> None:
    smoothed = gf.smooth(ours)
    scale = ours.std.max()
    for actual, name, unit in (
        (ours.mean, "filtered_state", scale),
        (ours.cov, "filtered_state_cov", scale**2),
        (smoothed.mean, "smoothed_state", scale),
        (smoothed.cov, "smoothed_state_cov", scale**2),
    ):
        expected = np.moveaxis(getattr(theirs, name), -1, 0)
        np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance * unit, err_msg=name)
    np.testing.assert_allclose(ours.log_likelihood, theirs.llf_obs, rtol=0, atol=100 * tolerance)  # type: ignore[attr-defined]


def test_filter_smoother_and_likelihood_agree_with_partly_missing_rows(rng: np.random.Generator) -> None:
    F = np.array([[0.9, 0.2, 0.0], [-0.1, 0.8, 0.1], [0.0, 0.0, 1.0]])
    H = np.array([[1.0, 0.0, 0.3], [0.2, 1.0, 0.0]])
    root = rng.normal(size=(3, 3))
    Q, R, P = 0.05 * root @ root.T, np.array([[0.3, 0.1], [0.1, 0.4]]), np.diag([1.0, 2.0, 0.5])
    x, y = np.array([0.5, -0.5, 0.1]), rng.normal(size=(40, 2))
    y[rng.random(size=y.shape) < 0.25] = np.nan
    y[10:13] = np.nan
    model = gf.linear_model(F, H, Q=Q, R=R)
    ours = gf.run(gf.kalman_filter(), model, gf.make_prior(model, x, cov=P), gf.make_log(model, np.arange(40), y))
    # Condition numbers below 1e3 and forty rows; statsmodels drops the tail once its covariance stops changing by 1e-19.
    _compare(ours, _peer(y, F, H, Q, R, x, P), 1e-11)


@pytest.fixture(scope="module")
def flow() -> np.ndarray:
    return statsmodels.datasets.nile.load().data["volume"].to_numpy(dtype=float)


@pytest.fixture(scope="module")
def nile(flow: np.ndarray) -> tuple[gf.Result, gf.Result]:
    """The flow filtered as it is, and with the years 1891-1910 and 1931-1950 missing, as in section 2.7."""
    model = gf.linear_model([[1.0]], [[1.0]], Q=LEVEL, R=IRREGULAR)
    prior = gf.make_prior(model, [0.0], cov=[[1e7]])
    gaps = flow.copy()
    gaps[20:40] = gaps[60:80] = np.nan
    full, missing = (
        gf.run(gf.kalman_filter(), model, prior, gf.make_log(model, 1871.0 + np.arange(100), y)) for y in (flow, gaps)
    )
    return full, missing


def test_the_nile_agrees_with_and_without_gaps(flow: np.ndarray, nile: tuple[gf.Result, gf.Result]) -> None:
    one = np.eye(1)
    for ours in nile:
        y = np.where(ours.seen[:, 0], flow, np.nan)
        theirs = _peer(y[:, None], one, one, LEVEL * one, IRREGULAR * one, np.zeros(1), 1e7 * one)
        # 1e7 against 15099 loses three digits at the start.
        _compare(ours, theirs, 1e-11)


def test_the_nile_has_the_published_likelihood(nile: tuple[gf.Result, gf.Result]) -> None:
    # -632.5442 for a1 = 0, P1 = 1e7 from the second year on (StateSpaceModels.jl, test/models/locallevel.jl, after
    # Durbin and Koopman 2.2.5; there to 6e-3), -632.5376 for the exact diffuse start (the same file).
    full, _ = nile
    assert full.log_likelihood[1:].sum() == pytest.approx(-632.5442, abs=6e-3)


def test_the_nile_reaches_the_published_steady_state(nile: tuple[gf.Result, gf.Result]) -> None:
    # Durbin and Koopman (2012), section 2.11: P = sigma_eps^2 (q + sqrt(q^2 + 4 q)) / 2 one step ahead.
    full, missing = nile
    q = LEVEL / IRREGULAR
    ahead = IRREGULAR * (q + np.sqrt(q**2 + 4 * q)) / 2
    assert full.cov[-1, 0, 0] + LEVEL == pytest.approx(ahead, rel=1e-12)
    # Over a gap the variance grows by the level's variance each year, and the level stays (section 2.7).
    np.testing.assert_allclose(missing.cov[20:40, 0, 0], missing.cov[19, 0, 0] + LEVEL * np.arange(1, 21), rtol=1e-13)
    np.testing.assert_array_equal(missing.mean[20:40, 0], missing.mean[19, 0])
    # Between the years around it, the smoothed level is a straight line there.
    bend = np.diff(gf.smooth(missing).mean[19:41, 0], 2)
    assert np.abs(bend).max() < 1e-9
