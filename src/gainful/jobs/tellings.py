"""What the identification of equations and of networks both leave behind."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd

from ..identification import Assessment, Recording
from ..version import __version__
from .provenance import made_with

FILES = ("report.html", "identification.json", "rows.parquet")
"""What an identification leaves in its folder."""

HOLDS, FAILS = 0.8, 0.5
"""Shares of variance told on rows kept back, from which and below which something is said to hold and not to hold."""


def percent(share: float) -> str:
    """A share in words."""
    return "no finite share" if not math.isfinite(share) else f"{100 * share:.1f} %"


def run_facts(
    path: Path, rows: int, recording: Recording, kept_back: Recording | None, own: list[tuple[str, str]]
) -> list[tuple[str, str]]:
    """What was run on what.

    Args:
        path: of the configuration.
        rows: how many were whole.
        recording: that something was found in.
        kept_back: rows that were not used, if any.
        own: what only one of both has to say.
    """
    return [
        ("Configuration", path.name),
        ("Rows", f"{rows:,} whole of {len(recording):,}, every {recording.dt:.4g} s"),
        ("Kept back", "none" if kept_back is None else f"{len(kept_back):,}"),
        *own,
        made_with(),
    ]


def where_judged(kept_back: Recording | None) -> str:
    """On what rows the numbers of a verdict are."""
    return "on the record itself" if kept_back is None else f"on {len(kept_back):,} rows kept back"


def told(check: Assessment) -> dict[str, Any]:
    """The numbers of an assessment."""
    return {
        "residual": check.residual,
        "explained_share": check.explained_share,
        "simulated": check.signal,
        "simulation_error": check.simulation_error,
        "simulated_share": check.simulated_share,
    }


def rows_table(own: Assessment, check: Assessment | None, title: str, method: str) -> pd.DataFrame:
    """What was measured and explained, in the recording and in the rows kept back.

    Args:
        own: on the recording.
        check: on the rows kept back, if any were.
        title: of the report.
        method: in words.
    """
    pieces = [(False, own)] if check is None else [(False, own), (True, check)]
    table = pd.concat(
        [
            pd.DataFrame(
                {
                    "t": each.t,
                    "kept_back": kept,
                    "measured": each.measured,
                    "explained": each.explained,
                    **({each.signal: each.observed, f"simulated_{each.signal}": each.simulated} if each.signal else {}),
                }
            )
            for kept, each in pieces
        ],
        ignore_index=True,
    )
    table.attrs = {"title": title, "method": method, "gainful_version": __version__}
    return table
