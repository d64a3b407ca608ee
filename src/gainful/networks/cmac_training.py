"""Training of a CMAC: one example after the other by credit, or all at once by least squares."""

from __future__ import annotations

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from jaxtyping import Array, Float, Int

from ..errors import ConfigError, DataError, did_you_mean
from .base import AbstractTraining, TrainingReport, checked_examples
from .cmac import CMAC, cells_of, check_rule, credited, empty_cmac
from .inputs import input_warnings, varying
from .tiling import Tiling, check_sizes, make_tiling

METHODS = ("credit", "ridge")


class CMACTraining(AbstractTraining):
    """How a CMAC is made from examples.

    Attributes:
        levels: quanta per input.
        layers: width of a tile in quanta.
        compress: "asinh" to give small inputs more of the levels than large ones, or "none".
        groups: inputs of each table of an additive network, counted from 0; one table of all inputs if none are given.
        method: "credit", one example after the other, or "ridge", least squares over all of them.
        rate: share of an error taken away at an example, between 0 and 2; small, to average noise.
        exponent: how much less often visited cells are blamed; 0 for not at all.
        epochs: times through the examples.
        shuffle: see the examples in random order. In the order of a record, whose errors are alike for many rows, a
            network remembers the last of them rather than their mean.
        ridge: weight of the squared weights for "ridge".
        forgetting: weight of an example against the one after it for "ridge", up to 1.
        least_visits: examples that the cells of most examples must have had; fewer are refused.
        table: "dense", "hashed", or "auto" for dense up to a million cells.
        cells: size of a hashed table.
        displacement: shift of one layer against the next along each input; all 1 if None.

    Raises:
        ConfigError: an argument out of its range.

    Source: as `CMAC`. A single table of 100 levels and 10 layers without compression, seen once, is that of Zhang, Yang and Sun
        (2010), Modern Electronics Technique 33(21):51-53.
    Reduces to: recursive least squares with the same forgetting for "ridge", which it equals.

    Example:
        >>> u = np.linspace(-1.0, 1.0, 400)[:, None]
        >>> network, report = CMACTraining(method="ridge", least_visits=1)(u, u**2, key=jax.random.key(0))
        >>> bool(report.after[0] < 1e-3 * report.before[0])
        True
    """

    levels: int = eqx.field(static=True, default=64)
    layers: int = eqx.field(static=True, default=16)
    compress: Literal["none", "asinh"] = eqx.field(static=True, default="asinh")
    groups: tuple[tuple[int, ...], ...] = eqx.field(static=True, default=())
    method: Literal["credit", "ridge"] = eqx.field(static=True, default="credit")
    rate: float = 0.05
    exponent: float = 1.2
    epochs: int = eqx.field(static=True, default=3)
    shuffle: bool = eqx.field(static=True, default=True)
    ridge: float = 1.0
    forgetting: float = 1.0
    least_visits: int = eqx.field(static=True, default=20)
    table: Literal["auto", "dense", "hashed"] = eqx.field(static=True, default="auto")
    cells: int | None = eqx.field(static=True, default=None)
    displacement: tuple[int, ...] | None = eqx.field(static=True, default=None)

    def __check_init__(self) -> None:
        check_sizes(self.levels, self.layers)
        check_rule(self.rate, self.exponent)
        if self.method not in METHODS:
            raise ConfigError(f"method: {self.method!r} is not known; {did_you_mean(str(self.method), METHODS)}")
        if isinstance(self.epochs, bool) or not isinstance(self.epochs, int) or self.epochs < 1:
            raise ConfigError(f"epochs: expected a whole number of at least 1, got {self.epochs!r}")
        if not self.ridge > 0:
            raise ConfigError(f"ridge: expected a number above 0, got {self.ridge!r}")
        if not 0 < self.forgetting <= 1:
            raise ConfigError(f"forgetting: expected a number above 0 and at most 1, got {self.forgetting!r}")

    def __call__(
        self, inputs: Float[np.ndarray, "N d"], targets: Float[np.ndarray, "N m"], *, key: Array
    ) -> tuple[CMAC, TrainingReport]:
        inputs, targets = checked_examples(inputs, targets)
        network = empty_cmac(self._tilings(inputs), inputs.shape[1], targets.shape[1])
        if self.method == "ridge":
            return train_by_least_squares(
                network, inputs, targets, self.ridge, self.forgetting, least_visits=self.least_visits
            )
        chosen = key if self.shuffle else None
        rule = (self.rate, self.exponent, self.epochs)
        return train_by_credit(network, inputs, targets, *rule, key=chosen, least_visits=self.least_visits)

    def _tilings(self, inputs: np.ndarray) -> tuple:
        groups = self.groups or (tuple(range(inputs.shape[1])),)
        shifts = self.displacement
        return tuple(
            make_tiling(
                inputs,
                columns=group,
                levels=self.levels,
                layers=self.layers,
                compress=self.compress,
                table=self.table,
                cells=self.cells,
                displacement=None if shifts is None else shifts[: len(group)],
            )
            for group in groups
        )


CMAC_PRESETS = {
    "recommended": CMACTraining(),
    "fine": CMACTraining(levels=100, layers=10, compress="none", epochs=1),
    "coarse": CMACTraining(levels=10, layers=4, compress="none", epochs=1),
}
"""The recommended table, and two readings of "ten cells": ten layers of a hundred levels, and ten levels in four layers."""


def train_by_credit(
    network: CMAC,
    inputs: Float[np.ndarray, "N d"],
    targets: Float[np.ndarray, "N m"],
    rate: float = 0.05,
    exponent: float = 1.2,
    epochs: int = 1,
    *,
    key: Array | None = None,
    least_visits: int = 20,
) -> tuple[CMAC, TrainingReport]:
    """The network after one example after the other, each by `CMAC.learned`.

    Args:
        network: where to start; its boxes stay.
        inputs: one row per example.
        targets: likewise.
        rate: share of the error taken away at each.
        exponent: how much less often visited cells are blamed.
        epochs: times through the examples.
        key: for a new random order in each epoch; in the order given without one.
        least_visits: as in `CMACTraining`.

    Raises:
        DataError: too few examples, with the number needed.
    """
    check_rule(rate, exponent)
    inputs, targets = checked_examples(inputs, targets)
    cells = _cells(network, inputs)
    _check_visits(network, cells, least_visits)
    order = np.tile(np.arange(len(inputs)), epochs)
    if key is not None:
        keys = jax.random.split(key, epochs)
        order = np.concatenate([np.asarray(jax.random.permutation(own, len(inputs))) for own in keys])
    rule = (jnp.asarray(rate, float), jnp.asarray(exponent, float), network.collides)
    weights, counts = _by_credit(network.weights, network.counts, cells, jnp.asarray(targets), jnp.asarray(order), rule)
    trained = eqx.tree_at(lambda each: (each.weights, each.counts), network, (weights, counts))
    return trained, _report(trained, inputs, targets, cells)


@eqx.filter_jit
def _by_credit(
    weights: Array, counts: Array, cells: Array, targets: Array, order: Int[Array, " steps"], rule: tuple
) -> tuple[Array, Array]:
    def one(tables: tuple[Array, Array], k: Array) -> tuple[tuple[Array, Array], None]:
        return credited(*tables, cells[k], targets[k], *rule), None

    return jax.lax.scan(one, (weights, counts), order)[0]


def train_by_least_squares(
    network: CMAC,
    inputs: Float[np.ndarray, "N d"],
    targets: Float[np.ndarray, "N m"],
    ridge: float = 1.0,
    forgetting: float = 1.0,
    *,
    least_visits: int = 20,
) -> tuple[CMAC, TrainingReport]:
    """The weights that fit all examples at once: the network is linear in them.

    ```
    min_W sum_k forgetting^(N - k) |t_k - sum_l W[a_l(u_k)]|^2 + ridge |W - W_0|^2
    ```

    Args:
        network: where to start; `W_0` are its weights.
        inputs: one row per example, in the order they came.
        targets: likewise.
        ridge: weight of the squared change of the weights.
        forgetting: weight of an example against the one after it.
        least_visits: as in `CMACTraining`.

    Raises:
        DataError: too few examples, with the number needed.
    """
    inputs, targets = checked_examples(inputs, targets)
    cells = _cells(network, inputs)
    _check_visits(network, cells, least_visits)
    flat = np.asarray(cells)
    used, place = np.unique(flat, return_inverse=True)
    rows = np.repeat(np.arange(len(flat)), flat.shape[1])
    # Entries at one place add up: a cell hit twice is read twice.
    table = scipy.sparse.coo_array((np.ones(flat.size), (rows, place.ravel())), (len(flat), len(used))).tocsr()
    weight = forgetting ** np.arange(len(flat) - 1, -1, -1.0)
    weighted = table.multiply(weight[:, None]).tocsr()
    left = (table.T @ weighted + ridge * scipy.sparse.eye_array(len(used))).tocsc()
    start = np.asarray(network.weights)[used]
    change = scipy.sparse.linalg.splu(left).solve(weighted.T @ (targets - table @ start))
    visited = np.bincount(table.indices, minlength=len(used))
    trained = eqx.tree_at(
        lambda each: (each.weights, each.counts),
        network,
        (network.weights.at[used].add(change), network.counts.at[used].add(visited)),
    )
    return trained, _report(trained, inputs, targets, cells)


def _cells(network: CMAC, inputs: np.ndarray) -> Int[Array, "N active"]:
    return _addresses(network.tilings, jnp.asarray(inputs))


@eqx.filter_jit
def _addresses(tilings: tuple[Tiling, ...], inputs: Array) -> Int[Array, "N active"]:
    return jax.vmap(lambda u: cells_of(tilings, u))(inputs)


def _check_visits(network: CMAC, cells: Int[Array, "N active"], least: int) -> None:
    """Refuse examples most of which are in cells that hardly any other is in."""
    visits = np.bincount(np.asarray(cells).ravel(), minlength=len(network.counts))[np.asarray(cells)].min(axis=1)
    typical = float(np.median(visits))
    if typical < least:
        needed = int(np.ceil(len(cells) * least / typical))
        raise DataError(
            f"training: most of the {len(cells)} examples are in cells visited less than {least} times; expected about "
            f"{needed} examples, or a coarser table"
        )


def _report(network: CMAC, inputs: np.ndarray, targets: np.ndarray, cells: Array) -> TrainingReport:
    left = targets - np.asarray(jnp.sum(network.weights[cells], axis=1))
    looked = tuple(sorted({column for tiling in network.tilings for column in tiling.columns}))
    rank, warnings = input_warnings(inputs, looked)
    return TrainingReport(
        samples=len(inputs),
        before=np.mean(targets**2, axis=0),
        after=np.mean(left**2, axis=0),
        dropped=tuple(k for k in range(inputs.shape[1]) if k not in varying(inputs)),
        rank=rank,
        cells=(len(np.unique(np.asarray(cells))), len(network.counts)),
        warnings=warnings,
    )
