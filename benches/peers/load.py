"""Measures the time of each program to load a large OBJ file and to build its structure.

`make bench-peers` runs it last. A process reads the file and renders 16 × 16 pixels with one sample.
Another process does the same with a single triangle. Its time is start-up, picture and exit, so the
difference is loading and building. LuxCore is left out: it reads PLY files, not OBJ files.
"""

import json
import sys
from pathlib import Path

# Equal for all programs: the mesh lies within 0.06 of the origin, and a white environment lights it.
SIZE, ORIGIN, FOV_Y = 16, (0, 0, 0.3), 40
TRIANGLE = "v -0.05 -0.05 0\nv 0.05 -0.05 0\nv 0 0.05 0\nf 1 2 3\n"
US = "Embrasure"


def mitsuba(obj: str, output: str) -> int:
    import mitsuba as mi

    # Use the variant of render_mitsuba.py. It builds its hierarchy with Embree.
    mi.set_variant("llvm_ad_rgb")
    look = mi.ScalarTransform4f().look_at(origin=ORIGIN, target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}, "component_format": "float32"}
    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path"},
        "light": {"type": "constant"},
        "sensor": {"type": "perspective", "fov": FOV_Y, "near_clip": 1e-3, "far_clip": 10, "to_world": look, "film": film},
        # Without face_normals Mitsuba computes the missing vertex normals; Embrasure does not.
        "shape": {"type": "obj", "filename": obj, "face_normals": True},
    })
    mi.Bitmap(mi.render(scene, spp=1)).write(output)
    return scene.shapes()[0].face_count()


def cycles(obj: str, output: str) -> int:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    stage = bpy.context.scene
    # With these axes, the importer keeps the coordinates of the file.
    bpy.ops.wm.obj_import(filepath=obj, forward_axis="Y", up_axis="Z")
    camera = bpy.data.cameras.new("camera")
    camera.angle, camera.clip_start = FOV_Y * 3.14159265 / 180, 1e-3
    stage.camera = bpy.data.objects.new("camera", camera)
    stage.camera.location = ORIGIN
    stage.collection.objects.link(stage.camera)
    stage.world = bpy.data.worlds.new("world")
    stage.world.use_nodes = True
    stage.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    render = stage.render
    render.engine, render.filepath, render.image_settings.file_format = "CYCLES", output, "OPEN_EXR"
    render.resolution_x = render.resolution_y = SIZE
    stage.cycles.device, stage.cycles.samples, stage.cycles.use_denoising = "CPU", 1, False
    bpy.ops.render.render(write_still=True)
    return sum(len(thing.data.polygons) for thing in stage.objects if thing.type == "MESH")


PEERS = {"Mitsuba": (mitsuba, "mitsuba"), "Cycles": (cycles, "bpy")}


def command(program: str, embrasure: Path, obj: Path, folder: Path) -> list:
    """Command that renders the OBJ file, and writes its number of triangles to folder/stats."""
    if program != US:
        return [sys.executable, __file__, program, obj, folder / "x.exr", folder / "stats"]
    camera = ["--position", ",".join(map(str, ORIGIN)), "--look-at", "0,0,0", "--fov", FOV_Y]
    files = ["-o", folder / "x.exr", "--stats", folder / "stats"]
    return [embrasure.resolve(), "render", "-q", "--spp", 1, "--size", f"{SIZE}x{SIZE}", *camera, *files, obj]


def main() -> None:
    import argparse
    import tempfile
    from collections import defaultdict
    from statistics import median

    from compare import head, timed

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mesh", type=Path, required=True, help="a large OBJ file of triangles alone")
    parser.add_argument("--embrasure", type=Path, required=True, help="our program")
    parser.add_argument("--repeat", type=int, default=5, help="processes of each; medians are taken")
    parser.add_argument("--table", type=Path, required=True, help="write the table here")
    arguments = parser.parse_args()

    runs, stages = defaultdict(list), defaultdict(list)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "triangle.obj").write_text(TRIANGLE)
        meshes, mesh = {folder / "triangle.obj": 1}, arguments.mesh.resolve()
        with mesh.open() as lines:
            meshes[mesh] = sum(line.startswith("f ") for line in lines)
        for _ in range(arguments.repeat):
            for program in (US, *PEERS):
                for obj, triangles in meshes.items():
                    seconds, _, megabytes = timed(command(program, arguments.embrasure, obj, folder))
                    stats = json.loads((folder / "stats").read_text())
                    if stats["triangles"] != triangles:
                        raise SystemExit(f"{program} found {stats['triangles']} triangles in {obj}, not {triangles}")
                    runs[program, triangles].append((seconds, megabytes))
                    print(program, triangles, seconds, megabytes, flush=True)
                    if program == US:
                        stages[triangles].append((stats["load_s"], stats["build_s"]))

    rows = {}
    for program in (US, *PEERS):
        (small, small_mb), (large, large_mb) = ([median(f) for f in zip(*runs[program, n])] for n in meshes.values())
        rows[program] = large, small, large - small, large_mb, small_mb
    lines = [
        "| program | mesh, s | one triangle, s | load + build, s | as a multiple of ours | mesh, MB | one triangle, MB |",
        "|---|---|---|---|---|---|---|",
    ]
    for program, (large, small, difference, large_mb, small_mb) in rows.items():
        multiple = difference / rows[US][2]
        lines.append(f"| {program} | {large:.2f} | {small:.2f} | {difference:.2f} | {multiple:.2f} | {large_mb:.0f} | {small_mb:.0f} |")
    load, build = (median(seconds) for seconds in zip(*stages[triangles]))
    ours = f"By its own `--stats`, Embrasure takes {load:.2f} s to load the {triangles} triangles and {build:.2f} s to build.\n"
    packages = {program: package for program, (_, package) in PEERS.items()}
    arguments.table.write_text(head(arguments.embrasure, packages, f"renders of each: {arguments.repeat}") + "\n".join(lines) + "\n\n" + ours)


if __name__ == "__main__":
    # A process that measures another program imports only that program and common modules.
    if sys.argv[1] in PEERS:
        program, obj, output, stats = sys.argv[1:]
        triangles = PEERS[program][0](obj, output)
        Path(stats).write_text(json.dumps({"triangles": triangles}))
    else:
        main()
