"""The command line: parse, call, print."""

import sys


def main() -> None:
    """Entry point of the `gainful` command."""
    try:
        from .app import app
    except ImportError as problem:
        missing = getattr(problem, "name", None) or str(problem)
        sys.stderr.write(f"gainful: the command line needs {missing}: pip install 'gainful[cli]'\n")
        raise SystemExit(1) from None
    app()
