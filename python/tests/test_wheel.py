"""The wheel: its module finds the libraries in the wheel."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import embrasure
from conftest import ROOT


@pytest.mark.skipif(shutil.which("readelf") is None, reason="readelf tells what a file needs")
def test_the_module_finds_the_libraries_of_the_wheel(tmp_path: Path) -> None:
    def run(*args: object) -> str:
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        done = subprocess.run([str(arg) for arg in args], capture_output=True, text=True, env=environment, cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    package = Path(embrasure.__file__).parent
    run(ROOT / "scripts" / "install", "--self-contained", os.environ["EMBRASURE_PROGRAM"], tmp_path / "prefix")
    run(ROOT / "scripts" / "wheel", tmp_path / "prefix", embrasure.__version__, package, tmp_path)
    [wheel] = tmp_path.glob("embrasure-*-cp39-abi3-manylinux_2_*.whl")
    # numpy comes from the environment of these tests.
    run(sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", tmp_path / "v")
    python = tmp_path / "v" / "bin" / "python"
    here = sys.executable
    run(here, "-m", "pip", "--python", python, "install", "--disable-pip-version-check", "--no-deps", "--no-index", wheel)
    site = next(Path(path) for path in sys.path if path.endswith("site-packages"))
    code = f"import sys; sys.path.append({str(site)!r}); import embrasure as em; print(em.__file__, em.version_text())"
    said = run(python, "-c", code)
    assert str(tmp_path / "v") in said.split()[0]
    libraries = [line.split()[-1] for line in said.splitlines() if line.startswith("library ")]
    assert libraries and all(path.startswith(str(tmp_path / "v" / "lib" / "embrasure" / "lib")) for path in libraries), said
    # The program is in the environment in which the wheel is installed.
    found = run(python, "-c", code.replace("em.__file__, em.version_text()", "em.program()"))
    assert found.strip() == str(tmp_path / "v" / "bin" / "embrasure")
    # Another environment that imports the package finds the same program.
    here_first = f"import sys; sys.path.insert(0, {str(next((tmp_path / 'v').glob('lib/python*/site-packages')))!r}); import embrasure as em; print(em.program())"
    assert run(here, "-c", here_first).strip() == found.strip()
    assert "embrasure" in run(tmp_path / "v" / "bin" / "embrasure", "--version")
