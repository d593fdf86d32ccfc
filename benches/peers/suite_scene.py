"""A scene of the comparison suite for other renderers: camera, materials and triangles."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass
class Part:
    """Triangles of one material.

    `principled` has the parameters of the material with Mitsuba's names. Without `principled` it is matte.
    """

    kd: list[float]
    ke: list[float]
    vertices: np.ndarray  # (n, 3) float32
    triangles: np.ndarray  # (m, 3) int32
    principled: dict | None


@dataclass
class SuiteScene:
    width: int
    height: int
    origin: list[float]
    target: list[float]
    up: list[float]
    fov_y: float  # degrees
    parts: list[Part]
    # True for a room: the renderer's own importer reads its OBJ file, and there are no parts.
    is_room: bool
    obj: Path
    # Radiance of a constant sky.
    sky: list[float] | None

    # Maximum number of scattering events, as in the suite's own scene files.
    MAX_DEPTH = 64


def load(path: Path) -> SuiteScene:
    """Reads the JSON file `path`, and except for rooms its OBJ file and the MTL file beside it.

    The OBJ file has triangles and polygons without normals.
    """
    description = json.loads(path.read_text())
    obj = path.parent / description["obj"]
    # A scene is a room unless it is matte (its file is called scene.json) or glossy (its file has
    # the key bsdf).
    is_room = path.name != "scene.json" and "bsdf" not in description
    camera = description["camera"]
    return SuiteScene(
        description["width"],
        description["height"],
        camera["origin"],
        camera["target"],
        camera["up"],
        camera["fov_y"],
        [] if is_room else parts_of(obj, description.get("bsdf", {})),
        is_room,
        obj,
        description.get("sky"),
    )


def parts_of(obj: Path, bsdfs: dict) -> list[Part]:
    """Triangles of each material, in the order of the file; `bsdfs` has the principled materials."""
    materials: dict[str, dict[str, list[float]]] = {}
    for line in obj.with_suffix(".mtl").read_text().splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "newmtl":
            current = materials.setdefault(line.split(None, 1)[1].strip(), {})
        elif words[0] in ("Kd", "Ke"):
            current[words[0]] = [float(w) for w in words[1:4]]

    positions: list[list[float]] = []
    faces: dict[str, list[list[int]]] = {}
    for line in obj.read_text().splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "v":
            positions.append([float(w) for w in words[1:4]])
        elif words[0] == "usemtl":
            target = faces.setdefault(line.split(None, 1)[1].strip(), [])
        elif words[0] == "f":
            corners = [int(w.split("/")[0]) for w in words[1:]]
            corners = [c - 1 if c > 0 else len(positions) + c for c in corners]
            target += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]

    points = np.array(positions, np.float32)
    parts = []
    for name, triangles in faces.items():
        if triangles:
            used, local = np.unique(np.array(triangles), return_inverse=True)
            material = materials[name]
            zero = [0.0, 0.0, 0.0]
            principled = bsdfs.get(name, {}).get("bsdf")
            mesh = points[used], local.reshape(-1, 3).astype(np.int32)
            parts.append(Part(material.get("Kd", zero), material.get("Ke", zero), *mesh, principled))
    return parts


def write_ply(part: Part, path: Path) -> None:
    """Writes the triangles as binary PLY, without normals."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(part.vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(part.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(part.triangles), np.dtype([("n", "u1"), ("v", "<i4", 3)]))
    faces["n"], faces["v"] = 3, part.triangles
    path.write_bytes(header.encode() + part.vertices.astype("<f4").tobytes() + faces.tobytes())
