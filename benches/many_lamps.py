#!/usr/bin/env python3
"""Measures noise and time of plains with 10 to 100,000 lamps: a table for docs/benchmarks.md.

usage: benches/many_lamps.py PROGRAM... [--cycles PYTHON], in an environment with numpy and OpenEXR

Lamps of 0.4 × 0.4 units hang over a plane, 10 units apart and 4 units high, with boxes between them.
The camera always looks at the middle of the plain from the same place. So the lamps that are added
change the picture little. Noise is the variance of a pixel in the unit of relMSE, as in
benches/peers/compare.py. The time is the processor time of the samples: that of a render with 16
samples per pixel minus that of a render with 1 sample, times 16/15. With --cycles, Cycles renders the
same scenes. PYTHON is an interpreter with the package bpy.
"""

import argparse
import json
import math
import random
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR

LAMPS = [10, 100, 1000, 10_000, 100_000]
SAMPLES = 16
WIDTH, HEIGHT = 240, 160
CAMERA = {"origin": [1, 12, 30], "target": [0, 1, 0], "up": [0, 1, 0], "fov_y": 50}
COLOURS = [(1, 0.8, 0.5), (1, 0.7, 0.4), (0.8, 0.9, 1), (1, 1, 0.8), (1, 0.6, 0.3)]
CYCLES = Path(__file__).parent / "peers" / "render_cycles.py"


def write_scene(folder, lamps):
    """Writes a plain with `lamps` lamps: scene.obj, scene.mtl, scene.toml, and scene.json for Cycles."""
    numbers = random.Random(1)
    lines, vertices = ["mtllib scene.mtl"], 0

    def quad(corners, material):
        nonlocal vertices
        lines.extend("v %g %g %g" % corner for corner in corners)
        lines.extend([f"usemtl {material}", "f " + " ".join(str(vertices + i) for i in (1, 2, 3, 4))])
        vertices += 4

    def box(x, z, half, height):
        low = [(x - half, 0, z - half), (x + half, 0, z - half), (x + half, 0, z + half), (x - half, 0, z + half)]
        high = [(x, height, z) for x, _, z in low]
        for i in range(4):
            j = (i + 1) % 4
            quad([low[j], low[i], high[i], high[j]], "wall")
        quad(high[::-1], "wall")

    side = math.isqrt(lamps - 1) + 1
    edge = 5 * side + 20
    quad([(-edge, 0, edge), (edge, 0, edge), (edge, 0, -edge), (-edge, 0, -edge)], "ground")
    places = [((i - side / 2 + 0.5) * 10, (j - side / 2 + 0.5) * 10) for i in range(side) for j in range(side)]
    for x, z in places:
        if numbers.random() < 0.5:
            box(x + 5, z + 5, 2.5, numbers.uniform(2, 8))
    for n, (x, z) in enumerate(places[:lamps]):
        corners = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]
        quad([(x + dx, 4, z + dz) for dx, dz in corners], f"lamp{n % len(COLOURS)}")
    (folder / "scene.obj").write_text("\n".join(lines) + "\n")
    materials = ["newmtl ground\nKd 0.5 0.5 0.5", "newmtl wall\nKd 0.6 0.55 0.5"]
    for n, colour in enumerate(COLOURS):
        materials.append(f"newmtl lamp{n}\nKd 0 0 0\nKe " + " ".join(f"{60 * c:g}" for c in colour))
    (folder / "scene.mtl").write_text("\n".join(materials) + "\n")
    (folder / "scene.toml").write_text(
        f"version = 1\n[camera]\nposition = {CAMERA['origin']}\nlook_at = {CAMERA['target']}\n"
        f"vertical_fov = {CAMERA['fov_y']}\n[image]\nwidth = {WIDTH}\nheight = {HEIGHT}\n"
        '[[object]]\nobj = "scene.obj"\n'
    )
    description = {"obj": "scene.obj", "width": WIDTH, "height": HEIGHT, "camera": CAMERA}
    (folder / "scene.json").write_text(json.dumps(description))


def processor_seconds(command):
    start = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr}")
    return end.ru_utime - start.ru_utime


def render(renderer, folder, samples, seed):
    """Renders the scene in `folder`. Returns the picture and the processor time."""
    if renderer[0] == "cycles":
        out = folder / "x.npy"
        words = [renderer[1], CYCLES, folder / "scene.json", samples, "TABULATED_SOBOL", seed, out]
        seconds = processor_seconds(words)
        return np.load(out).astype(np.float64), seconds
    out = folder / "x.exr"
    words = [renderer[1], "render", folder / "scene.toml", "--spp", samples, "--seed", seed, "--denoise=off", "-q"]
    seconds = processor_seconds([*words, "-o", out])
    channels = OpenEXR.File(str(out)).channels()
    return channels["RGB"].pixels[..., :3].astype(np.float64), seconds


def variance(a, b):
    mean = (a + b) / 2
    errors = np.sort(((a - b) ** 2 / 2 / (mean * mean + 0.01)).mean(-1).ravel())
    return errors[: int(len(errors) * 0.999)].mean()


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("programs", nargs="+", type=Path)
    arguments.add_argument("--cycles", type=Path)
    arguments.add_argument("--lamps", nargs="+", type=int, default=LAMPS)
    chosen = arguments.parse_args()
    renderers = [("embrasure", program.resolve()) for program in chosen.programs]
    if chosen.cycles:
        renderers.append(("cycles", chosen.cycles.absolute()))
    print("| lamps | renderer | noise | seconds | noise × seconds | mean |\n|---|---|---|---|---|---|")
    for lamps in chosen.lamps:
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            write_scene(folder, lamps)
            for renderer in renderers:
                (a, first), (b, second) = (render(renderer, folder, SAMPLES, seed) for seed in (1, 2))
                _, once = render(renderer, folder, 1, 1)
                seconds = ((first + second) / 2 - once) * SAMPLES / (SAMPLES - 1)
                noise = variance(a, b)
                name = renderer[1].name if renderer[0] != "cycles" else "Cycles"
                print(
                    f"| {lamps} | {name} | {noise:.5f} | {seconds:.2f} | {noise * seconds:.5f} | {(a + b).mean() / 2:.5f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
