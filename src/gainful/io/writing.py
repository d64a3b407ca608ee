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
        if folder.exists() and not folder.is_dir():
            raise DataError(f"output folder {folder}: a file of that name is in the way")
        parent = next(p for p in (folder, *folder.absolute().parents) if p.is_dir())
        scratch = Path(tempfile.mkdtemp(prefix=".gainful-", dir=parent))
        yield scratch
        folder.mkdir(parents=True, exist_ok=True)
        for path in sorted(scratch.iterdir()):
            os.replace(path, folder / path.name)
    except OSError as problem:
        reason = problem.strerror or str(problem)
        raise DataError(f"output folder {folder}: cannot be written: {reason}; nothing was left half-written") from problem
    finally:
        if scratch is not None:
            shutil.rmtree(scratch, ignore_errors=True)
