"""Arrays of vectors, as rows of float32."""

from __future__ import annotations

from typing import List, Tuple

import numpy as np
from numpy.typing import NDArray

from embrasure._settings import Array

#: Maximum difference of a unit vector's squared length from 1. It accepts half-precision directions.
_UNIT = 4e-3


def vectors(*given: Tuple[str, Array]) -> Tuple[Tuple[int, ...], List[NDArray[np.float32]]]:
    """Broadcasts arrays …×3 to one shape. Each array has a name for errors.

    Returns:
        The shape without the 3, and the rows of each array.

    Raises:
        ValueError: an array without three columns, or incompatible shapes.
    """
    arrays = [np.asarray(values, dtype=np.float32) for _, values in given]
    for (name, _), array in zip(given, arrays):
        if array.ndim == 0 or array.shape[-1] != 3:
            raise ValueError(f"{name}: an array …×3 is expected, not of the shape {array.shape}")
    try:
        same = np.broadcast_arrays(*arrays)
    except ValueError:
        names = " and ".join(name for name, _ in given)
        shapes = " and ".join(str(array.shape) for array in arrays)
        raise ValueError(f"{names}: arrays of the same shape are expected, not of {shapes}") from None
    return same[0].shape[:-1], [np.ascontiguousarray(array.reshape(-1, 3)) for array in same]


def check_unit(name: str, directions: NDArray[np.float32]) -> None:
    """Checks that all rows are unit vectors or 0. Samples are 0 if nothing is scattered.

    Raises:
        ValueError: another row.
    """
    squared = np.einsum("ij,ij->i", directions, directions)
    wrong = np.flatnonzero(~(np.abs(squared - 1) < _UNIT) & directions.any(axis=1))
    if len(wrong):
        row = directions[wrong[0]].tolist()
        raise ValueError(f"{name}: unit vectors are expected, not {row} (row {wrong[0]}): divide by the length")
