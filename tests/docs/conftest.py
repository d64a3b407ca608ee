"""One folder, one session, so that pages share what they have run."""

from __future__ import annotations

from pathlib import Path

import pytest

from .pages import ROOT, Session


@pytest.fixture(scope="session")
def session() -> Session:
    return Session()


@pytest.fixture(scope="session")
def sandbox(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("checkout")
    (folder / "examples").symlink_to(ROOT / "examples")
    return folder


@pytest.fixture(autouse=True)
def in_sandbox(sandbox: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in a copy of the checkout in which the pages may write, with a terminal of known width."""
    monkeypatch.chdir(sandbox)
    monkeypatch.setenv("COLUMNS", "110")
    monkeypatch.syspath_prepend(str(sandbox))
