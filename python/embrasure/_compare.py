"""Comparisons of pictures."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional, Union

import numpy as np

from embrasure import _native
from embrasure._film import Film, read
from embrasure._settings import Array


@dataclass(frozen=True)
class Comparison:
    """Difference between a picture and a reference, and a test if it exceeds noise."""

    #: ``identical``, ``equal within noise``, ``equal within tolerance`` (pictures of 8 or 16 bits),
    #: ``differs``, or ``not tested`` if too little is known of the noise.
    outcome: str
    #: Mean of the picture by channel.
    mean: List[float]
    #: Mean of the reference by channel.
    reference_mean: List[float]
    #: Difference of the means.
    bias: List[float]
    #: Mean squared difference.
    mse: float
    #: Mean squared relative difference, without the worst 0.1 % of the pixels.
    rel_mse: float
    #: Peak signal-to-noise ratio in decibels of the display values; ``None`` if infinite.
    psnr: Optional[float]
    #: Mean FLIP.
    flip: float
    #: Probability that noise alone causes such a difference; ``None`` without a test.
    p: Optional[float]
    #: Complete output of ``embrasure compare --json``.
    facts: Dict[str, Any] = field(repr=False)


def compare(
    a: Union[Film, str, "os.PathLike[str]", Array],
    b: Union[Film, str, "os.PathLike[str]", Array],
    significance: float = 0.01,
) -> Comparison:
    """Compares ``b`` with the reference ``a`` like ``embrasure compare``.

    Args:
        a: the reference: a film, a file, or an array H×W×3 of linear colours.
        b: the picture to compare with the reference.
        significance: probability of a false alarm over all tests.

    Raises:
        Error: pictures of different sizes.
        FileError: a file cannot be read.
        ValueError: arrays of other shapes, 8-bit pixels, or a ``significance`` outside (0, 1).
    """
    if not 0 < significance < 1:
        raise ValueError(f"significance: a number between 0 and 1 is expected, not {significance}")
    facts = json.loads(_native.compare(_film(a), _film(b), significance))
    test = facts["significance_test"]
    return Comparison(
        outcome=facts["outcome"],
        mean=facts["mean"],
        reference_mean=facts["reference_mean"],
        bias=facts["bias"],
        mse=facts["mse"],
        rel_mse=facts["rel_mse"],
        psnr=facts["psnr_db"],
        flip=facts["flip"]["mean"],
        p=test["p"] if test and test["tests"] else None,
        facts=facts,
    )


def _film(picture: Any) -> _native.Film:
    if isinstance(picture, Film):
        return picture._native
    if isinstance(picture, (str, os.PathLike)):
        return read(picture)._native
    if getattr(picture, "dtype", None) == np.uint8:
        raise ValueError("linear colours are expected, not 8-bit pixels: compare film[\"rgb\"], or files")
    array = np.asarray(picture, dtype=np.float32)
    if array.ndim != 3 or array.shape[2] != 3 or array.size == 0:
        raise ValueError(f"an array H×W×3 is expected, not of the shape {array.shape}")
    return _native.Film.of_colors(np.ascontiguousarray(array).reshape(-1, 3), array.shape[1])
