"""Points of the samplers."""

from __future__ import annotations

from operator import index
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from embrasure import _native


class Sampler:
    """A source of the random numbers of a render."""

    def __init__(self, name: str, seed: int = 0) -> None:
        self.name = name
        self.seed = _whole("seed", seed, 64)
        self.points(1, 1)

    def points(self, n: int, dims: int = 2, pixel: Tuple[int, int] = (0, 0)) -> NDArray[np.float32]:
        """Numbers of the samples 0 to n − 1 of a pixel, n×dims, in [0, 1).

        Columns are the decisions of a path, with two numbers each, in their order: position in the
        pixel, position on the lens, then for each vertex the choice of a light, the point on it,
        and the scattered direction. Each pair is well distributed in two dimensions.

        Raises:
            ValueError: a negative number.
            MemoryError: the numbers do not fit into memory.
        """
        n, dims = _whole("n", n, 32), _whole("dims", dims, 32)
        x, y = (_whole("pixel", place, 32) for place in pixel)
        return _native.points(self.name, n, dims, self.seed, (x, y))

    def __repr__(self) -> str:
        return f"Sampler({self.name!r}, seed={self.seed})"


def _whole(what: str, value: int, bits: int) -> int:
    number = index(value)
    if not 0 <= number < 1 << bits:
        raise ValueError(f"{what}: a whole number from 0 to {(1 << bits) - 1} is expected, not {number}")
    return number


def sampler(name: str, seed: int = 0) -> Sampler:
    """A sampler: ``zsobol``, ``sobol``, ``independent``, ``stratified``, ``cmj``, ``halton``, ``hammersley``, ``orthogonal`` or ``antithetic``.

    Raises:
        SettingError: an unknown sampler.
    """
    return Sampler(name, seed)
