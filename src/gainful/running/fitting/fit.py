"""Fitting the noise of a model to records."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from ...errors import ConfigError, NumericalError, did_you_mean
from ...estimates import AbstractEstimate
from ...filters import AbstractEstimator
from ...models import AbstractModel
from ..log import Log
from ..run import run
from .entries import Names, noise_entries, typical_noise
from .expectation import by_expectation
from .likelihood import ONE_SIDED, by_likelihood, curvature, upper_limit
from .moments import by_moments
from .noise_fit import FittedEntry, NoiseFit, relative_errors
from .problem import Outliers, Problem
from .records import make_records
from .search import Search
from .truth import by_truth

METHODS = ("ml", "em", "moments", "truth")


def fit_noise(
    estimator: AbstractEstimator,
    model: AbstractModel,
    prior: AbstractEstimate | Sequence[AbstractEstimate],
    logs: Log | Sequence[Log],
    *,
    method: str = "ml",
    process: Names | None = None,
    measurement: Names | None = None,
    held_out: float | Log | Sequence[Log] = 0.3,
    skip: int = 0,
    floor: float = 1e-3,
    ceiling: float = 1e3,
    contamination: float | None = None,
    iterations: int = 200,
    starts: int = 1,
    seed: int = 0,
) -> NoiseFit:
    """Fits standard deviations of Q and R to records, with any filter of any model, and without truth.

    ```
    Q <- E Q E,  R <- D R D  with E and D diagonal, one factor per entry
    ```

    Factors on what the model has keep its structure: noise that varies along the record, noise that enters in several places,
    correlations. By default every state and output with noise is an entry, those that are correlated as one. The likelihood
    is that of the innovations, missing readings left out.

    Args:
        estimator: with noise laws to scale; banks are scaled as a whole.
        model: of the plant, with the noise to start from.
        prior: before the first row: one for all records, or one each, those held out last.
        logs: one record or several, which are pooled.
        method: "ml", the likelihood by gradient; "em", the same by smoothing; "moments" of the innovations (linear models,
            records without gaps); "truth", the least errors against the records' truth.
        process: names of states to fit, in groups of names that share a factor; none for `()`, all by default.
        measurement: names of outputs, likewise.
        held_out: what is not fitted and shows what the fit is worth: a share at the end, of the rows of one record or of
            several records, or other records.
        skip: measured rows at the start of each record that count for nothing.
        floor: smallest factor on a standard deviation.
        ceiling: largest such factor.
        contamination: share of readings that may be outliers, and then do not make R large. By default none, but one in a
            hundred where the filter itself leaves readings out or hardly counts them.
        iterations: of the search at most.
        starts: of "ml", the further ones drawn between a tenth and ten times the first.
        seed: of those.

    Raises:
        ConfigError: an argument that is no such thing, or a method that the model or the records cannot have.
        NumericalError: the filter fails with the noise it starts from, or its likelihood has no derivative.
        ShapeError, CovarianceError, ModelError, DataError: parts that do not fit each other.

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> told, true = (gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=R) for R in (1.0, 4.0))
        >>> prior = gf.make_prior(told, [0.0], [1.0])
        >>> log = gf.draw_log(true, prior, np.arange(1000.0), key=jax.random.key(1))
        >>> fit = fit_noise(gf.kalman_filter(), told, prior, log)
        >>> round(fit.outputs["y0"], 1), fit.held_fitted > fit.held_start
        (2.0, True)
    """
    _check(method, floor, ceiling, iterations, starts, contamination)
    records = make_records((estimator, model), prior, logs, held_out, skip)
    typical = typical_noise(model, records[0].prior, records[0].log)
    entries = noise_entries(model, typical, process, measurement)
    problem = Problem(estimator, model, entries, records, Outliers.none(model.output.dof))
    bounds, origin = (math.log(floor), math.log(ceiling)), np.zeros(len(entries))
    problem.scaled(origin)
    if not np.isfinite(problem.loss(origin)[1]).all():
        for record in records:
            run(estimator, model, record.prior, record.log)  # which says where and why it fails
        raise NumericalError(
            "fit_noise: the likelihood has no derivative in the noise; abs, sqrt and norm in the model have none at 0"
        )
    problem = problem.allowing_for(contamination)
    rng = np.random.default_rng(seed)
    further = [rng.uniform(-math.log(10), math.log(10), len(entries)) for _ in range(starts - 1)]
    searches: dict[str, Callable[[], Search]] = {
        "ml": lambda: by_likelihood(
            problem, bounds, iterations, [origin, *(np.clip(each, *bounds) for each in further)]
        ),
        "em": lambda: by_expectation(problem, bounds, iterations),
        "moments": lambda: by_moments(problem, typical, bounds),
        "truth": lambda: by_truth(problem, bounds, iterations),
    }
    found = searches[method]()
    at = ["floor" if x <= bounds[0] + 1e-9 else "ceiling" if x >= bounds[1] - 1e-9 else "" for x in found.logs]
    errors = np.full(len(entries), np.nan)
    if method in ("ml", "em"):
        errors = relative_errors(curvature(problem, found.logs, found.rough), np.array([not each for each in at]))
    fitted = []
    for i, (entry, log, error, bound) in enumerate(zip(entries, found.logs, errors, at, strict=True)):
        before, factor = typical.of(entry, model), float(np.exp(log))
        known = None if np.isnan(error) else float(error)
        one = FittedEntry(entry, before, tuple(factor * each for each in before), factor, known, None, bound)
        if found.rough and one.flat:  # jumps would end a search for a limit anywhere
            one = dataclasses.replace(one, limit=factor * math.exp(ONE_SIDED * error) if math.isfinite(error) else None)
        elif one.flat or (bound == "floor" and method in ("ml", "em")):
            limit = upper_limit(problem, found.logs, i, bounds[1])
            one = dataclasses.replace(one, limit=None if limit is None else math.exp(limit))
        fitted.append(one)
    values = [problem.loss(logs, held) for held in (False, True) for logs in (origin, found.logs)]
    likelihoods = [-value if count else math.nan for value, _, count in values]
    return NoiseFit(
        method,
        tuple(fitted),
        problem.scaled(found.logs),
        *likelihoods,
        rows=values[0][2],
        held_rows=values[2][2],
        iterations=found.iterations,
        converged=found.converged,
        path=found.path,
        step=typical.step,
        contamination=float(problem.outliers.share),
    )


def _check(
    method: str, floor: float, ceiling: float, iterations: int, starts: int, contamination: float | None
) -> None:
    if method not in METHODS:
        raise ConfigError(f"method: {method!r} is not known; {did_you_mean(str(method), METHODS)}")
    if not 0 < floor <= 1:
        raise ConfigError(f"floor: expected a factor above 0 and at most 1, got {floor!r}")
    if not 1 <= ceiling < math.inf:
        raise ConfigError(f"ceiling: expected a finite factor of at least 1, got {ceiling!r}")
    for name, value in (("iterations", iterations), ("starts", starts)):
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise ConfigError(f"{name}: expected a whole number of at least 1, got {value!r}")
    if contamination is not None and not 0 <= contamination < 1:
        raise ConfigError(f"contamination: expected a share from 0 to below 1, got {contamination!r}")
