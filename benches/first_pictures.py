"""Renders OBJ files like a new user, with no flags except the output's name and a time limit.

For each picture the table has figures from the render's own channels: the fraction of the frame
covered by the subject (pixels with a depth), the fraction of its pixels that are white, and the
median of its display values. It also has the time from the start to the finished file, and the
guesses.
"""

import argparse
import re
import subprocess
import time
from pathlib import Path

import matplotlib.image
import numpy
import OpenEXR

# Depth of pixels that show no surface.
BACKGROUND = 1e10
# Minimum display value of a white pixel.
WHITE = 254.5 / 255
# Edge length and margin of a picture on the sheet in pixels, and pictures per row.
TILE, MARGIN, COLUMNS = 256, 8, 6
LIMITS = {"covered": (0.20, 0.85), "white": (0.0, 0.02), "median": (0.25, 0.70)}


def objs(folder):
    """OBJ files of the scenes, except files that are awkward or broken by design."""
    found = sorted(folder.rglob("*.obj"))
    return [path for path in found if not {"awkward-obj", "faults", "found", "found-light"} & set(path.parts)]


def luminance(rgb):
    return rgb @ numpy.array([0.2126, 0.7152, 0.0722])


def render(embrasure, scene, work):
    """Renders a scene. Returns its row of the table, and its picture."""
    image, floats = work / "picture.png", work / "picture.exr"
    command = [embrasure, "render", scene, "-o", image, "-o", floats, "--time-limit", "20s", "--warnings", "none"]
    start = time.monotonic()
    said = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    seconds = time.monotonic() - start
    shown = matplotlib.image.imread(image)[..., :3]
    with OpenEXR.File(str(floats)) as file:
        depth = numpy.asarray(file.channels()["Z"].pixels)
    subject = depth < 0.5 * BACKGROUND
    codes = shown[subject] if subject.any() else shown.reshape(-1, 3)
    guess = re.search(r"^camera: (an? \w+)", said, re.M)
    light = re.search(r"^light: ([^(:]+)", said, re.M)
    row = {
        "seconds": seconds,
        "covered": float(subject.mean()),
        "white": float((codes >= WHITE).any(axis=-1).mean()),
        "median": float(numpy.median(luminance(codes))),
        "camera": guess.group(1) if guess else "",
        "light": light.group(1).strip() if light else "its own",
    }
    return row, shown


def reduced(picture):
    """The picture reduced to the size of a tile with block means."""
    step = max(picture.shape[0] // TILE, 1)
    height, width = picture.shape[0] // step * step, picture.shape[1] // step * step
    blocks = picture[:height, :width].reshape(height // step, step, width // step, step, 3)
    return blocks.mean(axis=(1, 3))[:TILE, :TILE]


def sheet(pictures, path):
    rows = -(-len(pictures) // COLUMNS)
    edge = TILE + MARGIN
    canvas = numpy.ones((rows * edge + MARGIN, COLUMNS * edge + MARGIN, 3))
    for i, picture in enumerate(pictures):
        y, x = MARGIN + i // COLUMNS * edge, MARGIN + i % COLUMNS * edge
        small = reduced(picture)
        canvas[y : y + small.shape[0], x : x + small.shape[1]] = small
    matplotlib.image.imsave(path, numpy.clip(canvas, 0, 1))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ["scenes", "embrasure", "work", "table", "sheet"]:
        parser.add_argument(f"--{name}", type=Path, required=True)
    args = parser.parse_args()
    lines = ["| scene | covered | white | median | seconds | camera | light |", "|---|---|---|---|---|---|---|"]
    pictures = []
    for scene in objs(args.scenes):
        try:
            row, shown = render(args.embrasure, scene, args.work)
        except subprocess.CalledProcessError as error:
            print(f"{scene}: {error.stderr.strip()}")
            lines.append(f"| {scene.stem} | refused: {error.stderr.strip().splitlines()[0]} | | | | | |")
            continue
        pictures.append(shown)

        def figure(name, scale, unit):
            low, high = LIMITS[name]
            text = f"{row[name] * scale:.{0 if scale == 100 and name == 'covered' else 2}f}{unit}"
            # Interiors fill the frame, so their coverage may exceed the limit.
            is_wanted = low <= row[name] <= high or (name == "covered" and "interior" in row["camera"])
            return text if is_wanted else f"**{text}**"

        cells = [figure("covered", 100, " %"), figure("white", 100, " %"), figure("median", 1, "")]
        lines.append(
            f"| {scene.stem} | {' | '.join(cells)} | {row['seconds']:.1f} | {row['camera']} | {row['light']} |"
        )
        print(lines[-1])
    args.table.write_text("\n".join(lines) + "\n")
    sheet(pictures, args.sheet)


if __name__ == "__main__":
    main()
