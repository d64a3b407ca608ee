"""By what a result was made."""

from __future__ import annotations

import sys

import jax

from ..version import __version__


def made_with() -> tuple[str, str]:
    """The versions that numbers depend on, as a fact of a report."""
    return "Made with", f"gainful {__version__}, JAX {jax.__version__}, Python {sys.version.split()[0]}"
