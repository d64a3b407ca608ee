"""Updates: how strongly a measurement counts."""

from .base import AbstractUpdate, Likelihood, Update
from .exact import Exact
from .gated import Gated
from .iterated import Iterated

__all__ = ["AbstractUpdate", "Exact", "Gated", "Iterated", "Likelihood", "Update"]
