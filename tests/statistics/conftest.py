"""Records drawn from models, and the results of filtering them, one or two hundred at a time."""

import dataclasses
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.filters import Info
from gainful.models import Instant, Sample
from gainful.running import Timing, draw

RUNS = 200


def result(estimator, model, prior, log, info):
    """The result `run` would have made of these reports."""
    given = {field.name: getattr(info, field.name) for field in dataclasses.fields(Info)}
    given |= {"estimates": given.pop("estimate"), "memories": given.pop("memory")}
    return gf.Result(estimator, model, prior, log, timing=Timing(0.0, 0.0), **given)


def drawn(model, prior, t):
    """A case: model, prior, times and `RUNS` records with their true states."""
    times = jnp.asarray(t)
    moments = Instant(times, jnp.diff(times, prepend=times[0]), jnp.zeros((len(times), 0)))
    keys = jax.random.split(jax.random.key(0), RUNS)
    truth, y = jax.jit(jax.vmap(lambda key: draw(model, prior, moments, key)))(keys)
    difference = jax.jit(jax.vmap(jax.vmap(model.space.minus)))
    return SimpleNamespace(model=model, prior=prior, t=t, moments=moments, truth=truth, y=y, difference=difference)


@pytest.fixture(scope="session")
def pendulum():
    model = gf.continuous_model(
        lambda x, u, t: jnp.array([x[1], -9.81 * jnp.sin(x[0]) - 0.2 * x[1]]),
        lambda x, u, t: x[:1],
        states={"swing": "rad", "rate": "rad/s"},
        outputs={"encoder": "rad"},
        Q=[1e-6, 0.05],
        R=0.05**2,
    )
    return drawn(model, gf.make_prior(model, [0.8, 0.0], [0.1, 0.2]), 0.05 * np.arange(60))


@pytest.fixture(scope="session")
def radar():
    F = np.eye(4) + np.eye(4, k=2)
    model = gf.discrete_model(
        lambda x, u, t: F @ x,
        lambda x, u, t: jnp.array([jnp.hypot(x[0], x[1]), jnp.arctan2(x[1], x[0])]),
        states={"east": "m", "north": "m", "east_speed": "m/s", "north_speed": "m/s"},
        outputs={"range": "m", "bearing": "angle"},
        Q=[0.03, 0.03, 0.1, 0.1],
        R=[5.0**2, 0.01**2],
    )
    # West of the radar, where the bearing wraps.
    prior = gf.make_prior(model, [-1000.0, 30.0, 2.0, -2.0], [10.0, 10.0, 1.0, 1.0])
    return drawn(model, prior, np.arange(40.0))


@pytest.fixture(scope="session")
def many():
    """All records of a case through a filter at once: stacked reports, errors and covariances."""

    def filtered(case, estimator, *, believed=None):
        def repeated(tree):
            return jax.tree.map(lambda leaf: jnp.repeat(leaf[None], RUNS, 0) if eqx.is_array(leaf) else leaf, tree)

        samples = Sample(repeated(case.moments), case.y, jnp.ones((RUNS, len(case.t), case.model.output.dof), bool))
        _, info = gf.run_many(estimator, believed or case.model, repeated(case.prior), samples)
        errors = case.difference(case.truth, info.estimate.mean)
        return SimpleNamespace(info=info, errors=np.asarray(errors), covs=np.asarray(info.estimate.cov))

    return filtered


@pytest.fixture(scope="session")
def results():
    """The result of every run, as `run` would have returned it."""

    def listed(case, estimator, batch):
        truth, y = np.asarray(case.truth), np.asarray(case.y)
        info = jax.tree.map(lambda leaf: np.asarray(leaf) if eqx.is_array(leaf) else leaf, batch.info)
        for k in range(RUNS):
            one = jax.tree.map(lambda leaf, k=k: leaf[k] if isinstance(leaf, np.ndarray) else leaf, info)
            columns = {name: truth[k, :, j] for j, name in enumerate(case.model.space.names)}
            log = gf.make_log(case.model, case.t, y[k], truth=columns)
            yield result(estimator, case.model, case.prior, log, one)

    return listed


@pytest.fixture(scope="session")
def standing():
    """A result whose estimates are the prior in every row, for diagnostics that need no filter."""

    def made(model, prior, log):
        rows, m = len(log), model.output.dof
        estimates = jax.tree.map(lambda leaf: jnp.repeat(leaf[None], rows, 0) if eqx.is_array(leaf) else leaf, prior)
        units = np.broadcast_to(np.eye(m), (rows, m, m))
        zeros, nothing = np.zeros(rows), np.zeros((rows, m))
        info = Info(estimates, None, nothing, units, zeros, zeros, nothing + 1, np.zeros(rows, int))
        return result(gf.kalman_filter(), model, prior, log, info)

    return made


@pytest.fixture(scope="session")
def drifting():
    """A body that drifts, its position measured by two sensors, and a record of 600 rows."""
    model = gf.discrete_model(
        lambda x, u, t: jnp.array([x[0] + 0.1 * x[1], 0.9 * x[1]]),
        states={"position": "m", "speed": "m/s"},
        Q=[1e-3, 0.05],
        sensors=[
            gf.sensor("laser", lambda x, u, t: x[:1], outputs={"laser": "m"}, R=0.1),
            gf.sensor("radar", lambda x, u, t: x[:1], outputs={"radar": "m"}, R=0.4),
        ],
    )
    prior = gf.make_prior(model, [0.0, 0.0], [1.0, 1.0])
    log = gf.draw_log(model, prior, 0.1 * np.arange(600), key=jax.random.key(7))
    return SimpleNamespace(model=model, prior=prior, log=log)


@pytest.fixture(scope="session")
def logged(drifting):
    """The drifting body's record with other measurements."""

    def made(y, *, rows=slice(None), **options):
        truth = {name: values[rows] for name, values in drifting.log.truth.items()}
        return gf.make_log(drifting.model, drifting.log.t[rows], y[rows], truth=truth, **options)

    return made
