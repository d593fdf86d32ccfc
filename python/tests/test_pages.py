"""Code of the guide's page and of the module's README runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from conftest import ROOT, SCENES


@pytest.mark.parametrize("page", ["docs/guide/how-to/python.md", "python/README.md"])
def test_pages_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)
    assert blocks
    (tmp_path / "scenes").symlink_to(SCENES)
    monkeypatch.chdir(tmp_path)
    # Later blocks use definitions of earlier blocks.
    names: dict[str, object] = {}
    for number, block in enumerate(blocks, 1):
        exec(compile(block, f"{page}, block {number}", "exec"), names)
