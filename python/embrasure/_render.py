"""Renders."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from typing import Any, Callable, Optional, Tuple, Union

from embrasure import _native
from embrasure._film import Film
from embrasure._scene import Scene, scene_of

Progress = Callable[[int, int], object]

#: Warnings of a render that are told one by one.
_MOST_WARNINGS = 20


class SceneWarning(UserWarning):
    """Something is odd about a scene; the render goes on."""


def render(
    scene: Union[Scene, str, "os.PathLike[str]"],
    *,
    spp: Optional[int] = None,
    integrator: Optional[str] = None,
    sampler: Optional[str] = None,
    size: Union[Tuple[int, int], str, None] = None,
    seed: Optional[int] = None,
    threads: Optional[int] = None,
    backend: Optional[str] = None,
    max_depth: Union[int, str, None] = None,
    denoise: Union[bool, str, None] = None,
    progress: Optional[Progress] = None,
    **settings: Any,
) -> Film:
    """Renders a scene. The film has the bits that ``embrasure render`` gives with the same settings.

    The interpreter's lock is free meanwhile. Ctrl-C ends the render, and so does an exception of ``progress``.

    Args:
        scene: a `Scene`, or the name of its file.
        spp: samples per pixel.
        integrator: ``path``, ``bdpt``, ``sppm`` and so on.
        sampler: source of random numbers, such as ``sobol``.
        size: width and height in pixels.
        seed: of the random numbers.
        threads: render and build threads. Default: all.
        backend: ``embree`` or ``obvhs``, of those built in.
        max_depth: scattering events at most; ``"none"`` for no bound.
        denoise: a denoiser, or ``True`` for Open Image Denoise; the raw picture is ``film["raw"]``.
        progress: called with the samples taken and to be taken, over all pixels, up to twenty times a second.
        settings: any other flag of ``embrasure render`` by its long name, with ``_`` for ``-``: ``crop=(0, 0, 64, 64)``, ``aov="all"``,
            ``position=(0, 1, 4)``, ``noise=0.02``, ``time_limit=60``, ``env="sky"``, ``material={"Floor*": {"roughness": 0.2}}``.

    Raises:
        FileError: a file of the scene cannot be read, or is wrong.
        SettingError: settings that cannot be.
    """
    settings.update(spp=spp, integrator=integrator, sampler=sampler, size=size, seed=seed, threads=threads)
    settings.update(backend=backend, max_depth=max_depth, denoise=denoise)
    native = _begin(scene_of(scene), settings, None).next(progress)
    assert native is not None  # The first film is there, or an exception.
    film = Film(native)
    _warn(film)
    return film


def progressive(
    scene: Union[Scene, str, "os.PathLike[str]"],
    *,
    spp: Optional[int] = None,
    every: float = 0.0,
    progress: Optional[Progress] = None,
    **settings: Any,
) -> Iterator[Film]:
    """Renders a scene, and gives the film as it grows: after 1, 2, 4, … 64 samples per pixel, and from there every 64.

    The last film is that of `render` with the same settings. The render waits while a film is looked at; to leave the loop ends it.

    Args:
        scene: a `Scene`, or the name of its file.
        spp: samples per pixel.
        every: seconds of rendering at least between two films.
        progress: as in `render`.
        settings: as in `render`.
    """
    running = _begin(scene_of(scene), {**settings, "spp": spp}, every)
    return _films(running, progress)


def _films(running: _native.Render, progress: Optional[Progress]) -> Iterator[Film]:
    is_first = True
    while True:
        native = running.next(progress)
        if native is None:
            return
        film = Film(native)
        if is_first:
            _warn(film)
        is_first = False
        yield film


def _begin(scene: Scene, settings: Any, pause: Optional[float]) -> _native.Render:
    return _native.Render(scene.description(), scene.flags(settings), pause)


def _warn(film: Film) -> None:
    texts = film.warnings
    for text in texts[:_MOST_WARNINGS]:
        warnings.warn(text, SceneWarning, stacklevel=3)
    if len(texts) > _MOST_WARNINGS:
        more = f"{len(texts) - _MOST_WARNINGS} more warnings: film.warnings has them"
        warnings.warn(more, SceneWarning, stacklevel=3)
