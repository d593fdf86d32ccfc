"""Films: results of renders."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from embrasure import _native

#: Order of a layer's components in arrays. Layers with other components keep the film's order.
_ORDER = "RGBAXYZUV"


class Film:
    """A picture with all its channels, as float32 arrays.

    ``film["rgb"]`` is the linear picture, H×W×3. ``film["albedo"]``, ``film["N"]`` and other layers
    have their components last. ``film["Z"]`` and other single channels are H×W, and so is each
    channel with its full name, such as ``film["albedo.R"]``. Row 0 is the top. Arrays are copies.
    """

    def __init__(self, native: _native.Film) -> None:
        self._native = native

    @property
    def channels(self) -> List[str]:
        """Names of the channels, as in EXR files."""
        return self._native.channels

    @property
    def layers(self) -> List[str]:
        """Names of arrays: ``rgb`` if the film has colours, layers, and channels without a layer."""
        return list(self._layers())

    def _layers(self) -> Dict[str, List[str]]:
        channels = self.channels
        colors = ["R", "G", "B"]
        layers: Dict[str, List[str]] = {"rgb": colors} if set(colors) <= set(channels) else {}
        for name in channels:
            layer, dot, _ = name.rpartition(".")
            if name not in layers.get("rgb", []):
                layers.setdefault(layer if dot else name, []).append(name)
        for names in layers.values():
            if all(name.rpartition(".")[2] in _ORDER for name in names):
                names.sort(key=lambda name: _ORDER.index(name.rpartition(".")[2]))
        return layers

    def __contains__(self, name: object) -> bool:
        return name in self.channels or name in self._layers()

    def __iter__(self) -> Iterator[str]:
        """Names of the layers."""
        return iter(self._layers())

    def __getitem__(self, name: str) -> NDArray[np.float32]:
        layers = self._layers()
        if name in self.channels and layers.get(name, [name]) == [name]:
            return self._native.plane(name)
        if name not in layers:
            raise KeyError(f"no channel {name}: there are {', '.join(dict.fromkeys([*layers, *self.channels]))}")
        return self._native.planes(layers[name])

    @property
    def variance(self) -> NDArray[np.float32]:
        """Estimated variance of each pixel's mean, H×W×3."""
        return self["variance"]

    @property
    def samples(self) -> NDArray[np.float32]:
        """Number of samples of each pixel, H×W."""
        return self["samples"]

    @property
    def size(self) -> Tuple[int, int]:
        """Width and height of the full image."""
        return self._native.size

    @property
    def crop(self) -> Tuple[int, int, int, int]:
        """Pixels of the arrays, half-open: x0, y0, x1, y1."""
        return self._native.crop

    @property
    def seconds(self) -> float:
        """Seconds of rendering."""
        return self._native.seconds

    @property
    def complete(self) -> bool:
        """True if all samples were taken."""
        return self._native.complete

    @property
    def settings(self) -> str:
        """Settings that determine the pixels in addition to the scene: ``key=value`` pairs, as in EXR files."""
        return self._native.settings

    @property
    def warnings(self) -> List[str]:
        """Warnings about the scene and the settings."""
        return self._native.warnings

    def develop(
        self,
        tone: Optional[str] = None,
        exposure: Union[float, str, None] = None,
        denoise: Union[bool, str, None] = None,
    ) -> NDArray[np.uint8]:
        """8-bit pixels for an sRGB display, H×W×3; over a transparent background H×W×4.

        Args:
            tone: tone curve: ``srgb``, ``reinhard``, ``aces-narkowicz``, ``aces-hill`` or ``agx``.
                Default: the tone curve of the render.
            exposure: stops, or ``"auto"``. Default: the exposure of the render.
            denoise: a denoiser: ``oidn``, ``oidn-fast``, ``atrous`` or ``gaussian``; ``True`` uses
                the best denoiser built in.

        Raises:
            SettingError: an invalid tone curve, exposure or denoiser.
        """
        name = "" if denoise is True else denoise or None
        return self._native.develop(tone, _text(exposure), name)

    def save(
        self,
        path: Union[str, "os.PathLike[str]"],
        tone: Optional[str] = None,
        exposure: Union[float, str, None] = None,
    ) -> None:
        """Writes an ``.exr`` file with all channels, or a ``.png`` file, like ``embrasure render -o``.

        ``tone`` and ``exposure`` are for PNG files.

        Raises:
            FileError: the file cannot be written, or has another extension.
            SettingError: an invalid tone curve or exposure.
        """
        self._native.save(os.fspath(path), tone, _text(exposure))

    def _repr_png_(self) -> bytes:
        return self._native.png()

    def __repr__(self) -> str:
        x0, y0, x1, y1 = self.crop
        return f"<Film {x1 - x0}×{y1 - y0}, {', '.join(self.layers)}>"


def _text(exposure: Any) -> Optional[str]:
    return None if exposure is None else str(exposure)


def read(path: Union[str, "os.PathLike[str]"]) -> Film:
    """Reads all channels of an EXR file, or the colours of another picture file.

    Other formats are PNG, JPEG, TGA, BMP and Radiance. Their colours are decoded to linear light.

    Raises:
        FileError: the file cannot be read.
    """
    return Film(_native.read(os.fspath(path)))
