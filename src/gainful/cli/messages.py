"""Errors as a user of the terminal should see them."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import typer
from rich.console import Console
from rich.text import Text

from ..errors import ConfigError, GainfulError

error_console = Console(stderr=True)


@contextlib.contextmanager
def messages() -> Iterator[None]:
    """Errors as one line and an exit code: 2 for a wrong configuration, 1 for data and numbers."""
    try:
        yield
    except GainfulError as problem:
        # One line, never broken in the middle of a path, and brackets in it are no markup.
        error_console.print(Text("error:", "bold red") + Text(" " + " ".join(str(problem).split("\n"))), soft_wrap=True)
        raise typer.Exit(2 if isinstance(problem, ConfigError) else 1) from None
    except KeyboardInterrupt:
        error_console.print("stopped; nothing was written")
        raise typer.Exit(1) from None
