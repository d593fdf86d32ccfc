"""Embrasure, a path tracer over Intel Embree: scenes, renders and ray queries on numpy arrays.

>>> import embrasure as em
>>> scene = em.load("scenes/cornell-box.toml")
>>> film = em.render(scene, spp=16)
>>> film["rgb"].shape
(512, 512, 3)

Settings have the names of the command line's flags, with ``_`` for ``-``. Equal settings give
images that are bit-identical to ``embrasure render``. The package also installs the command line:
``embrasure`` and ``python -m embrasure``.
"""

from __future__ import annotations

from embrasure._bsdf import Bsdf, BsdfSample, bsdf
from embrasure._compare import Comparison, compare
from embrasure._film import Film, read
from embrasure._fork import register as _register_forks
from embrasure._native import Error, FileError, SettingError, __version__, version_text
from embrasure._program import program
from embrasure._rays import Hits, intersect, occluded
from embrasure._render import SceneWarning, progressive, render
from embrasure._sampler import Sampler, sampler
from embrasure._scene import Camera, Light, Material, Scene, load

__all__ = [
    "Bsdf",
    "BsdfSample",
    "Camera",
    "Comparison",
    "Error",
    "FileError",
    "Film",
    "Hits",
    "Light",
    "Material",
    "Sampler",
    "Scene",
    "SceneWarning",
    "SettingError",
    "__version__",
    "bsdf",
    "compare",
    "intersect",
    "load",
    "occluded",
    "program",
    "progressive",
    "read",
    "render",
    "sampler",
    "version_text",
]

_register_forks()
