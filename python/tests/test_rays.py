"""Ray queries against brute force by numpy."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Tuple

import numpy as np
import pytest
from numpy.typing import NDArray

import embrasure as em
from conftest import random_triangles, triangle_scene

Doubles = NDArray[np.float64]


def brute_force(corners: Doubles, origins: Doubles, directions: Doubles) -> Tuple[Doubles, NDArray[np.int64], Doubles]:
    """Closest hit of each ray: t, triangle, and how far inside of the triangle it is, by barycentrics in f64 (Möller and Trumbore 1997)."""
    t: Any
    prim: Any
    margin: Any
    t, prim, margin = (np.full(len(origins), fill) for fill in (np.inf, -1.0, np.inf))
    for index, (a, b, c) in enumerate(corners):
        e1, e2, s = b - a, c - a, origins - a
        h, q = np.cross(directions, e2), np.cross(s, e1)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / (h @ e1)
            u, v = (s * h).sum(1) * inverse, (q * directions).sum(1) * inverse
            distance = (q @ e2) * inverse
        inside = np.minimum(np.minimum(u, v), 1 - u - v)
        # Rays that pass the rim of any triangle closely may be judged either way.
        margin = np.minimum(margin, np.where(distance > 0, np.abs(inside), np.inf))
        better = (inside > 0) & (distance > 0) & (distance < t)
        t, prim = np.where(better, distance, t), np.where(better, index, prim)
    return t, prim.astype(np.int64), margin


@pytest.mark.parametrize("backend", em.version_text().count("backend obvhs") * ["obvhs"] + ["embree"])
def test_a_million_rays_on_200_triangles(backend: str) -> None:
    vertices, faces = random_triangles(200, 3)
    random = np.random.default_rng(4)
    count = 1_000_000
    origins = random.uniform(-2, 2, (count, 3)).astype(np.float32)
    directions = random.normal(size=(count, 3)).astype(np.float32)
    scene = triangle_scene(vertices, faces)
    hits = em.intersect(scene, origins, directions, backend=backend)
    assert em.occluded(scene, origins, directions, backend=backend).tolist() == hits.hit.tolist()

    corners = vertices[faces].astype(np.float64)
    batches = np.array_split(np.arange(count), 20)
    found = [brute_force(corners, origins[b].astype(np.float64), directions[b].astype(np.float64)) for b in batches]
    t, prim, margin = (np.concatenate(parts) for parts in zip(*found))
    # Those that f32 can tell
    clear = margin > 1e-4
    assert clear.mean() > 0.97
    assert (hits.prim[clear] == prim[clear]).mean() > 0.99999
    same = clear & (hits.prim == prim) & (prim >= 0)
    assert 0.2 < same.mean() < 0.9
    assert np.abs(hits.t[same] - t[same]).max() < 1e-3
    points = origins[same] + hits.t[same, None] * directions[same]
    by_weights = np.einsum("nk,nkc->nc", hits.barycentrics[same], corners[prim[same]])
    assert np.abs(points - by_weights).max() < 1e-3
    a, b, c = np.moveaxis(corners[prim[same]], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.abs(hits.normal[same] - normals).max() < 1e-3
    missed = prim == -1
    assert np.isinf(hits.t[missed & clear]).all() and (hits.geom[missed & clear] == -1).all()


def test_shapes_are_those_of_the_rays() -> None:
    scene = triangle_scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    directions = np.zeros((4, 5, 3)) + [0, 0, -2]
    hits = em.intersect(scene, [0, 0, 1], directions)
    assert hits.t.shape == (4, 5) and hits.normal.shape == hits.barycentrics.shape == (4, 5, 3)
    assert (hits.t == 0.5).all() and (hits.normal == [0, 0, 1]).all() and len(hits) == 4
    assert em.occluded(scene, [0, 0, 1], [0, 0, -1]).shape == ()
    assert len(em.intersect(scene, np.zeros((0, 3)), np.zeros((0, 3)))) == 0


def test_intervals_are_open() -> None:
    scene = triangle_scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    far = em.occluded(scene, [[0, 0, 1]] * 3, [0, 0, -1], t_max=[0.5, 0.999, 1.5])
    assert far.tolist() == [False, False, True]
    assert not em.occluded(scene, [0, 0, 1], [0, 0, -1], t_min=1.01)
    assert not em.occluded(scene, [0, 0, 1], [0, 0, -1], t_max=0.9)


def test_triangles_without_area_keep_the_numbers_of_others() -> None:
    vertices = [[-1, -1, 0], [1, -1, 0], [0, 1, 0], [0, 0, 5], [-1, -1, -1], [1, -1, -1], [0, 1, -1]]
    scene = triangle_scene(vertices, [[3, 3, 3], [0, 1, 2], [0, 0, 1], [4, 5, 6]])
    hits = em.intersect(scene, [[0, 0, 1], [0, 0, -0.5]], [0, 0, -1])
    assert hits.prim.tolist() == [1, 3]


def test_scenes_of_files_are_asked(box: Path) -> None:
    scene = em.load(box)
    film = em.render(scene, spp=1, size=(64, 64), filter="box", integrator="debug")
    hits = em.intersect(scene, [0, 0, 3.9], [[0, 0, -1.0], [0.1, 0.2, -1.0]])
    assert hits.hit.all() and (hits.geom >= 0).all()
    assert np.allclose(np.linalg.norm(hits.normal, axis=1), 1, atol=1e-5)
    # Film and rays meet one surface in the middle.
    assert abs(film["Z"][32, 32] - hits.t[0]) < 0.05


def test_the_structure_is_kept_until_the_scene_changes() -> None:
    scene = triangle_scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    em.intersect(scene, [0, 0, 1], [0, 0, -1])
    kept = scene._rays
    em.intersect(scene, [0, 0, 2], [0, 0, -1])
    assert scene._rays is kept
    scene.add_mesh([[-1, -1, 0.5], [1, -1, 0.5], [0, 1, 0.5]], [[0, 1, 2]])
    hits = em.intersect(scene, [0, 0, 1], [0, 0, -1])
    assert hits.t == 0.5 and hits.geom == 1


def test_wrong_arrays_are_refused() -> None:
    scene = triangle_scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    wrong: Any
    for wrong in ([[0, 0]], 3):
        with pytest.raises(ValueError, match="origins: an array …×3"):
            em.intersect(scene, wrong, [0, 0, -1])
    with pytest.raises(ValueError):
        em.intersect(scene, np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(em.SettingError, match="backend"):
        em.intersect(scene, [0, 0, 1], [0, 0, -1], backend="optix")
