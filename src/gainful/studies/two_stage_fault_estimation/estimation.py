"""The paper's experiment: three faults, its filters and their rivals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..chapter import Chapter
from ..experiment import Experiment
from .claims import CLAIMS
from .contenders import TUNED, contenders
from .figures import figures, tables
from .measures import Measure, Traces, quantities
from .scenarios import SCENARIOS, Flight, Scenario, flight_of


def experiment(
    scenario: Scenario,
    contenders: Mapping[str, Any],
    *,
    name: str = "",
    title: str = "",
    simulate: Flight | None = None,
    **options: Any,
) -> Experiment:
    """Contenders on a scenario's flights, judged as all are: chapters that differ in numbers share programs.

    Args:
        scenario: of the fault.
        contenders: by name.
        name: of the experiment; the scenario's own by default.
        title: likewise.
        simulate: makes the flights; the scenario's own by default.
        options: of `Experiment`.
    """
    return Experiment(
        name or scenario.name,
        title or scenario.title,
        flight_of(scenario) if simulate is None else simulate,
        contenders,
        Measure(scenario.scale),
        quantities(scenario),
        Traces(scenario.scale),
        **options,
    )


def chapter() -> Chapter:
    """Errors and delays of all filters under the three faults."""
    return Chapter(
        tuple(experiment(each, contenders(each), baseline=TUNED) for each in SCENARIOS),
        CLAIMS,
        tables,
        figures,
        (
            "Tuned filters have the published walk of the fault multiplied by 40, 110 and 13000 in sigma.",
            "The adapted noise is added within the step; process noise of a wheel's fault reaches the innovation one step "
            "later, so that the published equation for its factor is a heuristic.",
        ),
    )
