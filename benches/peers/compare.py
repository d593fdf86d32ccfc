"""Renders the suites with every renderer, and compares noise over time. `make bench-peers` runs it.

Noise is the variance of a pixel in the unit of relMSE, from two renders a and b that differ only in
their seeds. It is the mean over pixels and channels of (a − b)² / 2 / (m² + 0.01), without the worst
0.1 % of the pixels, and m is the mean of a and b. It needs no reference, whose own error would
matter at large numbers of samples. Block variance is the same of the means of 16 × 16 pixels: a
denoiser cannot remove it.

The denoised error is the relMSE of the denoised picture against a reference. All pictures are
denoised by `embrasure develop --denoise=oidn`, with the same albedo and normals, which this program
renders from other seeds. The reference is the suite's, or a picture with many samples of the same
renderer. The time does not include the denoiser, except in the setting of Cycles with its own.

Each render is a separate process. Its time is the time of the whole process, and the shortest run
counts. The renderers alternate at every setting, so that a slow minute of the machine affects all
of them. A matte picture whose mean differs from the reference has no figures; for our picture that
is an error. Materials of the other suites differ by up to a per cent, so there the mean is a column.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from datetime import date
from importlib.metadata import distributions, version
from pathlib import Path

import matplotlib
import numpy as np
import OpenEXR

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.ticker import LogLocator, NullFormatter  # noqa: E402

HERE = Path(__file__).parent
US = "Embrasure"
PACKAGES = {"Mitsuba": "mitsuba", "Cycles": "bpy", "LuxCore": "pyluxcore"}
PROGRAMS = {"Mitsuba": "render_mitsuba.py", "Cycles": "render_cycles.py", "LuxCore": "render_luxcore.py"}
# Tolerance of each channel's mean against the reference: wide enough for the noise of 16 samples, and
# far below any mistake.
MEANS_AGREE = 0.01
# Maximum samples per pixel of all settings except the best.
FEW = 64
MANY = 1 << 20
# Edge of a block in pixels.
BLOCK = 16
# Seed of guides and references. No measured render has this seed.
OTHER_SEED = 1_000_003
# Suffix of settings that are denoised by the renderer.
OWN_DENOISER = ", own denoiser"


@dataclass
class Suite:
    """A suite: for each scene its name, our scene file, and the JSON file for the other renderers.

    Settings of renderers have their maximum samples per pixel.
    """

    scenes: dict[str, tuple[str, str]]
    settings: dict[tuple[str, str], int]


def gloss(name: str) -> tuple[str, str]:
    return f"gloss/{name}.toml", f"gloss/{name}.json"


def room(name: str) -> tuple[str, str]:
    return f"rooms/{name}.toml", f"rooms/{name}.json"


OURS = {(US, "defaults"): MANY, (US, "--reuse none"): FEW}
SUITES = {
    "matte": Suite(
        {name: (f"{name}/{name}.toml", f"{name}/scene.json") for name in ("cornell", "hall", "sponza")},
        OURS
        | {
            ("Mitsuba", "independent"): FEW,
            ("Mitsuba", "multijitter"): MANY,
            ("Mitsuba", "orthogonal"): FEW,
            ("Cycles", "TABULATED_SOBOL"): FEW,
            ("Cycles", "TABULATED_SOBOL" + OWN_DENOISER): FEW,
            ("LuxCore", "SOBOL"): FEW,
        },
    ),
    "gloss": Suite(
        {name: gloss(name) for name in ("cornell-gloss", "hall-gloss", "sponza-gloss")},
        OURS
        | {
            ("Mitsuba", "independent"): FEW,
            ("Mitsuba", "multijitter"): MANY,
            ("Cycles", "TABULATED_SOBOL"): FEW,
            ("Cycles", "TABULATED_SOBOL" + OWN_DENOISER): FEW,
        },
    ),
    "rooms": Suite(
        {name: room(name) for name in ("kitchen", "living-room", "staircase")},
        OURS | {("Cycles", "TABULATED_SOBOL"): MANY, ("Cycles", "TABULATED_SOBOL" + OWN_DENOISER): FEW},
    ),
}


@dataclass
class Render:
    image: np.ndarray
    # Figures of the whole process: seconds, processor seconds, and peak memory in MB.
    seconds: float
    processor: float
    megabytes: float


def read_exr(path: Path) -> np.ndarray:
    channels = OpenEXR.File(str(path)).channels()
    if "RGB" in channels:
        return channels["RGB"].pixels[..., :3].astype(np.float64)
    return np.stack([channels[c].pixels for c in "RGB"], -1).astype(np.float64)


def mean_without_worst(errors: np.ndarray) -> float:
    """Mean over pixels and channels, without the worst 0.1 % of the pixels."""
    errors = np.sort(errors.mean(-1), axis=None)
    return float(errors[: int(np.ceil(len(errors) * 0.999))].mean())


def variance(a: np.ndarray, b: np.ndarray) -> float:
    """Variance of one of two pictures that differ in their seeds, in the unit of relMSE."""
    mean = (a + b) / 2
    return mean_without_worst((a - b) ** 2 / 2 / (mean**2 + 0.01))


def relative_error(image: np.ndarray, reference: np.ndarray) -> float:
    return mean_without_worst((image - reference) ** 2 / (reference**2 + 0.01))


def block_means(image: np.ndarray) -> np.ndarray:
    """Means of square blocks. Blocks at the right and lower borders are smaller."""
    starts = [np.arange(0, size, BLOCK) for size in image.shape[:2]]
    sums = np.add.reduceat(np.add.reduceat(image, starts[0], 0), starts[1], 1)
    edges = [np.diff([*start, size]) for start, size in zip(starts, image.shape)]
    return sums / np.multiply.outer(*edges)[..., None]


def timed(command: list) -> tuple[float, float, float]:
    """Runs a command. Returns seconds and processor seconds of the process, and peak memory in MB."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        words = [sys.executable, "-S", "-E", HERE / "timed.py", log, *command]
        told = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=True).stdout
        status, seconds, processor, kilobytes = (float(word) for word in told.split())
        if status != 0:
            raise SystemExit(f"{' '.join(str(word) for word in command)} failed:\n{log.read_text(errors='replace')}")
    return seconds, processor, kilobytes / 1024


@dataclass
class Scene:
    """A scene of a suite: our scene file, and the JSON file for the other renderers."""

    toml: Path
    description: Path
    embrasure: Path
    # Samples per pixel of references that a renderer makes itself.
    reference_spp: int

    @property
    def reference(self) -> np.ndarray | None:
        """Reference of the suite, if it has one."""
        path = self.toml.parent / "reference.exr"
        return read_exr(path) if path.exists() else None

    def render(self, setting: tuple[str, str], spp: int, seed: int) -> Render:
        renderer, name = setting
        with tempfile.TemporaryDirectory() as folder:
            if renderer == US:
                output = Path(folder) / "x.exr"
                flags = [] if name == "defaults" else name.split()
                command = [self.embrasure, "render", "-q", "--spp", spp, "--seed", seed, "-o", output, self.toml, *flags]
            else:
                output = Path(folder) / "x.npy"
                command = [sys.executable, HERE / PROGRAMS[renderer], self.description, spp, name, seed, output]
            took = timed(command)
            image = read_exr(output) if renderer == US else np.load(output).astype(np.float64)
        return Render(image, *took)

    def guides(self, spp: int) -> dict[str, np.ndarray]:
        """Channels that guide the denoiser: albedo, normals, and light of visible lamps."""
        with tempfile.TemporaryDirectory() as folder:
            output = Path(folder) / "x.exr"
            timed([self.embrasure, "render", "-q", "--spp", spp, "--seed", OTHER_SEED, "-o", output, self.toml])
            channels = OpenEXR.File(str(output)).channels()
            return {name: channels[name].pixels for name in ("albedo", "emitted", "N.X", "N.Y", "N.Z")}

    def denoise(self, image: np.ndarray, guides: dict[str, np.ndarray]) -> np.ndarray:
        with tempfile.TemporaryDirectory() as folder:
            raw, output = Path(folder) / "raw.exr", Path(folder) / "denoised.exr"
            header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
            OpenEXR.File(header, {"RGB": image.astype(np.float32), **guides}).write(str(raw))
            timed([self.embrasure, "develop", "-q", raw, "--denoise=oidn", "-o", output])
            return read_exr(output)


def measure(arguments: argparse.Namespace) -> list[dict]:
    rows = []
    for name in arguments.suites:
        suite = SUITES[name]
        settings = suite.settings | {(US, flags): MANY for flags in arguments.flags}
        settings = {setting: most for setting, most in settings.items() if not arguments.renderers or setting[0] in arguments.renderers}
        for title in [title for title in suite.scenes if not arguments.scenes or title in arguments.scenes]:
            paths = (arguments.suite / path for path in suite.scenes[title])
            scene = Scene(*paths, arguments.embrasure.resolve(), arguments.reference_spp)
            references = {}
            for spp in arguments.spp:
                runs = defaultdict(list)
                for repeat in range(arguments.repeat):
                    for seed in (2 * repeat, 2 * repeat + 1):
                        for setting, most in settings.items():
                            if spp <= most:
                                runs[setting].append(scene.render(setting, spp, seed))
                guides = scene.guides(spp) if spp <= FEW else None
                for setting, results in runs.items():
                    row = figures(name, title, setting, spp, results, scene.reference)
                    if guides is not None and agrees(row):
                        reference = reference_of(setting[0], scene, settings, references)
                        row["denoised"] = denoised_error(scene, setting, results, guides, reference)
                    rows.append(row)
                    print(row, flush=True)
    return rows


def reference_of(renderer: str, scene: Scene, settings: dict, references: dict[str, np.ndarray]) -> np.ndarray:
    """The suite's reference. Else a picture of the renderer by its setting for most samples, which is
    kept in `references`, since materials differ a little between renderers."""
    if scene.reference is not None:
        return scene.reference
    if renderer not in references:
        setting = max((s for s in settings if s[0] == renderer), key=lambda s: settings[s])
        references[renderer] = scene.render(setting, scene.reference_spp, OTHER_SEED).image
    return references[renderer]


def denoised_error(scene: Scene, setting: tuple[str, str], runs: list[Render], guides: dict, reference: np.ndarray) -> float:
    is_denoised = setting[1].endswith(OWN_DENOISER)
    images = [run.image if is_denoised else scene.denoise(run.image, guides) for run in runs]
    return float(np.mean([relative_error(image, reference) for image in images]))


def figures(suite: str, scene: str, setting: tuple[str, str], spp: int, runs: list[Render], reference: np.ndarray | None) -> dict:
    mean = np.mean([run.image.mean((0, 1)) for run in runs], 0)
    disagreement = None if reference is None else float(abs(mean / reference.mean((0, 1)) - 1).max())
    if setting[0] == US and disagreement is not None and disagreement > MEANS_AGREE:
        raise SystemExit(f"our picture of {scene} at {spp} spp has a mean that is off by {100 * disagreement:.1f} %")
    pairs = [(a.image, b.image) for a, b in zip(runs[::2], runs[1::2])]
    return {
        "suite": suite,
        "scene": scene,
        "renderer": setting[0],
        "setting": setting[1],
        "spp": spp,
        "seconds": min(run.seconds for run in runs),
        "processor": min(run.processor for run in runs),
        "variance": float(np.mean([variance(a, b) for a, b in pairs])),
        "block_variance": float(np.mean([variance(block_means(a), block_means(b)) for a, b in pairs])),
        "denoised": None,
        "mean": float(mean.mean()),
        "disagreement": disagreement,
        "megabytes": max(run.megabytes for run in runs),
    }


def agrees(row: dict) -> bool:
    return row["disagreement"] is None or row["disagreement"] <= MEANS_AGREE


def table(rows: list[dict]) -> str:
    """Table with a row per renderer and setting. Efficiencies are relative to the best other renderer
    at the same number of samples, if there is one."""
    lines = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        lines += [
            f"**{scene}**",
            "",
            "| renderer | setting | spp | seconds | processor s | variance | ratio | block variance | ratio | denoised error | ratio | mean | MB |",
            "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
        ]
        for spp in dict.fromkeys(row["spp"] for row in rows if row["scene"] == scene):
            here = [row for row in rows if (row["scene"], row["spp"]) == (scene, spp)]
            peers = [row for row in here if row["renderer"] != US and agrees(row)]
            best = {measure: min((cost(row, measure) for row in peers), default=float("nan")) for measure in MEASURES}
            for r in here:
                start = f"| {r['renderer']} | {r['setting']} | {spp} |"
                if not agrees(r):
                    lines.append(f"{start} another picture: means off by up to {100 * r['disagreement']:.1f} % |" + " |" * 9)
                    continue
                cells = [f"{r['seconds']:.2f}", f"{r['processor']:.2f}"]
                for measure in MEASURES:
                    is_known = cost(r, measure) < float("inf")
                    cells += [f"{r[measure]:.3g}", f"{best[measure] / cost(r, measure):.2f}"] if is_known else ["", ""]
                cells += [f"{r['mean']:.4f}", f"{r['megabytes']:.0f}"]
                lines.append(f"{start} {' | '.join(cells)} |")
        lines.append("")
    return "\n".join(lines)


# Errors of a row, in the order of the table.
MEASURES = ["variance", "block_variance", "denoised"]


def cost(row: dict, measure: str) -> float:
    """Error times processor seconds. Infinite if the row has no such error. The variance of a picture
    that its renderer denoised tells nothing about its error."""
    is_unknown = row[measure] is None or (measure != "denoised" and row["setting"].endswith(OWN_DENOISER))
    return float("inf") if is_unknown else row[measure] * row["processor"]


def plot(rows: list[dict], path: Path) -> None:
    """Draws noise over seconds, with logarithmic axes, a panel per scene and a row per suite."""
    suites = {suite: list(dict.fromkeys(r["scene"] for r in rows if r["suite"] == suite)) for suite in dict.fromkeys(r["suite"] for r in rows)}
    columns = max(len(scenes) for scenes in suites.values())
    figure, axes = plt.subplots(
        len(suites), columns, figsize=(4.2 * columns, 3.4 * len(suites) + 0.6), squeeze=False, layout="constrained"
    )
    colors = {}
    for line, (suite, scenes) in zip(axes, suites.items()):
        for axis in line[len(scenes) :]:
            axis.set_axis_off()
        for axis, scene in zip(line, scenes):
            for renderer, setting in SUITES[suite].settings:
                points = [r for r in rows if (r["scene"], r["renderer"], r["setting"]) == (scene, renderer, setting) and agrees(r)]
                if setting.endswith(OWN_DENOISER) or not points:
                    continue
                color = colors.setdefault((renderer, setting), f"C{len(colors) - 1}")
                style = {"linewidth": 2.5, "color": "black"} if (renderer, setting) == (US, "defaults") else {"linewidth": 1, "color": color}
                x, y = [p["seconds"] for p in points], [p["variance"] for p in points]
                axis.loglog(x, y, marker="o", markersize=4, label=f"{renderer}, {setting}", **style)
            axis.set(title=scene, xlabel="seconds, whole process", ylabel="variance")
            for ticks in (axis.xaxis, axis.yaxis):
                ticks.set_major_locator(LogLocator(subs=(1, 2, 5)))
                ticks.set_major_formatter("{x:g}")
                ticks.set_minor_formatter(NullFormatter())
            axis.grid(True, alpha=0.2)
    labels = {label: handle for axis in axes.flat for handle, label in zip(*axis.get_legend_handles_labels())}
    figure.legend(labels.values(), labels.keys(), loc="outside lower center", ncols=4, fontsize=8)
    figure.savefig(path, dpi=100)


def head(embrasure: Path, packages: dict[str, str], runs: str) -> str:
    """Line above a table: date, machine and versions."""
    installed = {package.metadata["Name"] for package in distributions()}
    names = ", ".join(f"{name} {version(package)}" for name, package in packages.items() if package in installed)
    ours = subprocess.run([embrasure, "--version"], capture_output=True, text=True, check=True).stdout.split("\n")[0]
    return f"`make bench-peers`, {date.today()}, {os.cpu_count()} cores; {ours}; {names}; {runs}.\n\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--suite", type=Path, required=True, help="folder of the suites")
    parser.add_argument("--embrasure", type=Path, required=True, help="our program")
    parser.add_argument("--suites", nargs="+", choices=SUITES, default=list(SUITES))
    parser.add_argument("--scenes", nargs="+", help="only these scenes")
    parser.add_argument("--renderers", nargs="+", choices=[US, *PACKAGES], help="only these renderers")
    parser.add_argument("--spp", nargs="+", type=int, default=[16, 64, 256, 1024])
    parser.add_argument("--flags", nargs="+", default=[], help="also measure our program with these flags; each argument is a set of flags")
    parser.add_argument("--reference-spp", type=int, default=1024, help="samples of references that the suite does not have")
    parser.add_argument("--repeat", type=int, default=1, help="pairs of renders of each")
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--table", type=Path, required=True, help="write the table here")
    parser.add_argument("--plot", type=Path, required=True, help="write the plot here (PNG)")
    arguments = parser.parse_args()

    rows = measure(arguments)
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1))
    runs = f"renders of each: {2 * arguments.repeat}, the shortest counts"
    arguments.table.write_text(head(arguments.embrasure, PACKAGES, runs) + table(rows))
    plot(rows, arguments.plot)


if __name__ == "__main__":
    main()
