"""Ray queries compared with brute force in numpy."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any, Tuple

import numpy as np
import pytest
from numpy.typing import NDArray

import embrasure as em
from conftest import random_triangles, triangle_scene

Doubles = NDArray[np.float64]


def brute_force(corners: Doubles, origins: Doubles, directions: Doubles) -> Tuple[Any, Any, Any]:
    """Closest hit of each ray in f64: t, triangle, and distance to the nearest edge of any triangle.

    The distance is in barycentrics. The ray is intersected with the plane of a triangle first. The
    barycentrics of this point are dot products.
    """
    a, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    n = np.cross(e1, e2)
    squared = (n * n).sum(1)[:, None]
    of_u, of_v = np.cross(e2, n) / squared, np.cross(n, e1) / squared
    t = ((a * n).sum(1) - origins @ n.T) / (directions @ n.T)
    u = origins @ of_u.T - (a * of_u).sum(1) + t * (directions @ of_u.T)
    v = origins @ of_v.T - (a * of_v).sum(1) + t * (directions @ of_v.T)
    inside = np.minimum(np.minimum(u, v), 1 - u - v)
    # Rays close to the edge of a triangle may hit or miss.
    margin = np.where(t > 0, np.abs(inside), np.inf).min(1)
    t[(inside <= 0) | (t <= 0)] = np.inf
    prim = t.argmin(1)
    closest = t[np.arange(len(t)), prim]
    return closest, np.where(np.isfinite(closest), prim, -1), margin


@functools.cache
def a_million_rays() -> Tuple[Any, Any, Any, Any, Any]:
    """Vertices and faces of 200 triangles, origins and directions of rays, and brute-force hits."""
    vertices, faces = random_triangles(200, 3)
    random = np.random.default_rng(4)
    count = 1_000_000
    origins = random.uniform(-2, 2, (count, 3)).astype(np.float32)
    directions = random.normal(size=(count, 3)).astype(np.float32)
    corners = vertices[faces].astype(np.float64)
    batches = [slice(start, start + 4096) for start in range(0, count, 4096)]
    found = [brute_force(corners, origins[b].astype(np.float64), directions[b].astype(np.float64)) for b in batches]
    return vertices, faces, origins, directions, [np.concatenate(parts) for parts in zip(*found)]


@pytest.mark.parametrize("backend", em.version_text().count("backend obvhs") * ["obvhs"] + ["embree"])
def test_a_million_rays_on_200_triangles(backend: str) -> None:
    vertices, faces, origins, directions, (t, prim, margin) = a_million_rays()
    corners = vertices[faces].astype(np.float64)
    scene = triangle_scene(vertices, faces)
    hits = em.intersect(scene, origins, directions, backend=backend)
    assert em.occluded(scene, origins, directions, backend=backend).tolist() == hits.hit.tolist()

    # Rays that are unambiguous in f32
    clear = margin > 1e-4
    assert clear.mean() > 0.97
    assert (hits.prim[clear] == prim[clear]).mean() > 0.99999
    same = clear & (hits.prim == prim) & (prim >= 0)
    assert 0.05 < same.mean() < 0.9
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
    assert np.allclose(hits.t, 0.5) and (hits.normal == [0, 0, 1]).all() and len(hits) == 4
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
    hits = em.intersect(scene, [278, 273, -800], [[0, 0, 1.0], [0.1, 0.2, 1.0]])
    assert hits.hit.all() and (hits.geom >= 0).all()
    assert np.allclose(np.linalg.norm(hits.normal, axis=1), 1, atol=1e-5)
    # Film and rays hit the same surface in the middle.
    assert abs(film["Z"][32, 32] - hits.t[0]) < 10


def test_the_structure_is_kept_until_the_scene_changes() -> None:
    scene = triangle_scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    em.intersect(scene, [0, 0, 1], [0, 0, -1])
    kept = scene._rays
    em.intersect(scene, [0, 0, 2], [0, 0, -1])
    assert scene._rays is kept
    scene.add_mesh([[-1, -1, 0.5], [1, -1, 0.5], [0, 1, 0.5]], [[0, 1, 2]])
    hits = em.intersect(scene, [0, 0, 1], [0, 0, -1])
    assert np.isclose(hits.t, 0.5) and hits.geom == 1


def test_wrong_arrays_are_refused() -> None:
    scene = triangle_scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    wrong: Any
    for wrong in ([[0, 0]], 3):
        with pytest.raises(ValueError, match="origins: an array …×3"):
            em.intersect(scene, wrong, [0, 0, -1])
    with pytest.raises(ValueError, match=r"arrays of the same shape are expected, not of \(2, 3\) and \(3, 3\)"):
        em.intersect(scene, np.zeros((2, 3)), np.zeros((3, 3)))
    intervals: Any = [{"t_min": -1}, {"t_min": np.inf}, {"t_max": np.nan}, {"t_max": [1, np.nan]}, {"t_max": [1, 2, 3]}]
    for interval in intervals:
        with pytest.raises(ValueError, match=f"{next(iter(interval))}: "):
            em.occluded(scene, [[0, 0, 1], [0, 0, 2]], [0, 0, -1], **interval)
    with pytest.raises(em.SettingError, match="backend"):
        em.intersect(scene, [0, 0, 1], [0, 0, -1], backend="optix")


def test_structures_of_several_backends_are_kept() -> None:
    scene = triangle_scene(*random_triangles(20, seed=3))
    origins, directions = np.zeros((1, 3)), np.ones((1, 3))
    for backend in ["embree", "brute"] * 2:
        em.intersect(scene, origins, directions, backend=backend)
    assert len(scene._rays) == 2
    for threads in range(1, 6):
        em.occluded(scene, origins, directions, threads=threads)
    assert len(scene._rays) == 3
    scene.add_mesh([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])
    em.occluded(scene, origins, directions)
    assert len(scene._rays) == 1
