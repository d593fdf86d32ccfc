"""Scenes from arrays compared with the same scenes from files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, List

import numpy as np
import pytest
import trimesh

import embrasure as em
from conftest import random_triangles

CAMERA = {"position": [0.5, 1.0, 4.0], "look_at": [0, 0, 0], "up": [0, 1, 0], "vertical_fov": 40}


def write(path: Path, vertices: Any, faces: Any, material: str, uv: Any = None, normals: Any = None) -> None:
    lines = ["v " + " ".join(repr(float(x)) for x in v) for v in vertices]
    lines += ["vt " + " ".join(repr(float(x)) for x in v) for v in ([] if uv is None else uv)]
    lines += ["vn " + " ".join(repr(float(x)) for x in v) for v in ([] if normals is None else normals)]
    lines.append(f"usemtl {material}")

    def corner(i: int) -> str:
        parts = [str(i + 1), "" if uv is None else str(i + 1), "" if normals is None else str(i + 1)]
        return "/".join(parts).rstrip("/")

    lines += ["f " + " ".join(corner(int(i)) for i in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


def test_arrays_give_the_bits_of_files(tmp_path: Path) -> None:
    vertices, faces = random_triangles(30, 1)
    random = np.random.default_rng(2)
    # Normals are along axes: readers of OBJ and arrays round unit vectors of other directions
    # differently.
    normals = (np.eye(3, dtype=np.float32) * [[1], [1], [-1]])[random.integers(0, 3, len(vertices))].astype(np.float32)
    uv = random.uniform(size=(len(vertices), 2)).astype(np.float32)
    floor = np.array([[-3, -1.5, -3], [3, -1.5, -3], [3, -1.5, 3], [-3, -1.5, 3]], dtype=np.float32)
    write(tmp_path / "things.obj", vertices, faces, "red", uv, normals)
    write(tmp_path / "floor.obj", floor, [[0, 3, 2], [0, 2, 1]], "grey")
    (tmp_path / "scene.toml").write_text(
        """version = 1
[camera]
position = [0.5, 1.0, 4.0]
look_at = [0, 0, 0]
up = [0, 1, 0]
vertical_fov = 40
[[object]]
obj = "things.obj"
[[object]]
obj = "floor.obj"
[material.red]
diffuse = [0.7, 0.1, 0.1]
model = "ggx"
specular = [0.2, 0.2, 0.2]
roughness = 0.3
[material.grey]
diffuse = [0.5, 0.5, 0.5]
[[light]]
type = "point"
position = [1, 3, 2]
intensity = [20, 20, 20]
"""
    )
    scene = em.Scene()
    red = em.Material("red", diffuse=[0.7, 0.1, 0.1], model="ggx", specular=[0.2, 0.2, 0.2], roughness=0.3)
    assert scene.add_mesh(vertices, faces, normals, uv, red) == 0
    assert scene.add_mesh(floor, [[0, 3, 2, 1]], material=em.Material("grey", diffuse=np.full(3, 0.5))) == 1
    scene.camera = CAMERA
    scene.add_light("point", position=(1, 3, 2), intensity=np.array([20, 20, 20]))
    settings: Any = {"spp": 4, "size": (48, 40)}
    ours, theirs = em.render(scene, **settings), em.render(tmp_path / "scene.toml", **settings)
    for name in theirs.channels:
        assert ours[name].tobytes() == theirs[name].tobytes(), name
    assert theirs["rgb"].max() > 0.05


def test_meshes_join_a_scene_of_a_file(box: Path) -> None:
    scene = em.load(box, size=(32, 32), spp=4)
    before = em.render(scene)
    corners = np.array([[178, 173, -100], [278, 373, -100], [378, 173, -100]])
    scene.add_mesh(corners, [[0, 1, 2]], material=em.Material(diffuse=[0, 0, 1]))
    after = em.render(scene)
    assert (after["Z"] < before["Z"] - 0.01).any()
    middle = after["albedo"][16, 16]
    assert middle[2] > 0.9 and middle[0] < 0.1
    # `red` is a material of the file.
    scene.add_mesh(corners - [0, 0, 10], [[0, 1, 2]], material="red")
    assert em.render(scene)["albedo"][16, 16, 2] < 0.3


def test_a_material_may_be_in_several_scenes() -> None:
    corners, face = np.eye(3), [[0, 1, 2]]
    shared = em.Material(diffuse=[1, 0, 0])
    first, second = em.Scene(), em.Scene()
    first.add_mesh(corners, face, material=shared)
    second.add_mesh(corners, face, material=em.Material(diffuse=[0, 1, 0]))
    for _ in range(2):
        second.add_mesh(corners + 1, face, material=shared)
    assert shared.name is None
    assert second.name_of(shared) == "material-1" and em.bsdf("material-1", second).albedo[0] > 0.9


def test_arrays_of_other_types_and_orders_are_taken() -> None:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
    padded = np.zeros((6, 3))
    padded[::2] = corners
    arrays: Any
    for arrays in (corners.astype(np.int8), corners.astype(np.float64), np.asfortranarray(corners), padded[::2], corners.tolist()):
        faces: Any
        for faces in (np.array([[0, 1, 2]], dtype=np.uint8), np.array([[0], [1], [2]]).T, [(0, 1, 2)]):
            scene = em.Scene()
            scene.add_mesh(arrays, faces)
            assert abs(em.intersect(scene, [0, 0, 1], [0, 0, -1]).t - 1) < 1e-6


def test_trimesh_objects_are_taken() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    scene = em.Scene()
    scene.add_mesh(sphere)
    with pytest.raises(ValueError, match="to_mesh"):
        em.Scene().add_mesh(trimesh.Scene([sphere]))
    hits = em.intersect(scene, [[0, 0, 5]], [[0.01, 0.02, -1]])
    assert abs(hits.t[0] - 4) < 0.05 and hits.geom[0] == 0
    corners = np.asarray(sphere.vertices)[np.asarray(sphere.faces)[hits.prim[0]]]
    found = hits.barycentrics[0] @ corners
    assert np.allclose(found, np.array([0, 0, 5]) + hits.t[0] * np.array([0.01, 0.02, -1]), atol=1e-5)


def test_meshes_of_meshio_are_taken() -> None:
    @dataclass
    class Cells:
        """Same form as meshio's cell blocks."""

        type: str
        data: Any

    @dataclass
    class Mesh:
        points: Any
        cells: List[Cells]

    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    mesh = Mesh(points, [Cells("line", [[0, 1]]), Cells("quad", np.array([[0, 1, 2, 3]]))])
    scene = em.Scene()
    scene.add_mesh(mesh)
    hits = em.intersect(scene, [[0.25, 0.5, 1], [0.75, 0.25, 1], [2, 2, 1]], [0, 0, -1])
    assert hits.hit.tolist() == [True, True, False] and np.allclose(hits.t[:2], 1)
    assert sorted(hits.prim[:2].tolist()) == [0, 1]


def test_what_is_changed_counts_in_the_next_render() -> None:
    scene = em.Scene(spp=1, size=(16, 16))
    paint = em.Material(diffuse=[1, 0, 0])
    scene.add_mesh([[-9, -9, 0], [9, -9, 0], [0, 9, 0]], [[0, 1, 2]], material=paint)
    scene.camera = em.Camera(position=[0, 0, 2], look_at=[0, 0, 0])
    assert em.render(scene)["albedo"][8, 8].argmax() == 0
    paint.keys["diffuse"] = [0, 1, 0]
    assert em.render(scene)["albedo"][8, 8].argmax() == 1
    near = em.render(scene)["Z"][8, 8]
    assert isinstance(scene.camera, em.Camera)
    scene.camera.keys["position"] = [0, 0, 3]
    assert em.render(scene)["Z"][8, 8] > near + 0.5
