"""BSDFs on arrays of directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from embrasure import _native
from embrasure._scene import Material, Scene
from embrasure._settings import Array


@dataclass(frozen=True)
class BsdfSample:
    """Directions drawn from a BSDF, in arrays."""

    #: Directions, …×3; 0 where nothing is scattered.
    wi: NDArray[np.float32]
    #: Values of the BSDF, cosine excluded, …×3, sr⁻¹.
    f: NDArray[np.float32]
    #: Densities per solid angle; probabilities where a delta lobe gave the direction.
    pdf: NDArray[np.float32]
    #: Factor of the throughput, ``f·|cos θ| / pdf``, …×3.
    weight: NDArray[np.float32]
    #: Whether a delta lobe gave the direction.
    is_delta: NDArray[np.bool_]


class Bsdf:
    """Scattering at a surface, in its local frame: +z is the normal, ``wo`` points to the viewer and ``wi`` to the light, both unit and away from the surface."""

    def __init__(self, native: _native.Bsdf) -> None:
        self._native = native

    @property
    def lobes(self) -> List[Tuple[str, str]]:
        """Name and parameters of each lobe."""
        return self._native.lobes

    @property
    def albedo(self) -> Tuple[float, float, float]:
        """Share of the light that is scattered, for uniform illumination."""
        return self._native.albedo

    @property
    def is_delta(self) -> bool:
        """Whether all its lobes are delta lobes."""
        return self._native.is_delta

    def eval(self, wo: Array, wi: Array) -> NDArray[np.float32]:
        """Values for pairs of directions, cosine excluded, …×3, sr⁻¹; delta lobes count nothing."""
        return self._eval_pdf(wo, wi)[0]

    def pdf(self, wo: Array, wi: Array) -> NDArray[np.float32]:
        """Density with which `sample` draws ``wi`` for ``wo``, per solid angle; delta lobes count nothing."""
        return self._eval_pdf(wo, wi)[1]

    def _eval_pdf(self, wo: Array, wi: Array) -> Tuple[NDArray[np.float32], NDArray[np.float32]]:
        shape, (wo, wi) = _vectors(("wo", wo), ("wi", wi))
        f, pdf = self._native.eval_pdf(wo, wi)
        return f.reshape(*shape, 3), pdf.reshape(shape)

    def sample(self, wo: Array, u: Array) -> BsdfSample:
        """Draws a direction for each ``wo`` by three numbers from [0, 1): the first chooses a lobe, the others a direction of it."""
        shape, (wo, u) = _vectors(("wo", wo), ("u", u))
        wi, f, pdf, weight, is_delta = self._native.sample(wo, u)
        three = (*shape, 3)
        return BsdfSample(
            wi.reshape(three), f.reshape(three), pdf.reshape(shape), weight.reshape(three), is_delta.reshape(shape)
        )


def bsdf(material: Union[Material, str], scene: Optional[Scene] = None) -> Bsdf:
    """The BSDF of a material; textures count by their constant factors.

    Args:
        material: a `Material`, or the name of one that faces of ``scene`` use.
        scene: needed for a name.

    Raises:
        SettingError: keys or values that a material cannot have.
    """
    if isinstance(material, str):
        if scene is None:
            raise ValueError(f"material {material}: give the scene that it is of, too")
        return Bsdf(_native.Bsdf(scene.description(), material))
    scene = Scene()
    corner = np.eye(3, dtype=np.float32)
    scene.add_mesh(corner, [[0, 1, 2]], material=Material("material", **material.keys))
    return Bsdf(_native.Bsdf(scene.description(), "material"))


def _vectors(*given: Tuple[str, Array]) -> Tuple[Tuple[int, ...], List[NDArray[np.float32]]]:
    arrays = [np.asarray(values, dtype=np.float32) for _, values in given]
    for (name, _), array in zip(given, arrays):
        if array.ndim == 0 or array.shape[-1] != 3:
            raise ValueError(f"{name}: an array …×3 is expected, not of the shape {array.shape}")
    both = np.broadcast_arrays(*arrays)
    return both[0].shape[:-1], [np.ascontiguousarray(array.reshape(-1, 3)) for array in both]
