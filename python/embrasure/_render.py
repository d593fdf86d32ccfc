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

#: Maximum number of warnings of a render that are issued one by one.
_MOST_WARNINGS = 20


class SceneWarning(UserWarning):
    """Warning about a scene; the render continues."""


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
    """Renders a scene. The film is bit-identical to ``embrasure render`` with the same settings.

    The interpreter's lock is released during the render. Ctrl-C or an exception of ``progress``
    ends the render.

    Args:
        scene: a `Scene`, or the name of its file.
        spp: samples per pixel.
        integrator: an integrator, such as ``path``, ``bdpt`` or ``sppm``.
        sampler: source of random numbers, such as ``sobol``.
        size: width and height in pixels.
        seed: seed of the random numbers.
        threads: number of render and build threads. Default: all.
        backend: ``embree`` or ``obvhs``, if built in.
        max_depth: maximum number of scattering events; ``"none"`` for no limit.
        denoise: a denoiser, or ``True`` for Open Image Denoise; the raw picture is ``film["raw"]``.
        progress: called with the samples taken and the samples to take, over all pixels, up to
            twenty times a second.
        settings: any other flag of ``embrasure render`` with its long name, and ``_`` for ``-``:
            ``crop=(0, 0, 64, 64)``, ``aov="all"``, ``position=(0, 1, 4)``, ``noise=0.02``,
            ``time_limit=60``, ``env="sky"``, ``material={"Floor*": {"roughness": 0.2}}``.

    Raises:
        FileError: a file of the scene cannot be read, or is invalid.
        SettingError: invalid settings.
    """
    settings.update(spp=spp, integrator=integrator, sampler=sampler, size=size, seed=seed, threads=threads)
    settings.update(backend=backend, max_depth=max_depth, denoise=denoise)
    native = _begin(scene_of(scene), settings, None).next(progress)
    assert native is not None  # There is a first film, or an exception.
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
    """Renders a scene, and yields a film after 1, 2, 4, … 64 samples per pixel, then every 64 samples.

    The last film equals the film of `render` with the same settings. The render waits while the
    caller uses a film. Leaving the loop ends the render.

    Args:
        scene: a `Scene`, or the name of its file.
        spp: samples per pixel.
        every: minimum render time in seconds between two films.
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
