"""Echolume: volumes of 3D/4D ultrasound as pictures, lattices and meshes, on Vulkan. Not a medical device.

A volume is an array of (slices, rows, columns), or of (frames, lines, samples) with a `Probe`; uint8, uint16, int16 or float32. `spacing` is mm between
columns, rows and slices, as ITK has it. `affine`, (4, 4), maps (column, row, slice, 1) to mm in the world (LPS).

A picture of an array, (height, width, 4); settings are those of `echolume render`:

>>> import echolume, numpy as np
>>> z, y, x = np.mgrid[-16:17, -16:17, -16:17]
>>> ball = (200 * (x**2 + y**2 + z**2 < 100)).astype(np.uint8)
>>> picture = echolume.render(ball, spacing=(0.5, 0.5, 0.5), mode="mip", picture={"size": [96, 64]})
>>> picture.shape, picture.dtype.name, bool(picture[..., :3].max() > 100)
((64, 96, 4), 'uint8', True)

A `Renderer` stays on the device; what is changed runs only the passes that depend on it, and settings are read back:

>>> renderer = echolume.Renderer(BONE, presets=["bone"], picture={"size": [96, 64]})
>>> picture = renderer.picture()
>>> renderer.set(camera={"azimuth": 30}, mode="mip")
>>> bool((renderer.picture() != picture).any())
True
>>> renderer.settings["camera"]["azimuth"], renderer.settings["mode"]
(30.0, 'mip')
>>> renderer.turntable(3).shape
(3, 64, 96, 4)

Settings do what they do in `echolume render`: the range of the samples, measurements, and a bar below the picture:

>>> before = renderer.picture()
>>> renderer.set("samples.range=[0,100]")
>>> bool((renderer.picture() != before).any())
True
>>> renderer.set("samples.range=[0,255]")
>>> bool((renderer.picture() == before).all())
True
>>> renderer.set("marks.bar=true")
>>> barred = renderer.picture()
>>> barred.shape[0] > 64, barred.shape[1:]
(True, (96, 4))
>>> renderer.turntable(2).shape == (2, *barred.shape)
True
>>> renderer.set(marks={"bar": False}, measure=[{"kind": "distance", "points": [[-10, 10, 0], [10, 30, 0]], "on_surface": True}])
>>> measured = renderer.picture()
>>> measured.shape == before.shape, bool((measured != before).any())
(True, True)
>>> renderer.measurements
[{'kind': 'distance', 'text': '', 'quantities': {'distance': (28.284271247461902, 'mm')}}]

A volume of a file, and where its voxels are:

>>> bone = echolume.read(BONE)
>>> bone["samples"].shape, bone["samples"].dtype.name, bone["geometry"]
((33, 216, 160), 'uint8', 'cartesian')

Polar frames on a lattice, and the surface of what is bright:

>>> frames, probe = echolume.phantom("sphere", frames=9, lines=24, samples=128, speckle="none")
>>> lattice, affine = echolume.convert(frames, probe=probe, voxel=2.0)
>>> lattice.ndim, affine.shape
(3, (4, 4))
>>> mesh = echolume.mesh(ball, spacing=(0.5, 0.5, 0.5), threshold=0.4)
>>> mesh.closed, mesh.vertices.shape[1], mesh.triangles.dtype.name
(True, 3, 'uint32')

The volumes of a recording, of a live source or of arrays, as they are played:

>>> [(volume, picture.shape) for volume, picture in echolume.stream(BONE, settings=["mode=mip", "picture.size=[32,24]"])]
[(0, (24, 32, 4))]

Errors are one line that names what was being done to what:

>>> echolume.read("nowhere.mha")
Traceback (most recent call last):
ValueError: nowhere.mha: file: cannot be read: No such file or directory (os error 2)
>>> renderer.set(mode="sideways")  # doctest: +ELLIPSIS
Traceback (most recent call last):
ValueError: settings: mode: unknown variant `sideways`, expected one of ...
>>> echolume.stream(BONE, settings=["samples.range=[0,100]"])
Traceback (most recent call last):
ValueError: samples.range: a stream has the range that its recording states; only a Renderer takes another
>>> renderer.set("mode=plane")
>>> renderer.turntable(3)
Traceback (most recent call last):
ValueError: scene: mode: shows planes, which do not turn with the view: a turntable needs a rendering
>>> echolume.Renderer(BONE, -1)
Traceback (most recent call last):
IndexError: volume -1: there are 1, numbered from 0
>>> echolume.render(ball / 2)
Traceback (most recent call last):
ValueError: array: dtype float64: must be uint8, uint16, int16 or float32; array.astype(np.float32) makes it one
"""

from __future__ import annotations

import json
import os
import pathlib
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import IO, Any, Literal, NamedTuple, TypedDict, cast

import numpy as np
import numpy.typing as npt

from . import _echolume
from ._echolume import DeviceError, __version__
from ._inputs import Affine, Path, Preset, Samples, Settings, array_of, chosen, probe_path, spacing_of, volume_of
from ._probe import Probe

__all__ = [
    "Device",
    "DeviceError",
    "Mesh",
    "Probe",
    "Recorded",
    "Renderer",
    "Stream",
    "__version__",
    "convert",
    "devices",
    "info",
    "mesh",
    "phantom",
    "presets",
    "read",
    "render",
    "stream",
]

Picture = npt.NDArray[np.uint8]
Volume = npt.NDArray[np.uint8 | np.uint16 | np.int16 | np.float32]


class Recorded(TypedDict):
    """What `read` returns."""

    samples: Volume
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
    """(4, 4): from (column, row, slice, 1) to mm in the world (LPS), the `affine` of other functions; None for a sweep."""


class Mesh(NamedTuple):
    """A surface as triangles."""

    vertices: npt.NDArray[np.float64]
    """(n, 3): mm, in the world of the volume."""
    triangles: npt.NDArray[np.uint32]
    """(m, 3): numbers of vertices, anticlockwise as seen from outside."""
    threshold: float
    """The value of the surface, 0 to 1 of the range of the samples."""
    closed: bool


class Device(NamedTuple):
    """A Vulkan device. Its number is its place in `devices()`."""

    name: str
    kind: str
    vulkan: str
    driver: str
    missing: list[str]
    """What it lacks to be used."""
    is_default: bool
    """It is used unless `device` names another."""


class Measured(TypedDict):
    """What a measurement found."""

    kind: str
    text: str
    quantities: dict[str, tuple[float, str]]
    """By name: value and unit, of mm, cm2, cm3, deg, or none. Empty where its points measure nothing."""


def read(
    path: Path, volume: int = 0, *, probe: Path | None = None, spacing: Sequence[float] | None = None
) -> Recorded:
    """Reads one volume of a recording into memory, whatever the library reads (docs/formats.md).

    `probe`: a probe file (TOML). `spacing`: mm between columns, rows and pictures, for stacks of pictures.

    Raises ValueError for a file that cannot be read, IndexError for a volume that is not there.
    """
    found = volume_of(path, volume, spacing, None, probe, None)
    low, high = found.range
    lengths = found.spacing
    return {
        "samples": found.samples(),
        "range": (low, high),
        "volumes": found.volumes,
        "geometry": "sweep" if lengths is None else "cartesian",
        "spacing": lengths,
        "voxel_to_world": found.affine(),
    }


def _device(device: str | int | None) -> str | None:
    return None if device is None else str(device)


class Renderer:
    """A volume on the device, and the picture of it.

    `source`: a file; an array of (slices, rows, columns), or of (volumes, slices, rows, columns), of which `volume` is one; or None for the synthetic
    fetal head. Arrays of numpy, and what offers `__array__` (xarray) or `__dlpack__` (torch, on the CPU), are read where they are, contiguous or
    not, and copied once into the renderer: what is written to them later changes no picture.

    `spacing`: mm between columns, rows and slices, 1 each by default; of a file for stacks of pictures alone. `affine`: (4, 4), instead. `probe`: of
    polar frames, (frames, lines, samples). `range`: values that are shown as black and white; of uint8 0 and 255, otherwise the smallest
    and the largest.

    `presets`, `settings` and `more` are layers in this order: presets by name; a table, or words such as "mode=mip"; and tables by
    keyword, as `camera={"azimuth": 30}`. None takes a setting away. What nobody chose follows from the echoes. `device`: a number
    or a part of a name (`devices()`).

    Work is done without the GIL. One renderer may be used by several threads, which wait for each other.

    Raises ValueError for an array, a file or a setting that is refused, IndexError for a volume that is not there, DeviceError.
    """

    def __init__(
        self,
        source: Path | Samples | None = None,
        volume: int = 0,
        *,
        spacing: Sequence[float] | None = None,
        affine: Affine | None = None,
        probe: Probe | Path | None = None,
        range: Sequence[float] | None = None,
        presets: Sequence[Preset] = (),
        settings: Settings = (),
        device: str | int | None = None,
        **more: Any,
    ) -> None:
        words = chosen(presets, settings, more)
        given = volume_of(source, volume, spacing, affine, probe, range)
        self._place = (spacing, affine, probe, range)
        self._renderer = _echolume.Renderer(given, words, _device(device), source is None)

    def picture(self) -> Picture:
        """Draws the picture: (height, width, 4), red, green, blue, alpha; rows from the top. Raises DeviceError.

        It has its measurements (`measure`) and, with `marks.bar=true`, marks and a bar below, which makes it higher.
        """
        return self._renderer.picture()

    def set(self, *assignments: str, **settings: Any) -> None:
        """Changes settings, as "camera.azimuth=30" or camera={"azimuth": 30} (docs/settings.md). All or none of them take effect.

        Raises ValueError for a setting that is refused, DeviceError.
        """
        self._renderer.set(chosen((), (), settings, assignments))

    @property
    def settings(self) -> dict[str, Any]:
        """All settings as they are drawn, also those that nobody chose. As `settings` of another renderer they make the same picture."""
        return cast("dict[str, Any]", json.loads(self._renderer.settings()))

    def update(self, source: Path | Samples, volume: int = 0) -> None:
        """Shows another volume of the same shape, type and place, in the range and with the look of the first.

        Raises ValueError for another shape or type, IndexError for a volume that is not there, DeviceError.
        """
        self._renderer.update(volume_of(source, volume, *self._place))

    @property
    def measurements(self) -> list[Measured]:
        """What the measurements of the setting `measure` found, in their order."""
        made = self.settings.get("measure", [])
        found = self._renderer.measurements()
        return [
            {
                "kind": measured["kind"],
                "text": measured.get("text", ""),
                "quantities": {name: (value, unit) for name, value, unit in quantities},
            }
            for measured, (quantities, _) in zip(made, found, strict=True)
        ]

    def pick(self, column: float, row: float) -> tuple[float, float, float] | None:
        """The point of the surface at a position on the picture, pixels from its upper left corner: mm, lateral, depth from the probe's face and
        elevation, as points of `measure`. None where no surface is.

        Raises ValueError for a mode that finds no surface, DeviceError.
        """
        found = self._renderer.pick(column, row)
        return None if found is None else (found[0], found[1], found[2])

    def turntable(self, count: int) -> npt.NDArray[np.uint8]:
        """Pictures of one turn about the vertical axis of the view, at one scale: (count, height, width, 4). The settings stay, also if a
        picture fails.

        Raises ValueError for a count outside of 1..=3600 and for a mode that shows planes, DeviceError.
        """
        if not 1 <= count <= 3600:
            raise ValueError(f"turntable({count}): must lie in 1..=3600 pictures")
        return self._renderer.turntable(count)


def render(
    source: Path | Samples | None = None,
    volume: int = 0,
    *,
    spacing: Sequence[float] | None = None,
    affine: Affine | None = None,
    probe: Probe | Path | None = None,
    range: Sequence[float] | None = None,
    presets: Sequence[Preset] = (),
    settings: Settings = (),
    device: str | int | None = None,
    **more: Any,
) -> Picture:
    """One picture of a volume: that of `Renderer`, with the same arguments and errors. A Renderer is quicker for several."""
    renderer = Renderer(
        source,
        volume,
        spacing=spacing,
        affine=affine,
        probe=probe,
        range=range,
        presets=presets,
        settings=settings,
        device=device,
        **more,
    )
    return renderer.picture()


def convert(
    source: Path | Samples,
    volume: int = 0,
    *,
    spacing: Sequence[float] | None = None,
    affine: Affine | None = None,
    probe: Probe | Path | None = None,
    voxel: float | None = None,
    outside: float | None = None,
) -> tuple[Volume, npt.NDArray[np.float64]]:
    """A volume on a lattice, in the type of its samples: (slices, rows, columns), and the (4, 4) from (column, row, slice, 1) to mm.

    Polar frames are interpolated trilinearly in sample, line and frame, in f64; the axes of the lattice are lateral, depth and elevation. `voxel`:
    edge of a voxel, mm; without it a Cartesian volume keeps its voxels, and a sweep gets the sample pitch of its lines. `outside`: value
    outside of the sector, by default that of no echo. Other arguments as of `Renderer`.

    Raises ValueError for what is refused, IndexError for a volume that is not there.
    """
    return _echolume.convert(volume_of(source, volume, spacing, affine, probe, None), voxel, outside)


def mesh(
    source: Path | Samples,
    volume: int = 0,
    *,
    threshold: float | None = None,
    spacing: Sequence[float] | None = None,
    affine: Affine | None = None,
    probe: Probe | Path | None = None,
    range: Sequence[float] | None = None,
    voxel: float | None = None,
    smooth: float | None = None,
    simplify: float | None = None,
    closed: bool = True,
) -> Mesh:
    """The surface where a volume passes a threshold, as `echolume mesh` makes it.

    `threshold`: 0 to 1 of the range of the samples; by default between the darker and the brighter class of echoes. `voxel`: as of `convert`. `smooth`:
    standard deviation of a Gaussian that goes over the volume first, mm; by default none, and for a sweep as in a picture. `simplify`: triangles
    are taken away as long as no point of the surface moves further, mm. `closed`: at the border of the volume, half a voxel outside; else the
    surface ends there. Other arguments as of `Renderer`.

    Raises ValueError for what is refused, IndexError for a volume that is not there.
    """
    given = volume_of(source, volume, spacing, affine, probe, range)
    return Mesh(*_echolume.mesh(given, threshold, voxel, smooth, simplify, closed))


def info(path: Path, *, probe: Path | None = None, spacing: Sequence[float] | None = None) -> dict[str, str]:
    """What `echolume info` says of a file: title and value. Never a patient's name or number. Raises ValueError."""
    found: dict[str, str] = {}
    for title, value in _echolume.info(pathlib.Path(path), probe_path(probe), spacing_of(spacing)):
        found[title] = f"{found[title]}; {value}" if title in found else value
    return found


def devices() -> list[Device]:
    """The Vulkan devices of this machine. Raises DeviceError where there is no Vulkan."""
    return [Device(*device) for device in _echolume.devices()]


def presets() -> list[str]:
    """The names of the presets."""
    return _echolume.presets()


def phantom(
    body: Literal["head", "sphere", "step", "wires", "constant", "ramp", "heart", "vessels"] = "head",
    volume: int = 0,
    *,
    seed: int = 1,
    speckle: Literal["random", "mean", "none"] = "random",
    frames: int = 37,
    lines: int = 128,
    samples: int = 512,
    fan_angle_deg: float = 61.0,
    still: bool = False,
) -> tuple[npt.NDArray[np.uint8], Probe]:
    """A volume of the built-in phantom, (frames, lines, samples), and its probe.

    `body`: a moving fetal head; sphere, step, wires, constant or ramp, whose pictures have a closed formula; a beating heart; or vessels. `volume`: its
    number in time, 0 to 9999. `speckle`: one realisation by `seed`, the mean of all, or none and no blur either. `still`: nothing moves.

    Raises ValueError for a number out of its range, IndexError for such a volume.
    """
    echoes, (radius, sector, pitch, wobble_radius, fan) = _echolume.phantom(
        body, volume, seed, speckle, frames, lines, samples, fan_angle_deg, still
    )
    probe = Probe.curved(radius_mm=radius, sector_angle_deg=sector, sample_pitch_mm=pitch)
    return echoes, probe.fan(wobble_radius_mm=wobble_radius, angle_deg=fan)


class Stream(Iterator[tuple[int, Picture]]):
    """Volumes as they are played: the number of each, and its picture, (height, width, 4) of uint8. `stream` makes one.

    In a `with` block its connection ends with the block.
    """

    def __init__(
        self, pictures: Iterator[tuple[int, Picture]], settings: Callable[[], str | None], close: Callable[[], None]
    ) -> None:
        self._pictures = pictures
        self._settings = settings
        self._close = close

    def __iter__(self) -> Stream:
        return self

    def __next__(self) -> tuple[int, Picture]:
        """The next picture. Raises ValueError for a frame that is refused, DeviceError."""
        return next(self._pictures)

    def __enter__(self) -> Stream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def settings(self) -> dict[str, Any] | None:
        """All settings as they are drawn, as of a Renderer; None before the first volume and after the end."""
        found = self._settings()
        return None if found is None else cast("dict[str, Any]", json.loads(found))

    def close(self) -> None:
        """Ends the stream and its connection."""
        self._pictures = iter(())
        self._close()


def stream(
    source: Path | IO[bytes] | Samples | Iterable[Samples],
    *,
    spacing: Sequence[float] | None = None,
    affine: Affine | None = None,
    probe: Probe | Path | None = None,
    range: Sequence[float] | None = None,
    presets: Sequence[Preset] = (),
    settings: Settings = (),
    device: str | int | None = None,
    rate: float | None = None,
    rounds: int = 1,
    device_name: str | None = None,
    tool: str | None = None,
    **more: Any,
) -> Stream:
    """Draws each volume of a source as it is played.

    `source`: a file; "igtl://HOST:PORT" for OpenIGTLink; a pipe that nobody has read from, such as `Popen.stdout`,
    in the format of `echolume stream --source -`; "phantom", without end; or an iterable of arrays of one shape, or an array of
    (volumes, slices, rows, columns). A picture of a pipe or a network is of the newest volume; arrays and files lose none.

    `rate`: volumes in a second, of a file or the phantom; None as fast as they can be drawn, of the phantom 1. `rounds`: how often a file is
    played. `device_name`, `tool`: of OpenIGTLink, the device whose images are taken, and the device or tool that tracks them, or "image". What a
    live source leaves out is a RuntimeWarning. Other arguments as of `Renderer`; the setting `samples.range` is refused but for arrays, since a
    stream has the range that its source states.

    Raises ValueError for a source or a setting that is refused, DeviceError.
    """
    words = chosen(presets, settings, more)
    if rate is not None and not 0 < rate <= 1e6:
        raise ValueError(f"rate={rate}: must be above 0, at most 1e6 volumes a second")
    if not 1 <= rounds < 2**32:
        raise ValueError(f"rounds={rounds}: must be at least 1")
    if not isinstance(source, (str, os.PathLike)) and not hasattr(source, "fileno"):
        if hasattr(source, "__array__") or hasattr(source, "__dlpack__"):
            array = array_of(source)
            if array.ndim != 4:
                raise ValueError(f"array: shape {array.shape}: a stream takes (volumes, slices, rows, columns)")
            source = array
        drawn: list[_echolume.Renderer] = []
        pictures = _of_arrays(source, drawn, (spacing, affine, probe, range), words, _device(device))
        return Stream(pictures, lambda: drawn[0].settings() if drawn else None, drawn.clear)
    for name, value in (("affine", affine), ("range", range)):
        if value is not None:
            raise ValueError(f"{name}: is for arrays; this source states its own")
    kind, place = _kind_and_place(cast("Path | IO[bytes]", source))
    origin: _echolume._Origin = {
        "kind": kind,
        "place": place,
        "probe": probe_path(probe),
        "voxel_spacing": spacing_of(spacing),
        "rate": 1.0 if rate is None and kind == "phantom" else rate,
        "rounds": rounds,
        "device_name": device_name,
        "tool": tool,
    }
    native = _echolume.Stream(origin, words, _device(device))
    return Stream(_of_source(native, kind != "file"), native.settings, native.close)


def _kind_and_place(source: Path | IO[bytes]) -> tuple[str, str]:
    if not isinstance(source, (str, os.PathLike)):
        try:
            return "pipe", f"/dev/fd/{source.fileno()}"
        except OSError as fault:
            raise ValueError(f"source: a {type(source).__name__} is no pipe: {fault}") from None
    place = os.fspath(source)
    if place.startswith("igtl://"):
        return "igtl", place.removeprefix("igtl://")
    return ("phantom" if place == "phantom" else "file"), place


def _of_source(source: _echolume.Stream, is_live: bool) -> Iterator[tuple[int, Picture]]:
    while (found := source.next()) is not None:
        shown, fault = found
        if shown is not None:
            yield shown
        elif is_live:
            # The source goes on.
            warnings.warn(str(fault), RuntimeWarning, stacklevel=3)
        else:
            raise ValueError(fault)


def _of_arrays(
    arrays: Iterable[Samples], drawn: list[_echolume.Renderer], place: tuple[Any, Any, Any, Any], words: Any, device: str | None
) -> Iterator[tuple[int, Picture]]:
    for number, array in enumerate(arrays):
        volume = volume_of(array, 0, *place)
        if drawn:
            drawn[0].update(volume)
        else:
            drawn.append(_echolume.Renderer(volume, words, device, False))
        yield number, drawn[0].picture()


# Users meet these names in one module.
for _name in __all__:
    if getattr(globals()[_name], "__module__", None) in (f"{__name__}._probe", f"{__name__}._echolume"):
        globals()[_name].__module__ = __name__
