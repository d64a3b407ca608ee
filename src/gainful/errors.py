"""Everything gainful raises, and the status codes that travel inside compiled loops.

```
GainfulError
├── ConfigError       a configuration file or a part's argument is not valid         (also ValueError)
├── ModelError        a model's function has the wrong form or returns nonsense      (also ValueError)
├── ShapeError        an array does not have the size its space asks for             (also ValueError)
├── CovarianceError   a matrix that must be a covariance is not one                  (also ValueError)
├── DataError         a record cannot be used as it is                               (also ValueError)
│   └── UnitError     a declared unit does not exist or does not convert
├── NumericalError    a filter lost its numbers on the way                           (also ArithmeticError)
├── PrecisionError    the chosen floating-point precision cannot carry the problem   (also ArithmeticError)
└── MissingExtraError an optional package is needed for this                         (also ImportError)
```

Messages name the argument, what was expected and what came.
"""

from __future__ import annotations

import difflib
import enum
from collections.abc import Iterable


class GainfulError(Exception):
    """Base of every error raised on purpose."""


class ConfigError(GainfulError, ValueError):
    """A configuration file or a part's argument is not valid."""


class ModelError(GainfulError, ValueError):
    """A model's function has the wrong form or returns nonsense."""


class ShapeError(GainfulError, ValueError):
    """An array does not have the size its space asks for."""


class CovarianceError(GainfulError, ValueError):
    """A matrix that must be a covariance is not symmetric or not positive semi-definite."""


class DataError(GainfulError, ValueError):
    """A record cannot be used as it is: the message says which signal, row and time."""


class UnitError(DataError):
    """A declared unit does not exist or does not convert to the model's unit."""


class NumericalError(GainfulError, ArithmeticError):
    """A filter lost its numbers on the way: the message says where and the likely cause."""


class PrecisionError(GainfulError, ArithmeticError):
    """The chosen floating-point precision cannot carry the problem."""


class MissingExtraError(GainfulError, ImportError):
    """An optional package is needed; the message says which extra installs it."""


class Status(enum.IntEnum):
    """What became of one step; values from `not_positive` on are failures."""

    ok = 0
    missing = 1
    rejected = 2
    insufficient_data = 3
    ill_separated = 4
    nongeneric = 5
    not_positive = 6
    nonfinite = 7

    @property
    def failed(self) -> bool:
        """Whether the step could not be carried out."""
        return self >= Status.not_positive

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.ok: "the measurement was used",
    Status.missing: "no component was measured",
    Status.rejected: "every measured sensor was rejected by the update",
    Status.insufficient_data: "there are too few independent rows for an estimate yet",
    Status.ill_separated: "the data do not tell the parameters from the noise; the last estimate is kept",
    Status.nongeneric: "the parameters that fit best are infinite; the last estimate is kept",
    Status.not_positive: "the innovation covariance is not positive definite",
    Status.nonfinite: "the predicted or updated estimate is not finite",
}


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """The hint appended to an unknown name: the nearest known one, or all of them."""
    known = [str(name) for name in known]
    near = difflib.get_close_matches(given, known, n=1, cutoff=0.6)
    if near:
        return f"did you mean {near[0]!r}?"
    return f"known: {', '.join(sorted(known))}" if known else "none is known here"
