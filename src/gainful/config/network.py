"""The section of a configuration of `gainful identify` that asks for a network, and what it describes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any, ClassVar, Literal

from ..errors import ConfigError, did_you_mean
from ..identification import Lags, NetworkRecipe
from ..networks import AbstractTraining
from .parts import make_part


@dataclasses.dataclass(frozen=True)
class NetworkSection:
    """A network that predicts a signal from rows before.

    Attributes:
        of: the signal that is predicted.
        kind: "affine" or "bilinear" regression, "rbf" (radial basis functions) or "mlp" (multilayer perceptron).
        lags: rows of the signal itself before the one predicted.
        inputs: rows of each other signal, by name.
        delay: rows from the newest of these to the one predicted; 0 where an input acts at once.
        form: predict the "increment" of the signal or its "absolute" value.
        centres: of "rbf".
        kernel: of "rbf", "thin-plate" or "gaussian".
        width: of the Gaussian kernel, in units of a typical distance.
        placement: of the centres: "clusters" or "examples" of the rows, or "box", anywhere between their ends.
        products: whether "rbf" is told products of what it is told.
        gain: size of what the network is told at either end of its range.
        tail: what an "rbf" or "mlp" is added to: "none", an "affine" regression, or "lift", one on the products too.
        noise_variance: of the signal, in units of the variance of what is predicted.
        prior_variance: of every weight that is found by least squares.
        forgetting: how much a row counts one row later.
        random_walk: variance that every such weight gains per row.
        training: of "mlp": "decoupled_kalman", "kalman" or "perceptron", or a table with `kind` and options.
        seed: of the random numbers.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    of: str
    kind: Literal["affine", "bilinear", "rbf", "mlp"] = "rbf"
    lags: int = 2
    inputs: dict[str, int] = dataclasses.field(default_factory=dict)
    delay: int = 0
    form: Literal["increment", "absolute"] = "increment"
    centres: int = 50
    kernel: Literal["thin-plate", "gaussian"] = "thin-plate"
    width: float = 1.0
    placement: Literal["clusters", "examples", "box"] = "clusters"
    products: bool = False
    gain: float = 1.0
    tail: Literal["none", "affine", "lift"] = "affine"
    noise_variance: float = 1e-2
    prior_variance: float = 1e4
    forgetting: float = 1.0
    random_walk: float = 0.0
    training: str | dict[str, Any] | None = None
    seed: int = 0


def build_network(section: NetworkSection, signals: Iterable[str]) -> tuple[Lags, NetworkRecipe]:
    """Which rows the network is told, and how it is made.

    Args:
        section: of the configuration.
        signals: that are measured.

    Raises:
        ConfigError: a signal that is not measured, or an argument out of its range.
    """
    signals = tuple(signals)
    for role, name in (("of", section.of), *(("inputs", each) for each in section.inputs)):
        if name not in signals:
            raise ConfigError(f"network.{role}: {name!r} is not a signal; {did_you_mean(name, signals)}")
    shared = {field.name for field in dataclasses.fields(NetworkRecipe)} - {"training"}
    given = {name: getattr(section, name) for name in shared}
    if section.training is not None:
        given["training"] = make_part(AbstractTraining, section.training, "network.training")
        if section.kind != "mlp":
            raise ConfigError(f"network.training: expected none for {section.kind!r}, which is found by least squares")
    try:
        recipe = NetworkRecipe(**given)
        return Lags(section.of, section.lags, section.inputs, section.delay), recipe
    except ConfigError as problem:
        raise ConfigError(f"network.{problem}") from problem
