"""Results on disk, whole or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..errors import DataError


@contextlib.contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """A scratch folder whose files move into `folder` together once the block ends well, and vanish if it does not.

    Raises:
        DataError: the folder cannot be written, or the disk is full.
    """
    folder = Path(folder)
    scratch: Path | None = None
    try:
        scratch = _scratch(folder)
        yield scratch
        folder.mkdir(parents=True, exist_ok=True)
        _move_all(scratch, folder)
    except OSError as problem:
        raise _unwritable(folder, problem) from problem
    finally:
        if scratch is not None:
            shutil.rmtree(scratch, ignore_errors=True)


def check_folder(folder: Path) -> None:
    """Raise now, rather than after a long job, if `whole_folder` could not write there."""
    try:
        _scratch(Path(folder)).rmdir()
    except OSError as problem:
        raise _unwritable(Path(folder), problem) from problem


def _scratch(folder: Path) -> Path:
    """A new folder in the output folder or, while there is none, in the nearest one above it."""
    nearest = next(p for p in (folder.absolute(), *folder.absolute().parents) if p.exists())
    if not nearest.is_dir():
        raise DataError(f"output folder {folder}: a file of that name is in the way ({nearest})")
    return Path(tempfile.mkdtemp(prefix=".gainful-", dir=nearest))


def _move_all(scratch: Path, folder: Path) -> None:
    """Put new files in the place of old ones; if one cannot be moved, put the old ones back."""
    old = Path(tempfile.mkdtemp(prefix="old-", dir=scratch))
    moved: list[tuple[Path, Path]] = []
    try:
        for path in sorted(p for p in scratch.iterdir() if p != old):
            target = folder / path.name
            if target.is_dir():
                raise DataError(f"output folder {folder}: a folder called {path.name!r} is in the way")
            if target.exists():
                moved.append((target, old / path.name))
                os.replace(target, old / path.name)
            moved.append((path, target))
            os.replace(path, target)
    except BaseException:
        for source, target in reversed(moved):
            if target.exists():
                os.replace(target, source)
        raise


def _unwritable(folder: Path, problem: OSError) -> DataError:
    reason = os.strerror(problem.errno) if problem.errno else str(problem)
    return DataError(f"output folder {folder}: cannot be written: {reason}; nothing was left half-written")
