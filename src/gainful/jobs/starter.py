"""A first configuration, model and record to start from."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from ..errors import DataError
from ..io import whole_folder

FILES = ("estimate.toml", "model.py", "log.csv")


def write_starter(folder: Path | str) -> list[Path]:
    """Write a commented configuration, a model and a small simulated record that run as they are.

    Args:
        folder: where to; made if missing.

    Raises:
        DataError: one of the files is there already, or the folder cannot be written.
    """
    folder = Path(folder)
    for name in FILES:
        if (folder / name).exists():
            raise DataError(f"{folder / name} is there already; choose another folder")
    here = resources.files(str(__package__)).joinpath("starter")
    with whole_folder(folder) as scratch:
        for name in FILES:
            (scratch / name).write_bytes(here.joinpath(name).read_bytes())
    return [folder / name for name in FILES]
