"""The notebooks run, from first cell to last."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from conftest import ROOT, SCENES

NOTEBOOKS = sorted((ROOT / "python" / "notebooks").glob("*.py"))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: str(path.stem))
def test_notebooks_run(notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scenes").symlink_to(SCENES)
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(notebook))


def test_there_are_three() -> None:
    assert len(NOTEBOOKS) == 3
