"""Scenes from files, from arrays, or from both."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from embrasure import _native, _settings
from embrasure._settings import Array


class Material:
    """A material with the keys of a section ``[material.NAME]`` of a scene file.

    >>> Material(diffuse=[0.8, 0.2, 0.1], model="ggx", specular=0.5, roughness=0.3).keys["roughness"]
    0.3
    """

    def __init__(self, name: Optional[str] = None, **keys: Any) -> None:
        self.name = name
        self.keys: Dict[str, Any] = dict(keys)

    def __repr__(self) -> str:
        return _repr("Material", self.name, self.keys)


class Light:
    """A light with the keys of a section ``[[light]]`` of a scene file.

    Example: ``Light("point", position=[0, 1, 0], intensity=5)``.
    """

    def __init__(self, type: str, **keys: Any) -> None:  # noqa: A002  the key of scene files
        self.type = type
        self.keys: Dict[str, Any] = dict(keys)

    def __repr__(self) -> str:
        return _repr("Light", self.type, self.keys)


class Camera:
    """A camera with the keys of the section ``[camera]`` of a scene file.

    Examples: ``position``, ``look_at``, ``up`` and ``vertical_fov``.
    """

    def __init__(self, **keys: Any) -> None:
        self.keys: Dict[str, Any] = dict(keys)

    def __repr__(self) -> str:
        return _repr("Camera", None, self.keys)


def _repr(kind: str, first: Optional[str], keys: Mapping[str, Any]) -> str:
    words = [repr(first)] if first is not None else []
    return f"{kind}({', '.join(words + [f'{key}={value!r}' for key, value in keys.items()])})"


class Scene:
    """A scene to render.

    ``Scene()`` is empty: add meshes and lights, and set the camera. `load` reads a scene from a
    file, to which meshes and lights can be added too.

    Args:
        keys: keys of a scene file and their values, such as ``{"render.max_depth": 4}`` or
            ``{"image": {"filter": "tent"}}``.
        settings: settings of all renders of this scene, as in `render`.

    Attributes:
        path: the file of the scene, if any.
        camera: a `Camera`, or a dictionary of its keys, which override the camera of the file.
            Missing values are guessed.
        lights: lights in addition to the lights of the file.
        keys: keys that override keys of the file.
        settings: settings of all renders. Arguments of `render` override them.
    """

    def __init__(self, keys: Optional[Mapping[str, Any]] = None, **settings: Any) -> None:
        self._begin(None, _native.Description.in_code(), keys, settings)

    def _begin(
        self,
        path: Optional[str],
        base: _native.Description,
        keys: Optional[Mapping[str, Any]],
        settings: Mapping[str, Any],
    ) -> None:
        self.path = path
        self.camera: Union[Camera, Mapping[str, Any], None] = None
        self.lights: List[Light] = []
        self.keys: Dict[str, Any] = dict(keys or {})
        self.settings: Dict[str, Any] = dict(settings)
        self._base = base
        self._meshes: List[Tuple[str, _native.Mesh, Optional[str]]] = []
        self._materials: Dict[str, Material] = {}
        # Names that this scene gave to materials without a name. The key is the id of the Python
        # object.
        self._given_names: Dict[int, str] = {}
        self._described: Optional[Tuple[List[str], int, _native.Description]] = None
        self._rays: Dict[Tuple[str, ...], _native.Rays] = {}
        self._rays_of: Optional[Tuple[_native.Description, int]] = None
        self.description().check(_settings.flags(self.settings))

    def __repr__(self) -> str:
        source = repr(self.path) if self.path else "in code"
        return f"<Scene {source}, {len(self._meshes)} meshes from arrays>"

    def add_mesh(
        self,
        vertices: Any,
        faces: Optional[Array] = None,
        normals: Optional[Array] = None,
        uv: Optional[Array] = None,
        material: Union[Material, str, None] = None,
        name: Optional[str] = None,
    ) -> int:
        """Adds triangles.

        Args:
            vertices: positions, N×3; or a mesh of trimesh or meshio, which includes faces.
            faces: indices of the corners, counter-clockwise seen from the front: M×3, or M×4 for
                quadrilaterals. Quadrilateral i becomes the triangles 2i and 2i + 1.
            normals: shading normals of the vertices, N×3, of any length; without them the mesh is
                flat.
            uv: texture coordinates of the vertices, N×2, v upwards.
            material: a `Material`, or the name of a material in the scene's files. Default: diffuse
                grey.
            name: name of the object.

        Returns:
            Index of the mesh among the meshes from arrays, from 0.

        Raises:
            ValueError: invalid arrays. Coordinates that are not finite are a `FileError` of the
                render.
            TypeError: ``material`` is neither a `Material` nor a name.
        """
        if faces is None:
            vertices, faces, own_uv = _arrays_of(vertices)
            uv = own_uv if uv is None else uv
        positions = _rows("vertices", vertices, 3)
        mesh = _native.Mesh(
            positions,
            _triangles(faces, len(positions)),
            None if normals is None else _rows("normals", normals, 3, len(positions)),
            None if uv is None else _rows("uv", uv, 2, len(positions)),
        )
        index = len(self._meshes)
        self._meshes.append((name or f"mesh-{index}", mesh, None if material is None else self.name_of(material)))
        return index

    def add_light(self, type: str, **keys: Any) -> Light:  # noqa: A002
        """Adds a light with the keys of a section ``[[light]]``, and returns it."""
        light = Light(type, **keys)
        self.lights.append(light)
        return light

    def name_of(self, material: Union[Material, str]) -> str:
        """Name of a material in this scene.

        A `Material` is added to the scene, and gets a free name if it has none.

        Raises:
            TypeError: neither a `Material` nor a name.
            ValueError: another material of this scene has the name.
        """
        if isinstance(material, str):
            return material
        if not isinstance(material, Material):
            raise TypeError(f"material: a Material or the name of one is expected, not {material!r}: write Material(diffuse=…)")
        name = self._given_names.get(id(material)) if material.name is None else material.name
        if name is None:
            number = len(self._materials)
            while f"material-{number}" in self._materials:
                number += 1
            name = self._given_names[id(material)] = f"material-{number}"
        known = self._materials.setdefault(name, material)
        if known is not material and known.keys != material.keys:
            raise ValueError(f"material {name}: another material of this scene has this name")
        return name

    def description(self) -> _native.Description:
        """Scene of the extension module: file, keys and meshes together.

        The description is made again if a key or the number of meshes has changed.

        Raises:
            SettingError: an invalid key or value of a scene file.
        """
        keys = _settings.keys(self.keys)
        camera = self.camera.keys if isinstance(self.camera, Camera) else self.camera
        if camera is not None:
            keys += _settings.keys({"camera": camera})
        for index, light in enumerate(self.lights, self._base.light_count):
            keys += _settings.keys({f"light.{index}": {"type": light.type, **light.keys}})
        for name, material in self._materials.items():
            keys += _settings.keys({f"material.{_settings.toml_key(name)}": material.keys})
        known = self._described
        if known is None or known[0] != keys or known[1] != len(self._meshes):
            known = (keys, len(self._meshes), self._base.with_parts(keys, self._meshes))
            self._described = known
        return known[2]

    def flags(self, settings: Mapping[str, Any]) -> List[str]:
        """The scene's settings overridden by ``settings``, as flags of ``embrasure render``."""
        given = {name: value for name, value in settings.items() if value is not None}
        return _settings.flags({**self.settings, **given})


def load(
    path: Union[str, "os.PathLike[str]"], keys: Optional[Mapping[str, Any]] = None, **settings: Any
) -> Scene:
    """Reads a ``.toml`` scene file, or an ``.obj`` file with its materials.

    Meshes and textures are read when the scene is rendered. A bare OBJ file gets the same guesses
    as in ``embrasure render`` for camera, light, exposure and quality.

    Args:
        path: the file.
        keys: keys that override keys of the scene file, such as
            ``{"render.max_depth": 4, "camera": {"vertical_fov": 30}}``.
        settings: settings of all renders of this scene, as in `render`.

    Raises:
        FileError: the file cannot be read, or is invalid.
        SettingError: an invalid key, value or setting.
    """
    name = os.fspath(path)
    scene = Scene.__new__(Scene)
    scene._begin(name, _native.Description.load(name, []), keys, settings)
    return scene


def scene_of(scene: Union[Scene, str, "os.PathLike[str]"]) -> Scene:
    """The scene itself, or the scene of a file name."""
    return scene if isinstance(scene, Scene) else load(scene)


def _rows(what: str, values: Array, columns: int, count: Optional[int] = None) -> NDArray[np.float32]:
    array = np.asarray(values, dtype=np.float32)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{what}: an array N×{columns} is expected, not {'×'.join(map(str, array.shape)) or 'a number'}")
    if count is not None and len(array) != count:
        raise ValueError(f"{what}: {count} rows are expected, one for each vertex, not {len(array)}")
    return np.ascontiguousarray(array)


def _triangles(faces: Array, vertices: int) -> NDArray[np.uint32]:
    array = np.asarray(faces)
    if array.ndim != 2 or array.shape[1] not in (3, 4) or (array.size and array.dtype.kind not in "iu"):
        found = f"{'×'.join(map(str, array.shape)) or 'a number'} of {array.dtype}"
        raise ValueError(f"faces: whole numbers M×3 or M×4 are expected, not {found}")
    wrong = np.flatnonzero(((array < 0) | (array >= vertices)).any(axis=1))
    if len(wrong):
        raise ValueError(f"faces: face {wrong[0]} has the corners {array[wrong[0]].tolist()}, but there are {vertices} vertices")
    if array.shape[1] == 4:
        array = array[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return np.ascontiguousarray(array, dtype=np.uint32)


def _arrays_of(mesh: Any) -> Tuple[Array, Array, Optional[Array]]:
    """Vertices, faces and texture coordinates of a mesh of another package.

    Supported are trimesh (``vertices``, ``faces``) and meshio (``points``, ``cells``).
    """
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        uv = getattr(getattr(mesh, "visual", None), "uv", None)
        is_of_vertices = uv is not None and len(uv) == len(mesh.vertices)
        return mesh.vertices, mesh.faces, uv if is_of_vertices else None
    if hasattr(mesh, "points") and hasattr(mesh, "cells"):
        blocks = [np.asarray(block.data) for block in mesh.cells if block.type in ("triangle", "quad")]
        cut = [_triangles(block, len(mesh.points)) for block in blocks]
        if not cut:
            raise ValueError("the mesh has neither triangles nor quadrilaterals")
        points = np.asarray(mesh.points, dtype=np.float32)
        if points.ndim == 2 and points.shape[1] == 2:
            points = np.pad(points, ((0, 0), (0, 1)))
        return points, np.concatenate(cut), None
    if hasattr(mesh, "geometry") and hasattr(mesh, "to_mesh"):
        raise ValueError("faces: a trimesh scene has several meshes; add scene.to_mesh(), or each mesh of scene.dump()")
    raise ValueError("faces: give them, or a mesh that has vertices and faces, or points and cells")
