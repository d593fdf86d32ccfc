"""BSDFs on arrays of directions."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import List, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from embrasure import _native
from embrasure._scene import Material, Scene, scene_of
from embrasure._settings import Array
from embrasure._vectors import check_unit, vectors

#: The largest number below 1.
_ALMOST_ONE = np.nextafter(np.float32(1), np.float32(0))


@dataclass(frozen=True, eq=False)
class BsdfSample:
    """Directions sampled from a BSDF, in arrays."""

    #: Directions, …×3; 0 if nothing is scattered.
    wi: NDArray[np.float32]
    #: Values of the BSDF without the cosine, …×3, sr⁻¹.
    f: NDArray[np.float32]
    #: Densities per solid angle; probabilities for delta lobes.
    pdf: NDArray[np.float32]
    #: Factor of the throughput, ``f·|cos θ| / pdf``, …×3.
    weight: NDArray[np.float32]
    #: True if a delta lobe was sampled.
    is_delta: NDArray[np.bool_]


class Bsdf:
    """Scattering at a surface, in its local frame.

    +z is the normal, ``wo`` points to the viewer and ``wi`` to the light. Both are unit vectors
    that point away from the surface.

    Arrays of directions are …×3. A single direction is used for all directions of another array. A
    direction of length 0, which `sample` returns if nothing is scattered, has the value and the
    density 0. Other vectors that are not unit vectors are a `ValueError`.
    """

    def __init__(self, native: _native.Bsdf) -> None:
        self._native = native

    @property
    def lobes(self) -> List[Tuple[str, str]]:
        """Name and parameters of each lobe."""
        return self._native.lobes

    @property
    def albedo(self) -> Tuple[float, float, float]:
        """Fraction of light that is scattered under uniform illumination."""
        return self._native.albedo

    @property
    def is_delta(self) -> bool:
        """True if all lobes are delta lobes."""
        return self._native.is_delta

    def eval(self, wo: Array, wi: Array) -> NDArray[np.float32]:
        """Values for pairs of directions without the cosine, …×3, sr⁻¹; 0 for delta lobes."""
        return self._eval_pdf(wo, wi)[0]

    def pdf(self, wo: Array, wi: Array) -> NDArray[np.float32]:
        """Density of `sample` for ``wi`` given ``wo``, per solid angle; 0 for delta lobes."""
        return self._eval_pdf(wo, wi)[1]

    def _eval_pdf(self, wo: Array, wi: Array) -> Tuple[NDArray[np.float32], NDArray[np.float32]]:
        shape, (outgoing, incoming) = vectors(("wo", wo), ("wi", wi))
        check_unit("wo", outgoing)
        check_unit("wi", incoming)
        is_empty = ~(outgoing.any(axis=1) & incoming.any(axis=1))
        f, pdf = self._native.eval_pdf(_filled(outgoing), _filled(incoming))
        f[is_empty], pdf[is_empty] = 0, 0
        return f.reshape(*shape, 3), pdf.reshape(shape)

    def sample(self, wo: Array, u: Array) -> BsdfSample:
        """Samples a direction for each ``wo`` with three numbers in [0, 1).

        The first number selects a lobe, the others its direction.

        Raises:
            ValueError: numbers outside [0, 1).
        """
        numbers = np.asarray(u)
        if numbers.size and not ((numbers >= 0) & (numbers < 1)).all():
            raise ValueError(f"u: numbers from [0, 1) are expected, not from [{numbers.min()}, {numbers.max()}]")
        shape, (outgoing, rows) = vectors(("wo", wo), ("u", numbers))
        check_unit("wo", outgoing)
        # float32 rounds the largest numbers of float64 up to 1.
        wi, f, pdf, weight, is_delta = self._native.sample(_filled(outgoing), np.minimum(rows, _ALMOST_ONE))
        is_empty = ~outgoing.any(axis=1)
        wi[is_empty], f[is_empty], pdf[is_empty], weight[is_empty], is_delta[is_empty] = 0, 0, 0, 0, False
        three = (*shape, 3)
        return BsdfSample(
            wi.reshape(three), f.reshape(three), pdf.reshape(shape), weight.reshape(three), is_delta.reshape(shape)
        )


def _filled(directions: NDArray[np.float32]) -> NDArray[np.float32]:
    """Directions with the normal in place of each 0, because lobes need unit vectors."""
    is_empty = ~directions.any(axis=1)
    if not is_empty.any():
        return directions
    filled = directions.copy()
    filled[is_empty] = (0, 0, 1)
    return filled


def bsdf(material: Union[Material, str], scene: Union[Scene, str, "os.PathLike[str]", None] = None) -> Bsdf:
    """The BSDF of a material. Textures are replaced by their constant factors.

    Args:
        material: a `Material`, or the name of a material that faces of ``scene`` use.
        scene: a `Scene`, or the name of its file; needed for a material name.

    Raises:
        SettingError: invalid keys or values of a material.
    """
    if isinstance(material, str):
        if scene is None:
            raise ValueError(f"material {material}: also give the scene that has this material")
        scene = scene_of(scene)
        return Bsdf(_native.Bsdf(scene.description(), scene.flags({}), material))
    made = Scene()
    made.add_mesh(np.eye(3), [[0, 1, 2]], material=material)
    return Bsdf(_native.Bsdf(made.description(), [], made.name_of(material)))
