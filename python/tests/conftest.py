"""Fixtures: scenes, the program to compare the module with, and meshes."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import embrasure as em

ROOT = Path(__file__).resolve().parents[2]
SCENES = ROOT / "scenes"

# A command that a shell starts in the background ignores Ctrl-C. Tests of interrupts send Ctrl-C,
# so handle it in any case.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def box() -> Path:
    return SCENES / "cornell-box.toml"


@pytest.fixture(scope="session")
def command() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs the program of the same build: ``EMBRASURE_PROGRAM``."""
    program = os.environ["EMBRASURE_PROGRAM"]

    def run(*args: object) -> subprocess.CompletedProcess[str]:
        done = subprocess.run([program, *map(str, args)], capture_output=True, text=True, timeout=300)
        return done

    return run


def triangle_scene(vertices: Any, faces: Any) -> em.Scene:
    scene = em.Scene()
    scene.add_mesh(vertices, faces)
    return scene


def random_triangles(count: int, seed: int) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    random = np.random.default_rng(seed)
    centers = random.uniform(-1, 1, (count, 1, 3))
    vertices = (centers + random.uniform(-0.3, 0.3, (count, 3, 3))).astype(np.float32)
    return vertices.reshape(-1, 3), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)
