"""Writes the OBJ files of our own scenes of the gallery, and their textures, to `scenes`. It
needs only Python: `python3 scripts/models`. Arguments are scenes to write, such as still-life; the
default is all scenes. Materials (MTL) and cameras (TOML) are written by hand."""
import importlib
import sys
from pathlib import Path

import owl
import wood

SCENES = ["still-life", "stairwell", "coats", "desk-lamp", "moka", "presets", "scan", "owl"]
folder = Path(__file__).resolve().parent.parent.parent / "scenes"
for name in sys.argv[1:] or SCENES:
    model = importlib.import_module(name.replace("-", "_"))
    path = folder / f"{name}.obj"
    model.build().write(path, model.TITLE)
    print(f"{path.relative_to(folder.parent)}: {path.stat().st_size // 1000} kB")
if not sys.argv[1:]:
    wood.write(folder / "wood.png")
    owl.write(folder)
