"""Compares the material libraries as read by Blender and by this program.

It compares mean colours of spheres of each material under a white sky.

    python3.11 -m venv venv && venv/bin/pip install bpy==5.0.1 numpy==1.26.4 OpenEXR==3.5.3
    venv/bin/python benches/peers/mtl_blender.py --embrasure target/release/embrasure --chart kitchen.mtl

Blender's importer reads each library, and Cycles renders a sphere of each material. This program
renders the same spheres with the library read as `--mtl-dialect auto` and literally (`spec`). The
means over a sphere's disc are compared in each channel. With --chart Blender also writes two
libraries of surfaces that vary one input at a time, with and without its PBR extension, and they are
compared too.

The exit code is 1 if a material read with `auto` differs by more than 5 %.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
import OpenEXR

SIZE, SPP, DISTANCE, FOV_Y, DEPTH = 64, 64, 10, 12, 64
# Radius of the compared disc, relative to half the height. The disc of the sphere has the radius
# 0.956.
DISC = 0.945
# Maximum relative difference of a mean, and the value below which the difference is absolute.
TOLERANCE, FLOOR = 0.05, 0.01
DIALECTS = ("auto", "spec")
INPUTS = {
    "base_color": "Base Color",
    "metallic": "Metallic",
    "roughness": "Roughness",
    "specular": "Specular IOR Level",
    "ior": "IOR",
    "alpha": "Alpha",
    "transmission": "Transmission Weight",
    "coat": "Coat Weight",
    "coat_roughness": "Coat Roughness",
    "sheen": "Sheen Weight",
    "anisotropic": "Anisotropic",
    "emission": "Emission Color",
    "emission_strength": "Emission Strength",
}
# Settings of each material that differ from a new principled surface, by the name of the material.
CHART = {
    "plain": {},
    "black": {"Base Color": (0.01, 0.01, 0.01, 1)},
    "red": {"Base Color": (0.8, 0.05, 0.02, 1)},
    "smooth": {"Roughness": 0.1},
    "rough": {"Roughness": 1.0},
    "dull": {"Specular IOR Level": 0.1},
    "matte": {"Specular IOR Level": 0.0},
    "shiny": {"Specular IOR Level": 1.0, "Roughness": 0.2},
    "dense": {"IOR": 1.8, "Base Color": (0.1, 0.2, 0.5, 1)},
    "water": {"IOR": 1.33, "Base Color": (0.1, 0.2, 0.5, 1)},
    "gold": {"Metallic": 1.0, "Base Color": (0.9, 0.6, 0.2, 1), "Roughness": 0.2},
    "brushed": {"Metallic": 1.0, "Base Color": (0.7, 0.7, 0.7, 1), "Roughness": 0.6},
    "half_metal": {"Metallic": 0.5, "Base Color": (0.6, 0.3, 0.1, 1)},
    "veil": {"Alpha": 0.4, "Base Color": (0.2, 0.5, 0.2, 1)},
    "metal_veil": {"Alpha": 0.6, "Metallic": 0.8},
    "lamp": {"Emission Color": (1, 0.5, 0.2, 1), "Emission Strength": 3.0},
    "coated": {"Coat Weight": 0.6, "Coat Roughness": 0.1, "Base Color": (0.4, 0.1, 0.1, 1)},
    "anisotropic": {"Metallic": 1.0, "Anisotropic": 0.6, "Roughness": 0.4},
    "glass": {"Transmission Weight": 1.0, "Roughness": 0.0, "IOR": 1.45, "Base Color": (1, 1, 1, 1)},
    "green_glass": {"Transmission Weight": 1.0, "Roughness": 0.0, "Base Color": (0.3, 0.8, 0.5, 1)},
    "half_glass": {"Transmission Weight": 0.5, "Roughness": 0.3, "Base Color": (0.7, 0.4, 0.3, 1)},
}


def names_of(library: Path) -> list[str]:
    lines = (line.strip() for line in library.read_text(errors="replace").splitlines())
    return list(dict.fromkeys(line.split(None, 1)[1] for line in lines if line.lower().startswith("newmtl ")))


def sphere(first: int, rings: int = 32, slices: int = 64) -> str:
    """Faces of a unit sphere with the axis z. Its first vertex has the index `first`."""
    phi, theta = np.meshgrid(np.linspace(0, 2 * np.pi, slices + 1), np.linspace(0, np.pi, rings + 1))
    places = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    uvs = np.stack([phi / (2 * np.pi), 1 - theta / np.pi], -1).reshape(-1, 2)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in places] + [f"vt {u:.6f} {v:.6f}" for u, v in uvs]
    for ring in range(rings):
        for a in range(first + ring * (slices + 1), first + ring * (slices + 1) + slices):
            b, c, d = a + slices + 1, a + slices + 2, a + 1
            corners = [a, b, c] if ring == 0 else [a, b, d] if ring == rings - 1 else [a, b, c, d]
            lines.append("f " + " ".join(f"{i}/{i}" for i in corners))
    return "\n".join(lines) + "\n"


def mean(picture: Path) -> np.ndarray:
    """Mean colour of the sphere's disc in the picture."""
    channels = OpenEXR.File(str(picture)).channels()
    if "RGB" in channels or "RGBA" in channels:
        pixels = channels["RGB" if "RGB" in channels else "RGBA"].pixels[..., :3]
    else:
        pixels = np.stack([channels[c].pixels for c in "RGB"], -1)
    y, x = (2 * (np.mgrid[0:SIZE, 0:SIZE] + 0.5) / SIZE - 1)
    return pixels[np.hypot(x, y) < DISC].astype(np.float64).mean(0)


def write_chart(folder: Path, extended: bool) -> Path:
    """Writes a library of the chart with Blender."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("chart")
    corners = [(i + dx, dy, 0) for i in range(len(CHART)) for dx, dy in ((0, 0), (1, 0), (0, 1))]
    mesh.from_pydata(corners, [], [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(len(CHART))])
    for index, (name, changes) in enumerate(CHART.items()):
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        for key, value in changes.items():
            material.node_tree.nodes["Principled BSDF"].inputs[key].default_value = value
        mesh.materials.append(material)
        mesh.polygons[index].material_index = index
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("chart", mesh))
    path = folder / ("chart, PBR extension.obj" if extended else "chart.obj")
    bpy.ops.wm.obj_export(filepath=str(path), export_pbr_extensions=extended)
    return path.with_suffix(".mtl")


def by_cycles(library: Path, names: list[str], work: Path) -> dict:
    """Inputs and mean colours of all materials in Blender."""
    vertices = sphere(1).count("\nv ") + 1
    parts = [f"o sphere{i}\nusemtl {name}\n{sphere(1 + i * vertices)}" for i, name in enumerate(names)]
    obj = work / "all-spheres.obj"
    obj.write_text(f"mtllib {library.name}\n" + "".join(parts))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    # With these axes, the importer keeps the coordinates of the file.
    bpy.ops.wm.obj_import(filepath=str(obj), forward_axis="Y", up_axis="Z")
    stage = bpy.context.scene
    stage.world = bpy.data.worlds.new("world")
    stage.world.use_nodes = True
    stage.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle_y, camera.clip_start = "VERTICAL", np.radians(FOV_Y), 1e-3
    stage.camera = bpy.data.objects.new("camera", camera)
    stage.camera.location = (0, 0, DISTANCE)
    stage.collection.objects.link(stage.camera)
    render, cycles = stage.render, stage.cycles
    render.engine, render.resolution_percentage = "CYCLES", 100
    render.resolution_x = render.resolution_y = SIZE
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", SPP, False, False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = DEPTH
    cycles.transmission_bounces = cycles.transparent_max_bounces = DEPTH
    found = {}
    for index, name in enumerate(names):
        for thing in stage.objects:
            thing.hide_render = thing.type == "MESH" and thing.name != f"sphere{index}"
        material = stage.objects[f"sphere{index}"].material_slots[0].material
        sockets = material.node_tree.nodes["Principled BSDF"].inputs
        value = {key: sockets[socket].default_value for key, socket in INPUTS.items()}
        inputs = {key: [*v][:3] if hasattr(v, "__len__") else v for key, v in value.items()}
        render.filepath = str(work / "cycles.exr")
        bpy.ops.render.render(write_still=True)
        found[name] = {"inputs": inputs, "blender": mean(work / "cycles.exr").tolist()}
    return found


def by_us(embrasure: Path, library: Path, name: str, dialect: str, work: Path) -> list[float]:
    """Mean colour of a material in this program; NaN if it rejects the library."""
    (work / "sphere.obj").write_text(f"mtllib {library.name}\nusemtl {name}\n{sphere(1)}")
    (work / "sphere.toml").write_text(f"""version = 1
[camera]
position = [0, 0, {DISTANCE}]
look_at = [0, 0, 0]
vertical_fov = {FOV_Y}
[image]
width = {SIZE}
height = {SIZE}
[render]
samples = {SPP}
max_depth = {DEPTH}
mtl_dialect = "{dialect}"
[[object]]
obj = "sphere.obj"
[[light]]
type = "constant"
radiance = [1, 1, 1]
""")
    output = work / "us.exr"
    command = [embrasure, "render", "-q", work / "sphere.toml", "-o", output]
    run = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    if run.returncode:
        print(run.stderr, file=sys.stderr)
        return [float("nan")] * 3
    return mean(output).tolist()


def difference(ours: list[float], theirs: list[float]) -> float:
    """Largest relative difference of a channel; infinite without a picture."""
    return float("inf") if np.isnan(ours).any() else max(abs(a - b) / max(b, FLOOR) for a, b in zip(ours, theirs))


def compare(embrasure: Path, library: Path) -> dict:
    """Compares all materials of a library."""
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        for entry in library.parent.iterdir():
            os.symlink(entry.resolve(), work / entry.name)
        names = names_of(library)
        materials = by_cycles(library, names, work)
        for name, material in materials.items():
            for dialect in DIALECTS:
                material[dialect] = by_us(embrasure, library, name, dialect, work)
                material[f"{dialect}_difference"] = difference(material[dialect], material["blender"])
    return materials


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("libraries", nargs="*", type=Path, metavar="FILE.mtl", help="material libraries")
    parser.add_argument("--embrasure", type=Path, required=True, help="our program")
    parser.add_argument("--chart", action="store_true", help="libraries that Blender writes for the purpose, too")
    parser.add_argument("--json", type=Path, help="write inputs and means of all materials here")
    parser.add_argument("--table", type=Path, help="write the table here")
    arguments = parser.parse_args()
    if not arguments.libraries and not arguments.chart:
        parser.error("give a library, or --chart")

    rows, report, is_wrong = [], {}, False
    with tempfile.TemporaryDirectory() as name:
        charts = []
        for extended in (False, True) if arguments.chart else ():
            folder = Path(name) / str(extended)
            folder.mkdir()
            charts.append(write_chart(folder, extended))
        for library in [*(path.resolve() for path in arguments.libraries), *charts]:
            materials = compare(arguments.embrasure.resolve(), library)
            report[library.name] = materials
            cells = []
            for dialect in DIALECTS:
                worst = max(materials, key=lambda m: materials[m][f"{dialect}_difference"])
                differences = [m[f"{dialect}_difference"] for m in materials.values()]
                within = sum(d <= TOLERANCE for d in differences)
                largest = f"{100 * max(differences):.1f} % ({worst})" if np.isfinite(max(differences)) else "refused"
                cells.append(f"{within} of {len(differences)} | {largest}")
                is_wrong |= dialect == "auto" and within < len(differences)
            rows.append(f"| {library.stem} | " + " | ".join(cells) + " |")
            for material, values in materials.items():
                colours = (" ".join(f"{c:.4f}" for c in values[key]) for key in ("blender", *DIALECTS))
                percent = (f"{100 * values[f'{dialect}_difference']:5.1f} %" for dialect in DIALECTS)
                print(f"{library.stem}: {material:16} {' | '.join(colours)} | {' | '.join(percent)}", flush=True)
    head = ["| library | auto: within 5 % | largest difference | spec: within 5 % | largest difference |", "|---|---|---|---|---|"]
    table = "\n".join([*head, *rows]) + "\n"
    print(table, end="")
    if arguments.table:
        arguments.table.write_text(table)
    if arguments.json:
        arguments.json.write_text(json.dumps(report, indent=1) + "\n")
    sys.exit(is_wrong)


if __name__ == "__main__":
    main()
