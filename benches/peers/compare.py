"""Renders the suite by every renderer, and compares error against time. `make bench-peers` runs it.

Each render is a process of its own, and its seconds are those of the whole process. A picture whose mean is not the reference's
has no figures; if it is ours, that is an error. The peers take turns with us at every setting, so that a slow minute of the machine is
everyone's.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from datetime import date
from importlib.metadata import version
from pathlib import Path

import matplotlib
import numpy as np
import OpenEXR

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.ticker import LogLocator, NullFormatter  # noqa: E402

HERE = Path(__file__).parent
SCENES = ("cornell", "hall", "sponza")
US = "Embrasure"
# Renderer and setting, the program that renders, and the most samples of a pixel it is asked for: some peers are slow, and large counts are
# for us and the best of them.
SETTINGS = {
    (US, "defaults"): (None, 1 << 20),
    (US, "--reuse none"): (None, 64),
    ("Mitsuba", "independent"): ("render_mitsuba.py", 64),
    ("Mitsuba", "multijitter"): ("render_mitsuba.py", 1 << 20),
    ("Mitsuba", "orthogonal"): ("render_mitsuba.py", 64),
    ("Cycles", "TABULATED_SOBOL"): ("render_cycles.py", 64),
    ("LuxCore", "SOBOL"): ("render_luxcore.py", 64),
}
PACKAGES = {"Mitsuba": "mitsuba", "Cycles": "bpy", "LuxCore": "pyluxcore"}
# Of each channel's mean against the reference's: wide enough for the noise of 16 samples, and far below any mistake.
MEANS_AGREE = 0.01


def read_exr(path: Path) -> np.ndarray:
    channels = OpenEXR.File(str(path)).channels()
    if "RGB" in channels:
        return channels["RGB"].pixels[..., :3].astype(np.float64)
    return np.stack([channels[c].pixels for c in "RGB"], -1).astype(np.float64)


def rel_mse(image: np.ndarray, reference: np.ndarray) -> float:
    """The suite's measure: mean over pixels and channels, the worst 0.1 % of the pixels left out."""
    errors = np.sort(((image - reference) ** 2 / (reference**2 + 0.01)).mean(-1), axis=None)
    return float(errors[: int(np.ceil(len(errors) * 0.999))].mean())


def timed(command: list) -> tuple[float, float]:
    """Runs a command; the seconds of the whole process, and its peak memory in MB."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        words = [sys.executable, "-S", "-E", HERE / "timed.py", log, *command]
        told = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=True).stdout
        status, seconds, kilobytes = (float(word) for word in told.split())
        if status != 0:
            raise SystemExit(f"{' '.join(str(word) for word in command)} failed:\n{log.read_text(errors='replace')}")
    return seconds, kilobytes / 1024


def render(setting: tuple[str, str], suite: Path, scene: str, spp: int, embrasure: Path) -> tuple[np.ndarray, float, float]:
    """The picture, the seconds of the whole process, and its peak memory in MB."""
    program, _ = SETTINGS[setting]
    with tempfile.TemporaryDirectory() as folder:
        if program is None:
            output = Path(folder) / "x.exr"
            flags = [] if setting[1] == "defaults" else setting[1].split()
            toml = suite / scene / f"{scene}.toml"
            command = [embrasure.resolve(), "render", "-q", "--spp", str(spp), "-o", output, toml, *flags]
        else:
            output = Path(folder) / "x.npy"
            command = [sys.executable, HERE / program, suite / scene, str(spp), setting[1], output]
        seconds, megabytes = timed(command)
        image = read_exr(output) if program is None else np.load(output).astype(np.float64)
    return image, seconds, megabytes


def measure(arguments: argparse.Namespace) -> list[dict]:
    rows = []
    for scene in arguments.scenes:
        reference = read_exr(arguments.suite / scene / "reference.exr")
        for spp in arguments.spp:
            runs = defaultdict(list)
            for _ in range(arguments.repeat):
                for setting, (_, most) in SETTINGS.items():
                    if spp <= most:
                        runs[setting].append(render(setting, arguments.suite, scene, spp, arguments.embrasure))
            for setting, results in runs.items():
                image = results[0][0]
                ratio = image.mean((0, 1)) / reference.mean((0, 1))
                disagreement = float(abs(ratio - 1).max())
                error, seconds = rel_mse(image, reference), float(np.median([s for _, s, _ in results]))
                row = {
                    "scene": scene,
                    "renderer": setting[0],
                    "setting": setting[1],
                    "spp": spp,
                    "seconds": seconds,
                    "rel_mse": error,
                    "disagreement": disagreement,
                    "megabytes": max(m for _, _, m in results),
                }
                if setting[0] == US and disagreement > MEANS_AGREE:
                    raise SystemExit(f"our picture of {scene} at {spp} spp has means that are {ratio} of the reference's")
                rows.append(row)
                print(row, flush=True)
    return rows


def agrees(row: dict) -> bool:
    return row["disagreement"] <= MEANS_AGREE


def table(rows: list[dict]) -> str:
    """A row for each renderer and setting; efficiency as a multiple of the best peer's at the same count."""
    lines = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        lines += [
            f"**{scene}**",
            "",
            "| renderer | setting | spp | seconds | relMSE | relMSE × s | best peer's / this | MB |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for spp in dict.fromkeys(row["spp"] for row in rows):
            here = [row for row in rows if (row["scene"], row["spp"]) == (scene, spp)]
            cost = {(r["renderer"], r["setting"]): r["rel_mse"] * r["seconds"] for r in here if agrees(r)}
            best = min(c for (renderer, _), c in cost.items() if renderer != US)
            for r in here:
                if not agrees(r):
                    off = f"another picture: means off by up to {100 * r['disagreement']:.1f} %"
                    lines.append(f"| {r['renderer']} | {r['setting']} | {spp} | {off} | | | | |")
                    continue
                c = cost[r["renderer"], r["setting"]]
                lines.append(
                    f"| {r['renderer']} | {r['setting']} | {spp} | {r['seconds']:.2f} | {r['rel_mse']:.5f} | {c:.4f} "
                    f"| {best / c:.2f} | {r['megabytes']:.0f} |"
                )
        lines.append("")
    return "\n".join(lines)


def plot(rows: list[dict], path: Path) -> None:
    """Error against seconds, both logarithmic, one panel for each scene."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure, axes = plt.subplots(1, len(scenes), figsize=(4.2 * len(scenes), 4), squeeze=False, layout="constrained")
    for axis, scene in zip(axes[0], scenes):
        for (renderer, setting), _ in SETTINGS.items():
            points = [r for r in rows if (r["scene"], r["renderer"], r["setting"]) == (scene, renderer, setting) and agrees(r)]
            style = {"linewidth": 2.5, "color": "black"} if (renderer, setting) == (US, "defaults") else {"linewidth": 1}
            x, y = [p["seconds"] for p in points], [p["rel_mse"] for p in points]
            axis.loglog(x, y, marker="o", markersize=4, label=f"{renderer}, {setting}", **style)
        axis.set(title=scene, xlabel="seconds, whole process", ylabel="relMSE")
        for ticks in (axis.xaxis, axis.yaxis):
            ticks.set_major_locator(LogLocator(subs=(1, 2, 5)))
            ticks.set_major_formatter("{x:g}")
            ticks.set_minor_formatter(NullFormatter())
        axis.grid(True, alpha=0.2)
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    figure.savefig(path, dpi=100)


def head(embrasure: Path, packages: dict[str, str], repeat: int) -> str:
    """The line over a table: when, where, and by which versions."""
    names = ", ".join(f"{name} {version(package)}" for name, package in packages.items())
    ours = subprocess.run([embrasure, "--version"], capture_output=True, text=True, check=True).stdout.split("\n")[0]
    return f"`make bench-peers`, {date.today()}, {os.cpu_count()} cores; {ours}; {names}; renders of each: {repeat}.\n\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--suite", type=Path, required=True, help="folder of the suite")
    parser.add_argument("--embrasure", type=Path, required=True, help="our program")
    parser.add_argument("--scenes", nargs="+", default=SCENES)
    parser.add_argument("--spp", nargs="+", type=int, default=[16, 64, 256, 1024])
    parser.add_argument("--repeat", type=int, default=1, help="renders of each; medians are taken")
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--table", type=Path, required=True, help="write the table here")
    parser.add_argument("--plot", type=Path, required=True, help="write the plot here (PNG)")
    arguments = parser.parse_args()

    rows = measure(arguments)
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1))
    arguments.table.write_text(head(arguments.embrasure, PACKAGES, arguments.repeat) + table(rows))
    plot(rows, arguments.plot)


if __name__ == "__main__":
    main()
