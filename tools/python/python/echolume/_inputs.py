"""What users give, as what the library takes."""

from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from . import _echolume
from ._probe import Probe

# Two parts, since stubtest takes one Literal of several words for a Union.
Preset = Literal["bmode", "bone", "face", "face-classic", "fetal", "glass", "skeleton", "thesis"] | Literal["vessel"]
Path = str | os.PathLike[str]
Settings = Mapping[str, Any] | Sequence[str]


class SupportsArray(Protocol):
    """As xarray.DataArray."""

    def __array__(self) -> npt.NDArray[Any]: ...


class SupportsDLPack(Protocol):
    """As torch.Tensor."""

    def __dlpack__(self) -> Any: ...


Samples = npt.NDArray[Any] | SupportsArray | SupportsDLPack
Affine = npt.NDArray[Any] | Sequence[Sequence[float]]

_TYPES = ("uint8", "uint16", "int16", "float32")


def array_of(source: object) -> npt.NDArray[Any]:
    """A view of what holds samples, if its memory allows."""
    if isinstance(source, np.ma.MaskedArray):
        raise ValueError("array: is masked; array.filled(0) says what is there")
    try:
        has_interface = hasattr(source, "__array_interface__") or not hasattr(source, "__dlpack__")
        array = np.asarray(source) if has_interface else np.from_dlpack(source)  # type: ignore[arg-type]
    except (BufferError, RuntimeError, TypeError, ValueError) as fault:
        kind = type(source).__name__
        raise ValueError(f"array: a {kind} is not readable by numpy: {str(fault).splitlines()[0]}") from None
    if array.dtype.name not in _TYPES:
        raise ValueError(f"array: dtype {array.dtype}: must be {', '.join(_TYPES[:-1])} or float32; array.astype(np.float32) makes it one")
    if array.ndim not in (2, 3, 4) or array.size == 0:
        raise ValueError(f"array: shape {array.shape}: must be (slices, rows, columns), or (volumes, slices, rows, columns)")
    # Of this machine's byte order.
    return np.require(array, array.dtype.newbyteorder("="), ["ALIGNED"])


def _one(array: npt.NDArray[Any], number: int) -> npt.NDArray[Any]:
    """One volume of an array: (slices, rows, columns)."""
    count = array.shape[0] if array.ndim == 4 else 1
    if not 0 <= number < count:
        raise IndexError(f"volume {number}: there are {count}, numbered from 0")
    one: npt.NDArray[Any] = array[number] if array.ndim == 4 else array if array.ndim == 3 else array[np.newaxis]
    return one


def _numbers(name: str, value: object, shape: tuple[int, ...], words: str) -> Any:
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != shape:
        raise ValueError(f"{name}: must be {words}")
    return numbers.tolist()


def spacing_of(spacing: object) -> tuple[float, float, float] | None:
    if spacing is None:
        return None
    x, y, z = _numbers("spacing", spacing, (3,), "three lengths, mm between columns, rows and slices")
    if not all(0 < length < np.inf for length in (x, y, z)):
        raise ValueError(f"spacing: ({x}, {y}, {z}): must be three lengths above 0 mm")
    return x, y, z


def volume_of(
    source: Path | Samples | None,
    number: int,
    spacing: object,
    affine: object,
    probe: Probe | Path | None,
    span: object,
) -> _echolume.Volume:
    """The volume of a file or of an array."""
    if isinstance(number, bool) or not hasattr(number, "__index__"):
        raise TypeError(f"volume: {number!r}: must be a whole number")
    number = number.__index__()
    lengths = spacing_of(spacing)
    if source is None or isinstance(source, (str, os.PathLike)):
        for name, value in (("affine", affine), ("range", span)):
            if value is not None:
                raise ValueError(f"{name}: is for arrays; a file states its own")
        if source is None:
            if number != 0:
                raise IndexError(f"volume {number}: there are 1, numbered from 0")
            return _echolume.Volume.head()
        return _echolume.Volume.read(pathlib.Path(source), number, probe_path(probe), lengths)
    if probe is not None and (lengths is not None or affine is not None):
        raise ValueError("probe: polar frames have neither spacing nor affine")
    if lengths is not None and affine is not None:
        raise ValueError("spacing: follows from affine; give one of them")
    matrix = None if affine is None else _numbers("affine", affine, (4, 4), "(4, 4), from (column, row, slice, 1) to mm (LPS)")
    shown = None if span is None else _numbers("range", span, (2,), "two numbers, shown as black and white")
    samples = _one(array_of(source), number)
    tables = probe._json() if isinstance(probe, Probe) else None if probe is None else pathlib.Path(probe)
    return _echolume.Volume.of_array(samples, lengths or (1.0, 1.0, 1.0), matrix, tables, shown)


def probe_path(probe: Probe | Path | None) -> pathlib.Path | None:
    if isinstance(probe, Probe):
        raise ValueError("probe: is for arrays; a file takes the path of a probe file")
    return None if probe is None else pathlib.Path(probe)


def _plain(value: object) -> Any:
    """A value of JSON. None is what takes a setting away."""
    if value is None:
        return "none"
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    return value


def _put(table: dict[str, Any], path: str, value: object) -> None:
    *tables, key = path.split(".")
    for name in tables:
        table = table.setdefault(name, {})
        if not isinstance(table, dict):
            raise ValueError(f"settings: {path}: {name} is given twice")
    known = table.get(key)
    if isinstance(known, dict) and isinstance(value, dict):
        for name, inner in value.items():
            _put(known, name, inner)
    else:
        table[key] = value


def chosen(presets: Sequence[str], settings: Settings, more: Mapping[str, Any], assignments: Sequence[str] = ()) -> _echolume._Chosen:
    """What a user chose: `settings` as a table or as words such as "mode=mip", and `more` over it."""
    if isinstance(presets, str):
        raise ValueError(f"presets: {presets!r}: must be a sequence of names, such as [{presets!r}]")
    if isinstance(settings, str):
        raise ValueError(f"settings: {settings!r}: must be a table, or a sequence such as [{settings!r}]")
    table: dict[str, Any] = {}
    given: list[Mapping[str, Any]] = [settings, more] if isinstance(settings, Mapping) else [more]
    words = [*assignments] if isinstance(settings, Mapping) else [*settings, *assignments]
    for layer in given:
        for path, value in layer.items():
            _put(table, path, _plain(value))
    try:
        text = json.dumps(table, allow_nan=False)
    except (TypeError, ValueError) as fault:
        raise ValueError(f"settings: {fault}") from None
    return {"presets": list(presets), "assignments": words, "table": text}
