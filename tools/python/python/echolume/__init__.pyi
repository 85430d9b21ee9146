import os
from collections.abc import Iterator, Sequence
from typing import Literal, TypedDict

import numpy as np
import numpy.typing as npt

class Recorded(TypedDict):
    samples: npt.NDArray[np.uint8 | np.uint16 | np.int16 | np.float32]
    """(slices, rows, columns) in the type of the file. Of a sweep a slice is a frame, a row a scan line, a column a sample
    along it, and frames are in geometric order. Frames that are missing are 0 as stored."""
    range: tuple[float, float]
    """The values of the file that are shown as black and white."""
    volumes: int
    """Number of volumes of the recording."""
    geometry: Literal["cartesian", "sweep"]
    spacing: list[float] | None
    """mm between columns, rows and slices; None for a sweep, whose lines diverge."""
    voxel_to_world: npt.NDArray[np.float64] | None
    """(4, 4): from (column, row, slice, 1) to mm in the world (LPS); None for a sweep."""

class DeviceError(RuntimeError):
    """A Vulkan device is missing, failed or was lost."""

def read(
    path: str | os.PathLike[str],
    volume: int = 0,
    *,
    probe: str | os.PathLike[str] | None = None,
    voxel_spacing: tuple[float, float, float] | None = None,
) -> Recorded:
    """Reads one volume of a recording into memory, whatever the library reads (docs/formats.md).

    `probe`: a probe file (TOML). `voxel_spacing`: mm, for stacks of pictures.

    Raises ValueError for a file that cannot be read, IndexError for a volume that is not there.
    """

class Renderer:
    """A volume of a recording on the device, and the picture of it.

    `path`: None for the synthetic fetal head. `presets` and `settings` (such as "mode=mip") are layers as `--preset` and `--set` of
    `echolume render`; what nobody chose follows from the echoes. `device`: a number or a part of a name.

    Work is done without the GIL. One renderer may be used by several threads, which wait for each other.

    Raises ValueError for a file or a setting that is refused, IndexError for a volume that is not there, DeviceError.
    """

    def __init__(
        self,
        path: str | os.PathLike[str] | None = None,
        volume: int = 0,
        *,
        presets: Sequence[str] = (),
        settings: Sequence[str] = (),
        device: str | None = None,
        probe: str | os.PathLike[str] | None = None,
        voxel_spacing: tuple[float, float, float] | None = None,
    ) -> None: ...
    def picture(self) -> npt.NDArray[np.uint8]:
        """Draws the picture: (height, width, 4), red, green, blue, alpha; rows from the top. Raises DeviceError.

        It has its measurements (`measure`) and, with `marks.bar=true`, marks and a bar below, which makes it higher.
        """

    def set(self, *assignments: str) -> None:
        """Changes settings, such as "camera.azimuth=30" (docs/settings.md). All or none of them take effect.

        Raises ValueError for a setting that is refused, DeviceError.
        """

    def turntable(self, count: int) -> npt.NDArray[np.uint8]:
        """Pictures of one turn about the vertical axis of the view, at one scale: (count, height, width, 4). The settings stay, also if a
        picture fails.

        Raises ValueError for a count outside of 1..=3600 and for a mode that shows planes, DeviceError.
        """

class Stream:
    """Iterates over volumes as they are played: the number of the volume, and its picture, (height, width, 4) of uint8."""

    def __iter__(self) -> Iterator[tuple[int, npt.NDArray[np.uint8]]]: ...
    def __next__(self) -> tuple[int, npt.NDArray[np.uint8]]:
        """The next picture. Raises ValueError for a frame that is refused, DeviceError."""

def stream(
    path: str | os.PathLike[str],
    *,
    presets: Sequence[str] = (),
    settings: Sequence[str] = (),
    device: str | None = None,
    probe: str | os.PathLike[str] | None = None,
    voxel_spacing: tuple[float, float, float] | None = None,
    rate: float | None = None,
) -> Stream:
    """Plays a recording and draws each of its volumes, as `echolume stream`. A file loses no volume to a slow reader.

    `rate`: volumes in a second; None as fast as they can be drawn. The other arguments are those of `Renderer`; the setting `samples.range` is
    refused, since a stream has the range that its recording states.

    Raises ValueError for a file or a setting that is refused, DeviceError.
    """
