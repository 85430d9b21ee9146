"""The probe of polar frames."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _echolume

Numbers = Sequence[float] | npt.NDArray[np.floating[Any] | np.integer[Any]]


def _numbers(values: Numbers | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]


def _table(**values: object) -> dict[str, object]:
    return {key: value for key, value in values.items() if value is not None}


class Probe:
    """Where the samples of polar frames are: the array, its scan lines, their depth, and how the array moves from frame to frame.

    An array of numpy is (frames, lines, samples). Lengths are mm, angles degrees. `curved`, `linear` and `phased` make a probe of one frame;
    `fan` and `translated` sweep it. Space is lateral, depth and elevation; its origin is the apex of a curved array or the face of a linear one.

    >>> probe = Probe.curved(radius_mm=40, sector_angle_deg=70, end_mm=120).fan(angle_deg=60, wobble_radius_mm=25)
    >>> probe.places(31, 71, 256).shape
    (31, 71, 256, 3)
    """

    __slots__ = ("_tables",)
    _tables: Mapping[str, Mapping[str, object]]

    def __init__(self) -> None:
        raise TypeError("Probe: use Probe.curved, Probe.linear or Probe.phased")

    @classmethod
    def _of(cls, tables: Mapping[str, Mapping[str, object]]) -> Probe:
        probe = object.__new__(cls)
        probe._tables = tables
        return probe

    @classmethod
    def _still(
        cls,
        array: dict[str, object],
        lines: dict[str, object],
        start_mm: float,
        sample_pitch_mm: float | None,
        end_mm: float | None,
        sound_speed_m_per_s: float,
    ) -> Probe:
        depth = _table(start_mm=start_mm, sample_pitch_mm=sample_pitch_mm, end_mm=end_mm)
        return cls._of(
            {"array": array, "lines": lines, "depth": depth, "motion": {"kind": "still"}, "sound": {"speed_m_per_s": sound_speed_m_per_s}}
        )

    @classmethod
    def curved(
        cls,
        *,
        radius_mm: float,
        sector_angle_deg: float | None = None,
        angles_deg: Numbers | None = None,
        sample_pitch_mm: float | None = None,
        end_mm: float | None = None,
        start_mm: float = 0.0,
        sound_speed_m_per_s: float = 1540.0,
    ) -> Probe:
        """An array on an arc of `radius_mm`.

        Lines: `sector_angle_deg` from the first to the last, or `angles_deg` of each, rising, 0 straight ahead. Depth: `start_mm` from the face
        to the first sample, and either `sample_pitch_mm` or `end_mm`, the depth of the last sample.
        """
        lines = _table(sector_angle_deg=sector_angle_deg, angles_deg=_numbers(angles_deg))
        array = {"kind": "curved", "radius_mm": radius_mm}
        return cls._still(array, lines, start_mm, sample_pitch_mm, end_mm, sound_speed_m_per_s)

    @classmethod
    def phased(
        cls,
        *,
        sector_angle_deg: float | None = None,
        angles_deg: Numbers | None = None,
        sample_pitch_mm: float | None = None,
        end_mm: float | None = None,
        start_mm: float = 0.0,
        sound_speed_m_per_s: float = 1540.0,
    ) -> Probe:
        """An array whose lines begin at one point: as `curved` with a radius of 0."""
        return cls.curved(
            radius_mm=0.0,
            sector_angle_deg=sector_angle_deg,
            angles_deg=angles_deg,
            sample_pitch_mm=sample_pitch_mm,
            end_mm=end_mm,
            start_mm=start_mm,
            sound_speed_m_per_s=sound_speed_m_per_s,
        )

    @classmethod
    def linear(
        cls,
        *,
        width_mm: float | None = None,
        positions_mm: Numbers | None = None,
        sample_pitch_mm: float | None = None,
        end_mm: float | None = None,
        start_mm: float = 0.0,
        sound_speed_m_per_s: float = 1540.0,
    ) -> Probe:
        """An array on a straight line: `width_mm` from the first line to the last, or `positions_mm` of each, rising. Depth as of `curved`."""
        lines = _table(width_mm=width_mm, positions_mm=_numbers(positions_mm))
        return cls._still({"kind": "linear"}, lines, start_mm, sample_pitch_mm, end_mm, sound_speed_m_per_s)

    def _moved(self, **motion: object) -> Probe:
        return Probe._of({**self._tables, "motion": _table(**motion)})

    def fan(
        self,
        *,
        wobble_radius_mm: float,
        angle_deg: float | None = None,
        angles_deg: Numbers | None = None,
        speed_ratio: float = 0.0,
    ) -> Probe:
        """The probe turned from frame to frame about an axis `wobble_radius_mm` behind its face: by `angle_deg` in all, or `angles_deg` of each frame.

        `speed_ratio`: the share of the way to the next frame that the motor travels while one is acquired, 0 to 1.
        """
        return self._moved(
            kind="fan",
            wobble_radius_mm=wobble_radius_mm,
            fan_angle_deg=angle_deg,
            frame_angles_deg=_numbers(angles_deg),
            speed_ratio=speed_ratio,
        )

    def translated(self, *, pitch_mm: float | None = None, positions_mm: Numbers | None = None, speed_ratio: float = 0.0) -> Probe:
        """The probe moved in elevation: by `pitch_mm` from frame to frame, or `positions_mm` of each. `speed_ratio` as of `fan`."""
        return self._moved(kind="translated", pitch_mm=pitch_mm, frame_positions_mm=_numbers(positions_mm), speed_ratio=speed_ratio)

    def still(self, *, thickness_mm: float = 1.0) -> Probe:
        """A probe of one frame, drawn as a slab."""
        return self._moved(kind="still", thickness_mm=thickness_mm)

    def places(self, frames: int, lines: int, samples: int) -> npt.NDArray[np.float64]:
        """Where each sample is: (frames, lines, samples, 3), mm, lateral, depth and elevation.

        Raises ValueError for numbers that make no probe.
        """
        return _echolume.places(self._json(), frames, lines, samples)

    def _json(self) -> str:
        try:
            return json.dumps(self._tables, allow_nan=False)
        except (TypeError, ValueError) as fault:
            raise ValueError(f"probe: {fault}") from None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Probe) and self._tables == other._tables

    def __hash__(self) -> int:
        return hash(json.dumps(self._tables, sort_keys=True))

    def __repr__(self) -> str:
        words = (f"{key}={value!r}" for table in self._tables.values() for key, value in table.items())
        return f"<Probe {', '.join(words)}>"
