from typing import Callable, List, Optional, Tuple, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Bsdf",
    "Description",
    "Error",
    "FileError",
    "Film",
    "Mesh",
    "Rays",
    "Render",
    "SettingError",
    "__version__",
    "compare",
    "points",
    "read",
    "version_text",
]
__version__: str

class Error(Exception): ...
class SettingError(Error): ...

class FileError(Error):
    file: str
    line: Optional[int]
    column: Optional[int]
    help: Optional[str]

@final
class Mesh:
    def __new__(
        cls,
        vertices: NDArray[np.float32],
        faces: NDArray[np.uint32],
        normals: Optional[NDArray[np.float32]] = None,
        uv: Optional[NDArray[np.float32]] = None,
    ) -> Mesh: ...

@final
class Description:
    @staticmethod
    def load(path: str, keys: List[str]) -> Description: ...
    @staticmethod
    def in_code() -> Description: ...
    def with_parts(self, keys: List[str], meshes: List[Tuple[str, Mesh, Optional[str]]]) -> Description: ...
    def check(self, flags: List[str]) -> None: ...
    @property
    def light_count(self) -> int: ...

@final
class Film:
    @staticmethod
    def of_colors(colors: NDArray[np.float32], width: int) -> Film: ...
    @property
    def channels(self) -> List[str]: ...
    @property
    def size(self) -> Tuple[int, int]: ...
    @property
    def crop(self) -> Tuple[int, int, int, int]: ...
    @property
    def seconds(self) -> float: ...
    @property
    def complete(self) -> bool: ...
    @property
    def settings(self) -> str: ...
    @property
    def warnings(self) -> List[str]: ...
    def plane(self, name: str) -> NDArray[np.float32]: ...
    def planes(self, names: List[str]) -> NDArray[np.float32]: ...
    def develop(
        self, tone: Optional[str] = None, exposure: Optional[str] = None, denoise: Optional[str] = None
    ) -> NDArray[np.uint8]: ...
    def png(self, tone: Optional[str] = None, exposure: Optional[str] = None) -> bytes: ...
    def save(self, path: str, tone: Optional[str] = None, exposure: Optional[str] = None) -> None: ...

@final
class Render:
    def __new__(cls, scene: Description, flags: List[str], pause: Optional[float] = None) -> Render: ...
    def next(self, progress: Optional[Callable[[int, int], object]] = None) -> Optional[Film]: ...

@final
class Rays:
    def __new__(cls, scene: Description, flags: List[str]) -> Rays: ...
    @property
    def counts(self) -> Tuple[int, int, int]: ...
    @property
    def bounds(self) -> Tuple[List[float], List[float]]: ...
    @property
    def objects(self) -> List[str]: ...
    def intersect(
        self,
        origins: NDArray[np.float32],
        directions: NDArray[np.float32],
        t_min: float,
        t_max: NDArray[np.float32],
    ) -> Tuple[
        NDArray[np.float32],
        NDArray[np.int32],
        NDArray[np.int32],
        NDArray[np.int32],
        NDArray[np.float32],
        NDArray[np.float32],
    ]: ...
    def occluded(
        self,
        origins: NDArray[np.float32],
        directions: NDArray[np.float32],
        t_min: float,
        t_max: NDArray[np.float32],
    ) -> NDArray[np.bool_]: ...

@final
class Bsdf:
    def __new__(cls, scene: Description, flags: List[str], name: str) -> Bsdf: ...
    @property
    def lobes(self) -> List[Tuple[str, str]]: ...
    @property
    def albedo(self) -> Tuple[float, float, float]: ...
    @property
    def is_delta(self) -> bool: ...
    def eval_pdf(
        self, wo: NDArray[np.float32], wi: NDArray[np.float32]
    ) -> Tuple[NDArray[np.float32], NDArray[np.float32]]: ...
    def sample(
        self, wo: NDArray[np.float32], u: NDArray[np.float32]
    ) -> Tuple[
        NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]
    ]: ...

def read(path: str) -> Film: ...
def compare(reference: Film, image: Film, significance: float) -> str: ...
def points(name: str, count: int, dims: int, seed: int, pixel: Tuple[int, int]) -> NDArray[np.float32]: ...
def version_text() -> str: ...
