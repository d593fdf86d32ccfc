"""Ray queries on arrays."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from embrasure import _native, _settings
from embrasure._scene import Scene, scene_of
from embrasure._settings import Array
from embrasure._vectors import vectors

#: Settings of a scene that ray queries take over: how the geometry is read, and how the
#: acceleration structure is built.
_OF_GEOMETRY = ("backend", "compact", "max_memory", "mtl_dialect", "obj_reader", "smooth", "strict", "texture_dir", "threads")

#: Maximum number of acceleration structures that a scene keeps: one per backend.
_KEPT = 3

#: Settings of all ray queries. Camera and light have fixed values, because they are not used and
#: must not be guessed. Panes of glass stay bodies with the triangles of their mesh.
_FIXED = {"position": (0, 0, 0), "look_at": (0, 0, -1), "up": (0, 1, 0), "env": "white", "panes": "refract"}


@dataclass(frozen=True, eq=False)
class Hits:
    """Closest hits of rays, in arrays of the rays' shape."""

    #: Ray parameter in lengths of the direction; infinite without a hit.
    t: NDArray[np.float32]
    #: Index of the triangle in its mesh; -1 without a hit.
    prim: NDArray[np.int32]
    #: Index of the mesh: meshes of files first, then meshes from arrays in the order of adding.
    #: Meshes without triangles are not counted; -1 without a hit.
    geom: NDArray[np.int32]
    #: Index of the instance; -1 for a mesh in world space.
    inst: NDArray[np.int32]
    #: Weights of the triangle's three vertices, …×3.
    barycentrics: NDArray[np.float32]
    #: Unit geometric normal, on the side from which the corners run counter-clockwise, …×3;
    #: 0 without a hit.
    normal: NDArray[np.float32]

    @property
    def hit(self) -> NDArray[np.bool_]:
        """True for each ray with a hit."""
        return self.geom >= 0

    def __len__(self) -> int:
        return len(self.t)


def intersect(
    scene: Union[Scene, str, "os.PathLike[str]"],
    origins: Array,
    directions: Array,
    backend: Optional[str] = None,
    *,
    t_min: float = 0.0,
    t_max: Array = np.inf,
    threads: Optional[int] = None,
) -> Hits:
    """Closest hits of rays, in the open interval from ``t_min`` to ``t_max``.

    Both are in lengths of the directions. The first call builds the acceleration structure. A
    `Scene` keeps it for later calls with the same backend and threads, until the scene changes. A
    file name is read again by each call. Moving objects are placed at shutter open.

    Args:
        scene: a `Scene`, or the name of its file.
        origins: …×3; a single origin is used for all directions, a single direction for all origins.
        directions: …×3, of any length.
        backend: ``embree``, ``obvhs`` or ``brute``, if built in.
        t_min: a number, 0 or more.
        t_max: a number, or a number per ray.
        threads: number of threads to build and trace. Default: all.

    Raises:
        FileError: a file of the scene cannot be read, or is invalid.
        SettingError: a backend that is not built in, or another invalid setting.
        ValueError: arrays of other shapes, a negative ``t_min``, or NaN in ``t_max``.
    """
    rays = _rays(scene, backend, threads)
    shape, arrays = _arrays(origins, directions, t_min, t_max)
    t, prim, geom, inst, barycentrics, normal = rays.intersect(*arrays)
    three = (*shape, 3)
    return Hits(
        t.reshape(shape),
        prim.reshape(shape),
        geom.reshape(shape),
        inst.reshape(shape),
        barycentrics.reshape(three),
        normal.reshape(three),
    )


def occluded(
    scene: Union[Scene, str, "os.PathLike[str]"],
    origins: Array,
    directions: Array,
    backend: Optional[str] = None,
    *,
    t_min: float = 0.0,
    t_max: Array = np.inf,
    threads: Optional[int] = None,
) -> NDArray[np.bool_]:
    """True for each ray that hits a surface; the arguments are the same as for `intersect`."""
    rays = _rays(scene, backend, threads)
    shape, arrays = _arrays(origins, directions, t_min, t_max)
    return rays.occluded(*arrays).reshape(shape)


_Arrays = Tuple[NDArray[np.float32], NDArray[np.float32], float, NDArray[np.float32]]


def _arrays(origins: Array, directions: Array, t_min: float, t_max: Array) -> Tuple[Tuple[int, ...], _Arrays]:
    shape, (starts, ways) = vectors(("origins", origins), ("directions", directions))
    if not 0 <= t_min < np.inf:
        raise ValueError(f"t_min: a finite number from 0 on is expected, not {t_min}")
    ends = np.asarray(t_max, dtype=np.float32)
    if np.isnan(ends).any():
        raise ValueError("t_max: numbers are expected, not NaN")
    if ends.size == 1:
        return shape, (starts, ways, float(t_min), ends.reshape(1))
    try:
        ends = np.broadcast_to(ends, shape)
    except ValueError:
        raise ValueError(f"t_max: one number, or an array of the rays' shape {shape} is expected, not {ends.shape}") from None
    return shape, (starts, ways, float(t_min), np.ascontiguousarray(ends).reshape(-1))


def _rays(
    scene: Union[Scene, str, "os.PathLike[str]"], backend: Optional[str], threads: Optional[int]
) -> _native.Rays:
    scene = scene_of(scene)
    description = scene.description()
    own = {name: value for name, value in scene.settings.items() if name in _OF_GEOMETRY}
    given = {"backend": backend, "threads": threads}
    own.update({name: value for name, value in given.items() if value is not None})
    flags = _settings.flags({**own, **_FIXED})
    # A forked process does not have the threads of its parent, so it builds its own structures.
    known = scene._rays_of
    if known is None or known[0] is not description or known[1] != os.getpid():
        scene._rays_of, scene._rays = (description, os.getpid()), {}
    kept, key = scene._rays, tuple(flags)
    rays = kept.get(key)
    if rays is None:
        rays = _native.Rays(description, flags)
        while len(kept) >= _KEPT:
            kept.pop(next(iter(kept)), None)
        kept[key] = rays
    return rays
