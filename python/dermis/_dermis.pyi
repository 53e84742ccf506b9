"""Types of the native module; `dermis` hands everything on."""

from collections.abc import Iterable, Iterator, Sequence
from os import PathLike
from typing import Any, Literal, TypedDict, final, overload, type_check_only

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Answers",
    "Board",
    "BoardError",
    "Contact",
    "Errors",
    "Frame",
    "InputError",
    "Reconstruction",
    "Reconstructions",
    "Scene",
    "Stage",
    "errors",
]

_Engine = Literal["golden", "fixed"]

class InputError(ValueError): ...
class BoardError(OSError): ...

@type_check_only
class _ContactDescription(TypedDict, total=False):
    shape: str
    centre_mm: ArrayLike
    size_mm: ArrayLike
    normal_N: float
    tangential_N: ArrayLike
    kind_of_slip: str
    friction: float
    rotation_rad: float

@final
class Errors:
    @property
    def x1(self) -> float | None: ...
    @property
    def x2(self) -> float | None: ...
    @property
    def x3(self) -> float | None: ...
    @property
    def tangential(self) -> float | None: ...
    @property
    def normal(self) -> float | None: ...

@final
class Frame:
    @staticmethod
    def load(path: str | PathLike[str]) -> Frame: ...
    @property
    def id(self) -> str: ...
    @property
    def stress_MPa(self) -> NDArray[np.float64]: ...
    @property
    def resultant_N(self) -> NDArray[np.float64] | None: ...
    @property
    def cell_forces_N(self) -> NDArray[np.float64] | None: ...
    def to_json(self) -> str: ...

@final
class Contact:
    @property
    def centre_mm(self) -> NDArray[np.float64] | None: ...
    @property
    def mu(self) -> NDArray[np.float64]: ...
    @property
    def mu_sigma(self) -> NDArray[np.float64] | None: ...
    @property
    def force_N(self) -> NDArray[np.float64]: ...
    @property
    def sigma_N(self) -> NDArray[np.float64] | None: ...
    @property
    def shear_sigma_N(self) -> NDArray[np.float64] | None: ...
    @property
    def mu_covariance(self) -> NDArray[np.float64] | None: ...
    @property
    def taxels(self) -> int | None: ...

@final
class Reconstruction:
    @property
    def scene(self) -> str: ...
    @property
    def frame(self) -> str: ...
    @property
    def engine(self) -> str: ...
    @property
    def forces_N(self) -> NDArray[np.float64] | None: ...
    @property
    def resultant_N(self) -> NDArray[np.float64]: ...
    @property
    def moment_Nmm(self) -> NDArray[np.float64] | None: ...
    @property
    def contacts(self) -> list[Contact] | None: ...
    @property
    def error(self) -> Errors | None: ...
    @property
    def flags(self) -> list[str]: ...
    @property
    def checks(self) -> dict[str, float]: ...
    def to_json(self) -> str: ...
    def to_dict(self) -> dict[str, Any]: ...

@final
class Reconstructions:
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Reconstruction: ...
    def __iter__(self) -> Iterator[Reconstruction]: ...
    @property
    def forces_N(self) -> NDArray[np.float64] | None: ...
    @property
    def resultant_N(self) -> NDArray[np.float64]: ...
    @property
    def contacts(self) -> list[list[Contact] | None]: ...
    @property
    def flags(self) -> list[list[str]]: ...

@final
class Scene:
    @staticmethod
    def from_toml(text: str, origin: str = "scene.toml") -> Scene: ...
    @staticmethod
    def from_name(name: str) -> Scene: ...
    @staticmethod
    def builtin() -> list[str]: ...
    @property
    def name(self) -> str: ...
    @property
    def rows(self) -> int: ...
    @property
    def cols(self) -> int: ...
    @property
    def pitch_mm(self) -> tuple[float, float]: ...
    @property
    def thickness_mm(self) -> float: ...
    @property
    def positions_mm(self) -> NDArray[np.float64]: ...
    @property
    def estimator(self) -> str: ...
    @property
    def hardware_estimator(self) -> str: ...
    @property
    def frames_per_result(self) -> int: ...
    @property
    def frames(self) -> list[Frame]: ...
    def load_frames(self, path: str | PathLike[str]) -> list[Frame]: ...
    @overload
    def reconstruct(
        self,
        frames: Frame | np.ndarray[tuple[int, int], Any],
        engine: _Engine = "golden",
        *,
        cross_check: int = 1,
    ) -> Reconstruction: ...
    @overload
    def reconstruct(
        self,
        frames: Sequence[Frame] | np.ndarray[tuple[int, int, int], Any],
        engine: _Engine = "golden",
        *,
        cross_check: int = 1,
    ) -> Reconstructions: ...
    @overload
    def reconstruct(
        self, frames: ArrayLike, engine: _Engine = "golden", *, cross_check: int = 1
    ) -> Reconstruction | Reconstructions: ...
    def trace(self, frame: Frame | ArrayLike) -> list[Stage]: ...
    def noise(
        self,
        *,
        levels: Sequence[float] | None = None,
        draws: int = 200,
        seed: int = 1,
        objectives: Sequence[str] | None = None,
        frames: int | None = None,
        shapes: str | None = None,
        estimators: Sequence[str] | None = None,
        contacts: int | None = None,
        slip: str | None = None,
        gain_spread: float | None = None,
        drift: float | None = None,
        tare_frames: int | None = None,
        unipolar: bool | None = None,
        stated: bool | None = None,
        hardware: bool | None = None,
    ) -> list[dict[str, Any]]: ...
    def generate(
        self,
        contacts: Sequence[_ContactDescription] | None = None,
        *,
        random: int = 0,
        shapes: Literal["elliptic", "other"] = "elliptic",
        slip: str = "full",
        touching: bool = False,
        seed: int = 1,
        noise: float = 0.0,
        gain_spread: float = 0.0,
        drift: float = 0.0,
        tare_frames: int = 0,
        frames: int = 1,
        unipolar: bool = False,
        bits: int | None = None,
        full_scale_MPa: float | None = None,
        dead: Sequence[tuple[int, int]] = ...,
        stuck: Sequence[tuple[tuple[int, int], float]] = ...,
        id: str = "generated",
    ) -> Frame: ...

@final
class Stage:
    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def bits(self) -> int: ...
    @property
    def words(self) -> NDArray[np.int64]: ...
    @property
    def lsb(self) -> NDArray[np.float64]: ...
    @property
    def fixed(self) -> NDArray[np.float64]: ...
    @property
    def floating(self) -> NDArray[np.float64]: ...

@final
class Board:
    def __new__(
        cls,
        port: str,
        scene: Scene,
        *,
        baud: int | None = None,
        timeout_s: float = 1.0,
        check: bool = False,
        cross_check: int | None = None,
        tare: Frame | None = None,
    ) -> Board: ...
    def reconstruct(self, frame: Frame | ArrayLike) -> Reconstruction: ...
    def stream(self, frames: Iterable[Frame | ArrayLike]) -> Answers: ...
    @property
    def link_errors(self) -> tuple[int, int]: ...
    def close(self) -> None: ...
    def __enter__(self) -> Board: ...
    def __exit__(self, _kind: object, _error: object, _traceback: object, /) -> None: ...

@final
class Answers:
    def __iter__(self) -> Answers: ...
    def __next__(self) -> Reconstruction: ...

def errors(reference_N: ArrayLike, value_N: ArrayLike) -> Errors: ...
