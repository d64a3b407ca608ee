"""What a run leaves behind."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import scipy.special
from jaxtyping import Float

from ..errors import MissingExtraError, Status
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator
from ..models import AbstractModel
from ..spaces import AbstractSpace
from .log import Log


@dataclasses.dataclass(frozen=True)
class Timing:
    """Seconds spent compiling and running."""

    compile: float
    run: float


@dataclasses.dataclass(frozen=True)
class Result:
    """Estimates along a record, with all that is needed to judge them.

    Arrays have one row per row of the log; `log.kept` leaves out rows that only split a long interval.

    Attributes:
        estimator: what made the estimates.
        model: of the plant.
        prior: the estimate before the first row.
        log: the record.
        estimates: all estimates, stacked along time.
        memories: what the estimator's parts remembered after each row.
        residual: measured minus expected, 0 where unseen (T, m).
        residual_cov: covariance of the residuals (T, m, m).
        nis: normalised innovation squared (T,).
        log_likelihood: log density of each row's measurement (T,).
        weight: how far each component counted: 1 in full, 0 not at all (T, m).
        status: `Status` codes (T,).
        timing: seconds spent compiling and running.
        warnings: what a reader of the numbers should know.
        filtered: the filter's own result where this one is smoothed.
        lag: how far ahead of its row a smoothed estimate looks [s]; None if over the whole record.
    """

    estimator: AbstractEstimator
    model: AbstractModel
    prior: AbstractEstimate
    log: Log
    estimates: AbstractEstimate
    memories: Any
    residual: np.ndarray
    residual_cov: np.ndarray
    nis: np.ndarray
    log_likelihood: np.ndarray
    weight: np.ndarray
    status: np.ndarray
    timing: Timing
    warnings: tuple[str, ...] = ()
    filtered: Result | None = None
    lag: float | None = None

    @property
    def t(self) -> np.ndarray:
        """Times [s] (T,)."""
        return self.log.t

    @property
    def seen(self) -> np.ndarray:
        """Which components were measured (T, m)."""
        return self.log.seen

    @property
    def smoothed(self) -> bool:
        """Whether estimates use what came after them: the whole record, or `lag` seconds of it."""
        return self.filtered is not None

    @functools.cached_property
    def mean(self) -> np.ndarray:
        """Estimated states (T, size)."""
        return np.asarray(self.estimates.mean)

    @functools.cached_property
    def cov(self) -> np.ndarray:
        """Their covariances in tangent coordinates (T, dof, dof)."""
        return np.asarray(jax.vmap(lambda estimate: estimate.cov)(self.estimates))

    @property
    def std(self) -> np.ndarray:
        """Standard deviations in tangent coordinates (T, dof)."""
        return np.sqrt(np.maximum(np.diagonal(self.cov, axis1=1, axis2=2), 0.0))

    def __getitem__(self, name: str) -> np.ndarray:
        """The estimates of one state by name (T,)."""
        names = self.model.space.names
        if name not in names:
            raise KeyError(f"{name!r} is not a state; states: {', '.join(names)}")
        return self.mean[:, names.index(name)]

    def bands(self, level: float = 0.95) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper ends of central intervals at `level` for states stored as one number, NaN for others (T, size)."""
        z = float(scipy.special.ndtri(0.5 + 0.5 * level))
        lower, upper = np.full(self.mean.shape, np.nan), np.full(self.mean.shape, np.nan)
        i = j = 0
        for part in self.model.space.parts:
            if part.size == part.dof:
                here, sigma = jnp.asarray(self.mean[:, i : i + part.size]), jnp.asarray(self.std[:, j : j + part.dof])
                # An angle's band is drawn around its estimate, not wrapped into two pieces.
                plus = (lambda x, d: x + d) if type(part).__name__ == "Circle" else part.plus
                lower[:, i : i + part.size] = jax.vmap(plus)(here, -z * sigma)
                upper[:, i : i + part.size] = jax.vmap(plus)(here, z * sigma)
            i, j = i + part.size, j + part.dof
        return lower, upper

    def error(self) -> np.ndarray:
        """Truth minus estimate in tangent coordinates, NaN where there is no truth (T, dof)."""
        names, none = self.model.space.names, np.full(len(self.t), np.nan)
        return apart(self.model.space, np.stack([self.log.truth.get(name, none) for name in names], axis=1), self.mean)

    def counts(self) -> dict[str, int]:
        """How many rows ended in each status, by its name."""
        kept = self.status[self.log.kept]
        return {status.name: int((kept == status).sum()) for status in Status if (kept == status).any()}

    def to_pandas(self) -> Any:
        """A table with the estimates, standard deviations and truth, indexed by time [s]; needs pandas."""
        try:
            import pandas as pd
        except ImportError as problem:
            raise MissingExtraError("to_pandas needs pandas: pip install 'gainful[io]'") from problem
        space, kept = self.model.space, self.log.kept
        columns: dict[str, np.ndarray] = {name: self[name][kept] for name in space.names}
        columns |= {f"std_{name}": self.std[kept, j] for j, name in enumerate(space.tangent_names)}
        columns |= {f"true_{name}": values[kept] for name, values in self.log.truth.items()}
        columns["status"] = self.status[kept]
        return pd.DataFrame(columns, index=pd.Index(self.t[kept], name="t"))

    def to_xarray(self, attributes: dict[str, str] | None = None) -> Any:
        """A labelled data set with states, covariances, innovations and truth; needs xarray."""
        try:
            import xarray as xr
        except ImportError as problem:
            raise MissingExtraError("to_xarray needs xarray: pip install 'gainful[io]'") from problem
        space, output, kept = self.model.space, self.model.output, self.log.kept
        truth = np.stack([self.log.truth.get(name, np.full(len(self.t), np.nan)) for name in space.names], axis=1)
        seen = self.seen[kept]
        data = {
            "mean": (("t", "state"), self.mean[kept]),
            "covariance": (("t", "tangent", "tangent_column"), self.cov[kept]),
            "truth": (("t", "state"), truth[kept]),
            "innovation": (("t", "signal"), np.where(seen, self.residual[kept], np.nan)),
            "innovation_covariance": (("t", "signal", "signal_column"), self.residual_cov[kept]),
            "nis": ("t", np.where(seen.any(axis=1), self.nis[kept], np.nan)),
            "log_likelihood": ("t", self.log_likelihood[kept]),
            "weight": (("t", "signal"), np.where(seen, self.weight[kept], np.nan)),
            "status": ("t", self.status[kept]),
        }
        coordinates = {
            "t": ("t", self.t[kept], {"units": "s"}),
            "state": list(space.names),
            "state_unit": ("state", list(space.units)),
            "tangent": list(space.tangent_names),
            "tangent_unit": ("tangent", list(space.tangent_units)),
            "tangent_column": list(space.tangent_names),
            "signal": list(output.tangent_names),
            "signal_unit": ("signal", list(output.tangent_units)),
            "signal_column": list(output.tangent_names),
        }
        kind = "smoothed" if self.smoothed else "filtered"
        legend = ", ".join(f"{status.value} {status.name}" for status in Status)
        return xr.Dataset(data, coordinates, {"estimates": kind, "status_codes": legend} | (attributes or {}))


def apart(
    space: AbstractSpace, truth: Float[np.ndarray, "T size"], mean: Float[np.ndarray, "T size"]
) -> Float[np.ndarray, "T dof"]:
    """Truth minus estimate in tangent coordinates, NaN where there is no truth."""
    out, i = [], 0
    for part in space.parts:
        columns, here = truth[:, i : i + part.size], jnp.asarray(mean[:, i : i + part.size])
        if part.size != part.dof:
            valid = np.isfinite(columns).all(axis=1, keepdims=True)
            difference = np.asarray(jax.vmap(part.minus)(jnp.where(valid, columns, here), here))
            out.append(np.where(valid, difference, np.nan))
        else:
            out.append(np.asarray(jax.vmap(part.minus)(jnp.asarray(columns), here)))
        i += part.size
    return np.concatenate(out, axis=1)
