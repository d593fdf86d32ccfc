#!/usr/bin/env python3
"""Measures error and time of the denoisers on the scenes of ../shared/suite: a table for docs/denoise.md, and its figure.

usage: benches/denoisers.py PROGRAM [FIGURE.png], in an environment with matplotlib (benches/peers/requirements.txt)

Each scene is rendered once with 4 and once with 16 samples per pixel. Each filter denoises the same
file (`develop --denoise`). The error is the relMSE of `compare` against the suite's reference. The
time is the processor time of `develop` with the filter minus the time without a filter, for
512 x 512 pixels. The light is the ratio of the mean luminances of the result and the raw picture.
"""

import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

SCENES = ["cornell", "hall", "sponza"]
SAMPLES = [4, 16]
FILTERS = [
    ("gaussian", []),
    ("gaussian", ["--denoise-radius", "2"]),
    ("atrous", []),
    ("oidn", []),
]
SUITE = Path(__file__).resolve().parents[1] / "../shared/suite"


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    # Exit code 1 of `compare` means that the images differ.
    if done.returncode not in (0, 1):
        sys.exit(f"{' '.join(map(str, words))}: {done.stderr}")
    return done.stdout


def seconds(*words):
    """Processor time of the program. It hardly depends on other load of the machine."""
    start = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    run(*words)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - start


def main():
    program = Path(sys.argv[1]).resolve()
    figure = sys.argv[2] if len(sys.argv) > 2 else None
    names = [" ".join([name] + radius).replace("--denoise-radius", "radius") for name, radius in FILTERS]
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for scene in SCENES:
            reference = SUITE / scene / "reference.exr"

            def compared(image):
                found = json.loads(run(program, "compare", reference, image, "--json"))
                r, g, b = found["mean"]
                return found["rel_mse"], 0.2126 * r + 0.7152 * g + 0.0722 * b

            for samples in SAMPLES:
                raw, out = folder / "raw.exr", folder / "out.exr"
                run(program, "render", SUITE / scene / f"{scene}.toml", "--spp", samples, "--denoise=off", "-q", "-o", raw)
                base = seconds(program, "develop", raw, "-q", "-o", out)
                error, light = compared(raw)
                results[scene, samples, "raw"] = (error, 0.0, 1.0)
                for name, (kind, radius) in zip(names, FILTERS):
                    words = [program, "develop", raw, "-q", f"--denoise={kind}", *radius, "-o", out]
                    took = seconds(*words) - base
                    after, left = compared(out)
                    results[scene, samples, name] = (after, max(took, 0.0), left / light)
    for samples in SAMPLES:
        print(f"\n{samples} samples per pixel: relMSE (light left)\n")
        print("| | " + " | ".join(SCENES) + " | processor seconds |")
        print("|---" * (len(SCENES) + 2) + "|")
        for name in ["raw"] + names:
            rows = [results[scene, samples, name] for scene in SCENES]
            cells = " | ".join(f"{error:.5f} ({100 * light:.1f} %)" for error, _, light in rows)
            took = max(row[1] for row in rows)
            print(f"| {name} | {cells} | {took:.2f} |")
    if figure:
        plot(results, names, figure)


def plot(results, names, figure):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    fig, axes = plt.subplots(1, len(SCENES), figsize=(12, 4), sharey=True)
    for axis, scene in zip(axes, SCENES):
        for samples, marker in zip(SAMPLES, "os"):
            raw = results[scene, samples, "raw"][0]
            axis.axhline(raw, color="0.6", linestyle="--", linewidth=1)
            axis.annotate(f"raw, {samples} spp", (0.005, raw), fontsize=7, va="bottom", color="0.4")
            for index, name in enumerate(names):
                error, took, _ = results[scene, samples, name]
                label = name if samples == SAMPLES[-1] else None
                axis.plot(max(took, 0.005), error, marker, color=f"C{index}", label=label)
        axis.set(xscale="log", yscale="log", title=scene, xlabel="processor seconds of the filter")
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("relMSE (circles: 4 spp, squares: 16 spp)")
    axes[-1].legend(fontsize=7)
    fig.tight_layout()
    fig.savefig(figure, dpi=110)


main()
