"""The report of an identification: parameters, methods side by side, residuals, and what was kept back."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..identification import Assessment, Identification
from ..studies import Band, Chart, Figure, Line, Measured, Panel
from .html import Judgement, Table
from .page import page_text, write_page
from .study_figures import study_sections

_WORDS: dict[Judgement, tuple[str, str]] = {
    "good": ("✓", "Holds"),
    "bad": ("✕", "Does not hold"),
    "unknown": ("?", "With reservations"),
}
_LAGS = 60
"""Rows up to which the residual is compared with itself."""
_FAR = 10.0
"""Sizes of a parameter beyond which a method's is not drawn."""


def write_identification_report(
    found: Identification,
    path: str | os.PathLike[str],
    *,
    title: str,
    facts: Sequence[tuple[str, str]],
    verdict: str,
    judgement: Judgement,
    cautions: Sequence[str],
    tables: Sequence[Table],
    checks: Mapping[str, Assessment],
) -> Path:
    """Write the report of an identification in one HTML file that works offline.

    Args:
        found: the parameters.
        path: of the file; an older one is replaced once the new one is complete.
        title: of the page.
        facts: what was run on what, as pairs of name and value.
        verdict: in one sentence.
        judgement: what it comes to.
        cautions: what a reader should know.
        tables: of parameters and methods.
        checks: the equation held against what was kept back, by method; that of the method chosen is drawn.

    Returns:
        The path written.

    Raises:
        OSError: the file could not be written; an older one is left as it was.
    """
    return write_judged_page(
        _figures(found, checks[found.method]),
        path,
        title=title,
        facts=facts,
        verdict=verdict,
        judgement=judgement,
        cautions=cautions,
        tables=[*tables, identifiability_table(found), _noise_table(found)],
        equation=_equation(found),
        assumptions=found.assumptions,
    )


def write_judged_page(
    figures: Sequence[Figure | Chart],
    path: str | os.PathLike[str],
    *,
    title: str,
    facts: Sequence[tuple[str, str]],
    verdict: str,
    judgement: Judgement,
    cautions: Sequence[str],
    tables: Sequence[Table],
    equation: str,
    assumptions: Sequence[str],
) -> Path:
    """Write what was identified, by whichever method, with what it comes to."""
    mark, word = _WORDS[judgement]
    text = page_text(
        "identification",
        study_sections(figures),
        title=title,
        facts=facts,
        verdict=verdict[:1].upper() + verdict[1:] + ".",
        judgement=judgement,
        mark=mark,
        word=word,
        warnings=cautions,
        tables=tables,
        equation=equation,
        assumptions=assumptions,
    )
    path = Path(path)
    write_page(path, text)
    return path


def _equation(found: Identification) -> str:
    equation = found.problem.equation
    terms = " + ".join(f"{name} · {term.text}" for name, term in equation.terms.items())
    condition = "" if equation.where is None else f"   where {equation.where.text} > 0"
    return f"{equation.regressand.text} = {terms}{condition}"


def identifiability_table(found: Identification) -> Table:
    """What the record can tell of the parameters."""
    told = found.identifiability
    rows = [
        ("rows that are whole", told.rows),
        ("condition of the regressors at equal size", told.condition),
    ]
    if len(told.columns) > 1:
        first, second, cosine = told.worst_pair
        rows.append((f"cosine of the two most alike, {first} and {second}", cosine))
    if not np.isnan(told.gap):
        rows += [
            ("eigenvalue gap of information against noise", told.gap),
            ("largest gap that noise alone would show", told.noise_gap),
            ("noisiest column's sigma over the quietest's", told.noise_ratio),
        ]
    return Table("What the record can tell", ("quantity", "value"), tuple(rows))


def _noise_table(found: Identification) -> Table:
    of = found.problem.recording
    noise = found.problem.noise
    rows = []
    for name, values in of.values.items():
        sensors = values.shape[1]
        source = "given" if name in of.std else "from the sensors' differences" if sensors > 1 else "not known"
        if source == "not known" and name in noise:
            source = "from what the sensors' residuals share"
        missing = 100.0 * float(np.isnan(values).mean())
        # Of one sensor; problem.noise is that of their mean.
        size = noise[name] * np.sqrt(sensors) if name in noise else None
        rows.append((name, sensors, None if size is None else float(size), source, f"{missing:.3g} %"))
    return Table("Signals", ("signal", "sensors", "noise sigma", "known how", "missing"), tuple(rows))


def _figures(found: Identification, check: Assessment) -> list[Figure | Chart]:
    figures = assessment_figures(found.assessment, check, found.problem.equation.regressand.text)
    return [*figures, *_track_figures(found), *_parameter_charts(found)]


def assessment_figures(own: Assessment, check: Assessment, regressand: str) -> list[Figure | Chart]:
    """What was measured and explained, the run by itself, and the residual.

    Args:
        own: on the rows that all was found in.
        check: on the rows that the verdict is about.
        regressand: what is explained, in words.
    """
    both = (Line("explained", check.t, check.explained), Line("measured", check.t, check.measured, True))
    caption = "What was measured and what is made of it, on the rows that the verdict is about."
    figures: list[Figure | Chart] = [Figure("Explained", caption, (Panel(regressand, both),))]
    if check.signal:
        finite = np.where(np.isfinite(check.simulated), check.simulated, np.nan)
        figures.append(
            Figure(
                "Run by itself",
                f"{check.signal} from the start of the same rows, given all other signals.",
                (
                    Panel(
                        check.signal,
                        (Line("simulated", check.t, finite), Line("measured", check.t, check.observed, True)),
                    ),
                ),
            )
        )
    residual = own.measured - own.explained
    lags, share, reach = _correlation(residual)
    figures += [
        Figure(
            "Residual",
            "What is left unexplained, on the rows that all was found in.",
            (Panel(f"residual of {regressand}", (Line("residual", own.t, residual),)),),
        ),
        Figure(
            "Residual",
            "How far the residual is like itself some rows later; within the band it may be white. Intervals take what is "
            "outside into account.",
            (
                Panel(
                    "autocorrelation",
                    (
                        Band("residual", lags, np.full(len(lags), -reach), np.full(len(lags), reach), "95 % if white"),
                        Line("residual", lags, share),
                    ),
                ),
            ),
            x_label="rows later",
        ),
    ]
    return figures


def _parameter_charts(found: Identification) -> list[Chart]:
    """Per parameter, what the methods make of it."""
    charts = []
    low, high = found.interval
    for j, name in enumerate(found.parameters):
        if not np.isfinite(found.theta[j]):
            continue
        bars = {f"{found.method} (chosen)": Measured(float(found.theta[j]), float(low[j]), float(high[j]), 1)}
        half = found.reach * found.std[j]
        limit, left_out = _FAR * max(abs(found.theta[j]), half), []
        for method, fit in found.rivals.items():
            value, reach = float(fit.theta[j]), found.reach * float(fit.std[j])
            if np.isfinite(value) and abs(value - found.theta[j]) < limit:
                bars[method] = Measured(value, value - reach, value + reach, 1)
            else:
                left_out.append(method)
        words = f" Too far off to be drawn: {', '.join(left_out)}." if left_out else ""
        charts.append(
            Chart(
                "Parameters",
                f"What each method makes of {name}, with its {100 * found.level:.4g} % interval.{words}",
                name,
                bars,
            )
        )
    return charts


def _track_figures(found: Identification) -> list[Figure]:
    """Parameters along the record, of a recursive method."""
    track = found.track
    if track is None:
        return []
    panels = []
    # The start is as wide as the prior: what is told is the scale of the rest.
    late = slice(len(track.t) // 4, None)
    for j, name in enumerate(found.parameters):
        theta, half = track.theta[late, j], found.reach * track.std[late, j]
        marks = (Band(name, track.t[late], theta - half, theta + half, "interval"), Line(name, track.t[late], theta))
        panels.append(Panel(name, marks))
    caption = "The estimates along the record, after its first quarter, with their intervals."
    return [Figure("Parameters over time", caption, tuple(panels))]


def _correlation(residual: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Lags, autocorrelation there, and what it stays within for a white one."""
    known = np.isfinite(residual)
    x = np.where(known, residual - residual[known].mean(), 0.0)
    most = min(_LAGS, len(x) - 2)
    lags = np.arange(1, most + 1)
    pairs = np.array([(known[k:] & known[:-k]).sum() for k in lags])
    shared = np.array([x[k:] @ x[:-k] for k in lags]) / np.maximum(pairs, 1)
    power = float(x @ x) / max(int(known.sum()), 1)
    return lags.astype(float), shared / (power or 1.0), 1.96 / float(np.sqrt(max(int(known.sum()), 1)))
