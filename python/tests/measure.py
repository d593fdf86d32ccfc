"""Measures the overhead of Python; this is not a test.

    python measure.py render PROGRAM SCENE [FLAG…]       pairs: processor seconds of em.render with its file, and of the program
    python measure.py intersect TRACE_RAYS SCENE COUNT   seconds of em.intersect, and of the same loop in Rust (python/examples/trace_rays.rs)
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Callable, Dict, List

import numpy as np

import embrasure as em

PAIRS = 9


def render(program: str, scene: str, spp: str = "64", size: str = "256x256") -> None:
    ratios: List[float] = []
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = (str(Path(folder, name)) for name in ("a.exr", "b.exr"))
        for _ in range(PAIRS):
            start = time.process_time()
            em.render(em.load(scene), spp=int(spp), size=size).save(ours)
            by_python = time.process_time() - start
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([program, "render", scene, "--spp", spp, "--size", size, "-q", "-o", theirs], check=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            by_program = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            ratios.append(by_python / by_program)
            print(f"python {by_python:.3f} s, program {by_program:.3f} s, ratio {ratios[-1]:.3f}")
    print(f"median ratio {median(ratios):.3f}")


def intersect(trace_rays: str, scene: str, count: str) -> None:
    lower, upper = (np.array(corner) for corner in em._rays._rays(scene, None, None).bounds)
    random = np.random.default_rng(1)
    origins = random.uniform(lower, upper, (int(count), 3)).astype(np.float32)
    directions = random.normal(size=(int(count), 3)).astype(np.float32)
    loaded = em.load(scene)
    em.intersect(loaded, origins[:1], directions[:1])

    def seconds() -> float:
        start = time.monotonic()
        hits = em.intersect(loaded, origins, directions)
        end = time.monotonic()
        # The arrays are freed after the measurement, as in the Rust loop
        del hits
        return end - start

    with tempfile.NamedTemporaryFile(suffix=".rays") as file:
        np.concatenate([origins, directions], axis=1).tofile(file.name)
        ours: List[float] = []
        theirs: List[float] = []
        for _ in range(3):
            ours += [seconds() for _ in range(3)]
            said = subprocess.run([trace_rays, scene, file.name], check=True, capture_output=True, text=True).stdout
            theirs += [float(line.split()[0]) for line in said.splitlines()]
        _, count_of_hits, sum_of_t = map(float, said.split()[-3:])
        hits = em.intersect(loaded, origins, directions)
        assert count_of_hits == hits.hit.sum()
        assert np.isclose(sum_of_t, hits.t[hits.hit].sum(dtype=np.float64), rtol=1e-6)
    print(f"python {median(ours):.3f} s ({min(ours):.3f}), rust {median(theirs):.3f} s ({min(theirs):.3f})")
    print(f"ratio of medians {median(ours) / median(theirs):.3f}, of minima {min(ours) / min(theirs):.3f}")


if __name__ == "__main__":
    commands: Dict[str, Callable[..., None]] = {"render": render, "intersect": intersect}
    commands[sys.argv[1]](*sys.argv[2:])
