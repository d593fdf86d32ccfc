"""The package is typed, and the stubs match the extension module."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import embrasure

PACKAGE = Path(embrasure.__file__).parent


def mypy(*args: object) -> None:
    environment = {**os.environ, "MYPYPATH": str(PACKAGE.parent)}
    done = subprocess.run([sys.executable, "-m", *map(str, args)], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr


def test_mypy_strict_is_clean() -> None:
    # Types of numpy take most of the time; the cache stays with the environment.
    strict = ["mypy", "--strict", "--no-error-summary", "--cache-dir", Path(sys.prefix) / "mypy-cache"]
    mypy(*strict, "--python-version", "3.9", PACKAGE)
    # trimesh has no types.
    mypy(*strict, "--allow-untyped-calls", "--ignore-missing-imports", *sorted(Path(__file__).parent.glob("*.py")))


def test_stubs_match_the_module() -> None:
    mypy("mypy.stubtest", "--ignore-disjoint-bases", "embrasure._native")


def test_all_names_are_there() -> None:
    for name in embrasure.__all__:
        assert getattr(embrasure, name) is not None
        assert name == "__version__" or getattr(embrasure, name).__doc__, name
