"""What the library itself offers; `echolume` checks what it is given."""

import pathlib
from typing import Any, TypedDict, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "DeviceError",
    "Renderer",
    "Stream",
    "Volume",
    "__version__",
    "convert",
    "devices",
    "info",
    "mesh",
    "phantom",
    "places",
    "presets",
]

__version__: str

class DeviceError(RuntimeError): ...

class _Chosen(TypedDict):
    presets: list[str]
    assignments: list[str]
    table: str

class _Origin(TypedDict):
    kind: str
    place: str
    probe: pathlib.Path | None
    voxel_spacing: tuple[float, float, float] | None
    rate: float | None
    rounds: int
    device_name: str | None
    tool: str | None

@final
class Volume:
    @staticmethod
    def read(
        path: pathlib.Path, volume: int, probe: pathlib.Path | None, voxel_spacing: tuple[float, float, float] | None
    ) -> Volume: ...
    @staticmethod
    def head() -> Volume: ...
    @staticmethod
    def of_array(
        samples: npt.NDArray[Any],
        spacing: tuple[float, float, float],
        affine: list[list[float]] | None,
        probe: str | pathlib.Path | None,
        range: list[float] | None,
    ) -> Volume: ...
    def samples(self) -> npt.NDArray[np.uint8 | np.uint16 | np.int16 | np.float32]: ...
    def affine(self) -> npt.NDArray[np.float64] | None: ...
    @property
    def range(self) -> list[float]: ...
    @property
    def volumes(self) -> int: ...
    @property
    def spacing(self) -> list[float] | None: ...

@final
class Renderer:
    def __new__(cls, volume: Volume, chosen: _Chosen, device: str | None, is_phantom: bool) -> Renderer: ...
    def picture(self) -> npt.NDArray[np.uint8]: ...
    def set(self, chosen: _Chosen) -> None: ...
    def update(self, volume: Volume) -> None: ...
    def settings(self) -> str: ...
    def measurements(self) -> list[tuple[list[tuple[str, float, str]], str | None]]: ...
    def pick(self, column: float, row: float) -> list[float] | None: ...
    def turntable(self, count: int) -> npt.NDArray[np.uint8]: ...

@final
class Stream:
    def __new__(cls, origin: _Origin, chosen: _Chosen, device: str | None) -> Stream: ...
    def next(self) -> tuple[tuple[int, npt.NDArray[np.uint8]] | None, str | None] | None: ...
    def settings(self) -> str | None: ...
    def close(self) -> None: ...

def presets() -> list[str]: ...
def devices() -> list[tuple[str, str, str, str, list[str], bool]]: ...
def info(
    path: pathlib.Path, probe: pathlib.Path | None, voxel_spacing: tuple[float, float, float] | None
) -> list[tuple[str, str]]: ...
def phantom(
    body: str,
    volume: int,
    seed: int,
    speckle: str,
    frames: int,
    lines: int,
    samples: int,
    fan_angle_deg: float,
    still: bool,
) -> tuple[npt.NDArray[np.uint8], list[float]]: ...
def convert(
    volume: Volume, spacing: float | None, outside: float | None
) -> tuple[npt.NDArray[np.uint8 | np.uint16 | np.int16 | np.float32], npt.NDArray[np.float64]]: ...
def mesh(
    volume: Volume,
    threshold: float | None,
    spacing: float | None,
    smooth: float | None,
    simplify: float | None,
    closed: bool,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32], float, bool]: ...
def places(probe: str | pathlib.Path, frames: int, lines: int, samples: int) -> npt.NDArray[np.float64]: ...
