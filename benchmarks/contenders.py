"""The packages, each given the same functions and asked for the same things."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from problems import Problem

import gainful as gf


class Gainful:
    """This package."""

    def __init__(self, problem: Problem, kind: str) -> None:
        f, h = problem.f, problem.h
        self.model = gf.discrete_model(
            lambda x, u, t: f(x),
            lambda x, u, t: h(x),
            states=len(problem.mean),
            outputs=len(problem.R),
            Q=problem.Q,
            R=problem.R,
        )
        make = {"EKF": gf.extended_kalman_filter, "UKF": gf.unscented_kalman_filter}[kind]
        self.filter, self.problem = make(), problem
        self.prior = gf.make_prior(self.model, problem.mean, cov=problem.cov)
        log = gf.make_log(self.model, np.arange(len(problem.y)) * problem.dt, problem.y)
        self.samples = jax.tree.map(jnp.asarray, gf.samples_of(log, float))

    def batch(self) -> Callable:
        fn = jax.jit(lambda samples: gf.scan(self.filter, self.model, self.prior, samples)[1].estimate)
        return lambda: fn(self.samples).mean

    def many(self, runs: int, rows: int) -> Callable:
        records = jax.tree.map(lambda v: jnp.broadcast_to(v[:rows], (runs, *v[:rows].shape)), self.samples)
        priors = jax.tree.map(lambda v: jnp.broadcast_to(v, (runs, *v.shape)), self.prior)
        return lambda: gf.run_many(self.filter, self.model, priors, records)[1].estimate.mean

    def live(self) -> Callable:
        online = gf.OnlineFilter(self.filter, self.model, self.prior)
        clock = (k * self.problem.dt for k in itertools.count())
        y = self.problem.y[0]
        return lambda: online.push(next(clock), y).mean


class Dynamax:
    """dynamax: its filters under the caller's own jit, and a record of one row where it has no step."""

    def __init__(self, problem: Problem, kind: str) -> None:
        from dynamax.nonlinear_gaussian_ssm import (
            ParamsNLGSSM,
            UKFHyperParams,
            extended_kalman_filter,
            unscented_kalman_filter,
        )

        self.problem = problem
        p = problem
        arrays = [jnp.asarray(a) for a in (p.mean, p.cov, p.Q, p.R)]

        def params(mean, cov):
            return ParamsNLGSSM(mean, cov, p.f, arrays[2], p.h, arrays[3])

        if kind == "EKF":
            self.run = lambda y, mean=arrays[0], cov=arrays[1]: extended_kalman_filter(params(mean, cov), y)
        else:
            points = UKFHyperParams(alpha=1.0, beta=2.0, kappa=0)
            self.run = lambda y, mean=arrays[0], cov=arrays[1]: unscented_kalman_filter(params(mean, cov), y, points)
        self.arrays = arrays

    def batch(self) -> Callable:
        fn, y = jax.jit(lambda y: self.run(y)), jnp.asarray(self.problem.y)
        return lambda: fn(y).filtered_means

    def many(self, runs: int, rows: int) -> Callable:
        y = self.problem.y[:rows]
        fn, y = jax.jit(jax.vmap(lambda y: self.run(y))), jnp.asarray(np.broadcast_to(y, (runs, *y.shape)))
        return lambda: fn(y).filtered_means

    def live(self) -> Callable:
        fn = jax.jit(lambda y, mean, cov: self.run(y, mean, cov))
        memory = [self.arrays[0], self.arrays[1]]

        def push():
            after = fn(self.problem.y[:1], *memory)
            memory[:] = after.filtered_means[0], after.filtered_covariances[0]
            return np.asarray(memory[0])

        return push


class Cuthbert:
    """cuthbert: its moment filter with Taylor linearization."""

    def __init__(self, problem: Problem, kind: str) -> None:
        import cuthbert
        from cuthbert.gaussian import moments

        p = problem
        self.problem, root_q, root_r = p, jnp.linalg.cholesky(p.Q), jnp.linalg.cholesky(p.R)
        self.filter = moments.build_filter(
            jnp.asarray(p.mean),
            jnp.linalg.cholesky(p.cov),
            lambda state, inputs: (lambda x: (p.f(x), root_q), state.mean),
            lambda state, inputs: (lambda x: (p.h(x), root_r), state.mean, inputs),
        )
        self.run = lambda y: cuthbert.filter(self.filter, y, self.filter.init_prepare())

    def batch(self) -> Callable:
        fn, y = jax.jit(lambda y: self.run(y)), jnp.asarray(self.problem.y)
        return lambda: fn(y).mean

    def many(self, runs: int, rows: int) -> Callable:
        y = self.problem.y[:rows]
        fn, y = jax.jit(jax.vmap(lambda y: self.run(y))), jnp.asarray(np.broadcast_to(y, (runs, *y.shape)))
        return lambda: fn(y).mean

    def live(self) -> Callable:
        step = jax.jit(lambda state, y: self.filter.filter_combine(state, self.filter.filter_prepare(y)))
        memory = [jax.jit(self.filter.init_prepare)()._replace(model_inputs=jnp.asarray(self.problem.y[0]))]

        def push():
            memory[0] = step(memory[0], self.problem.y[0])
            return np.asarray(memory[0].mean)

        return push


class Filterpy:
    """filterpy: NumPy, with the functions and Jacobians compiled by JAX."""

    def __init__(self, problem: Problem, kind: str) -> None:
        from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter

        f, h, jacobian_f, jacobian_h = problem.numpy_functions()
        n, m = len(problem.mean), len(problem.R)
        self.problem, self.kind = problem, kind
        if kind == "EKF":
            filter_ = ExtendedKalmanFilter(dim_x=n, dim_z=m)

            def step(y):
                filter_.F = jacobian_f(filter_.x)
                filter_.x = f(filter_.x)
                filter_.P = filter_.F @ filter_.P @ filter_.F.T + filter_.Q
                filter_.update(y, jacobian_h, h)
                return filter_.x
        else:
            points = MerweScaledSigmaPoints(n, alpha=1.0, beta=2.0, kappa=0.0)
            filter_ = UnscentedKalmanFilter(n, m, problem.dt, hx=h, fx=lambda x, dt: f(x), points=points)

            def step(y):
                filter_.predict()
                filter_.update(y)
                return filter_.x

        filter_.x, filter_.P, filter_.Q, filter_.R = problem.mean.copy(), problem.cov.copy(), problem.Q, problem.R
        self.step = step

    def batch(self) -> Callable:
        rows = self.problem.y[:200]

        def run():
            for y in rows:
                self.step(y)

        run.rows = len(rows)
        return run

    def many(self, runs: int, rows: int) -> None:
        return None

    def live(self) -> Callable:
        return lambda: self.step(self.problem.y[0])


PACKAGES = {"gainful": Gainful, "dynamax": Dynamax, "cuthbert": Cuthbert, "filterpy": Filterpy}
"""What each is called in the table."""

LACKS = {("cuthbert", "UKF")}
"""Pairs that do not exist."""
