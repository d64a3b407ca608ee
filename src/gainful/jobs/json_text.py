"""Results as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..studies import Measured


def json_text(tree: Any) -> str:
    """A tree of results as text that every reader of JSON takes.

    Example:
        >>> print(json_text({"gap": math.inf, "bias": math.nan, "rows": 3}))
        {
         "gap": "infinity",
         "bias": null,
         "rows": 3
        }
        <BLANKLINE>
    """
    return json.dumps(_plain(tree), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(tree: Any) -> Any:
    """The same in what JSON has: NaN becomes null, infinities become words."""
    if isinstance(tree, Measured):
        interval = {"value": tree.value, "low": tree.low, "high": tree.high}
        return _plain(interval | {"unit": tree.unit, "runs": tree.runs} | ({"note": tree.note} if tree.note else {}))
    if isinstance(tree, np.ndarray):
        return _plain(tree.tolist())
    if isinstance(tree, Mapping):
        return {key: _plain(value) for key, value in tree.items()}
    if isinstance(tree, (list, tuple)):
        return [_plain(value) for value in tree]
    if tree is None or isinstance(tree, (str, bool, int)):
        return tree
    number = float(tree)
    if math.isnan(number):
        return None
    return number if math.isfinite(number) else "infinity" if number > 0 else "-infinity"
