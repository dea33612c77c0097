"""Ground lines of sidescan channels: where the cells across the track of a ping lie on the terrain.

A sample of a beam comes from the cone about the array's axis; over the terrain this is a line across the track. A line
follows from the logged pose, so that turns, pitch, roll and slopes are taken into account. Rays are straight.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.formats.store_description import StoreError
from insonify.frames import pose_rotation
from insonify.sonar.sonar import Sonar, array_position, array_rotation
from insonify.surveys.survey import Survey

Floats = NDArray[np.float64]

STEPS = 5
"""Iterations of a point of a line: of its distance along the track, and of its depth on the terrain [1]."""
LEAST_ACROSS = 0.1
"""Least horizontal part of a boresight that looks to a side [1]."""
FINENESS = 0.7
"""Distance of cells, and of lines at the far end, re the pixel [1]."""


@dataclass(frozen=True, slots=True)
class GroundLine:
    """Cells of one channel across the track, n of them."""

    north: Floats
    """North of their middles [m], shape (n,)."""
    east: Floats
    """East of their middles [m], shape (n,)."""
    edges: Floats
    """Edges in units of samples, shape (n + 1,): sample k extends from k to k + 1."""

    def means(self, values: Floats) -> Floats:
        """Means of samples, shape (samples,), over the cells, at least one sample wide; NaN outside the recording."""
        low, high = np.minimum(self.edges[:-1], self.edges[1:]), np.maximum(self.edges[:-1], self.edges[1:])
        wider = np.maximum(0.5 - (high - low) / 2, 0)
        low, high = low - wider, high + wider
        inside = (low >= 0) & (high <= values.size)  # False for NaN
        sums = np.concatenate([[0.0], np.cumsum(values)])
        below, above = (np.interp(edge, np.arange(sums.size), sums) for edge in (low, high))
        return np.where(inside, (above - below) / np.maximum(high - low, 1e-9), np.nan)

    def samples(self, count: int) -> NDArray[np.int64]:
        """Sample in the middle of each cell, -1 outside of `count` samples."""
        middle = (self.edges[:-1] + self.edges[1:]) / 2
        inside = (middle >= 0) & (middle < count)
        return np.where(inside, np.where(inside, middle, 0).astype(np.int64), -1)


def slant_ranges(survey: Survey) -> Floats:
    """Slant range of each sample, timed by the middle of the pulse unless it is compressed [m], shape (time,)."""
    sonar = survey.scenario.sonar
    pulse_middle = 0.0 if sonar.receiver.matched_filter else sonar.pulse.duration / 2
    return (survey.sample_time - pulse_middle) * survey.scenario.water.sound_speed / 2


def ground_lines(survey: Survey, number: int, pixel: float) -> Iterator[tuple[int, GroundLine]]:
    """Ground lines of one ping, as close as a raster needs them, from midway to the ping before to midway to the next.

    Args:
        survey: Recording of beams that look to a side.
        number: Number within the recorded pings.
        pixel: Size of the raster's cells [m].

    Yields:
        Channel and line.
    """
    slant = slant_ranges(survey)
    reach, poses = float(slant[-1]), np.concatenate([survey.position, np.unwrap(survey.attitude, axis=0)], axis=1)
    ends = [poses[[max(number - 1, 0), number]].mean(axis=0), poses[[number, min(number + 1, len(poses) - 1)]].mean(0)]
    turn = abs(ends[1][3:5] - ends[0][3:5]).sum()
    count = max(int(np.ceil((np.linalg.norm(ends[1][:2] - ends[0][:2]) + reach * turn) / (FINENESS * pixel))), 1)
    for share in (np.arange(count) + 0.5) / count:
        pose = ends[0] + share * (ends[1] - ends[0])
        channel = 0
        for sonar in survey.scenario.sonar.side_sonars:
            for steer in np.asarray(survey.recording["steer"].values)[channel : channel + sonar.beam_count]:
                yield channel, _line(survey, sonar, float(steer), pose, (slant, FINENESS * pixel))
                channel += 1


def ground_line(survey: Survey, number: int, channel: int, cell: float) -> GroundLine:
    """Ground line of one channel at one ping; cell k extends from k to k + 1 sizes of horizontal distance.

    Args:
        survey: Recording of beams that look to a side.
        number: Number within the recorded pings.
        channel: Row of the channel.
        cell: Size of the cells [m].
    """
    sides = survey.scenario.sonar.side_sonars
    sonar = sides[channel // sides[0].beam_count]
    pose = np.concatenate([survey.position[number], survey.attitude[number]])
    return _line(survey, sonar, float(survey.recording["steer"].values[channel]), pose, (slant_ranges(survey), cell))


def looks_sideways(survey: Survey) -> bool:
    """Return True for a sonar that looks to a side instead of up, down or ahead."""
    mounting = survey.scenario.sonar.mounting
    return bool(abs(np.cos(mounting.tilt) * np.sin(mounting.bearing)) >= LEAST_ACROSS)


def require_sideways(survey: Survey) -> None:
    """Refuse a sonar that looks up, down or ahead instead of to a side."""
    survey.require_beams("a mosaic")
    if survey.recording.sizes["time"] < 2:
        raise StoreError(f"{survey.name} has one sample a ping, which has no neighbour in range. Simulate a longer "
                         "track.window")  # fmt: skip
    if not looks_sideways(survey):
        raise StoreError(
            f"{survey.name}: a mosaic is made of lines across the track, and this sonar does not look to a "
            "side. Export its soundings (.csv) or its picture (.png)"
        )


def _line(survey: Survey, sonar: Sonar, steer: float, pose: Floats, grid: tuple[Floats, float]) -> GroundLine:
    """Ground line of one beam at one pose, for slant ranges of samples and a size of cells."""
    slant, cell = grid
    body = pose_rotation(*pose[3:])
    boresight, right, _ = array_rotation(sonar, body)
    centre = array_position(sonar.receive, pose[:3], body)
    outward = boresight[:2] / np.hypot(*boresight[:2])
    along = np.array([-outward[1], outward[0]])
    across = np.arange(int(slant[-1] / cell) + 2) * cell
    forward = np.zeros_like(across)
    for _ in range(STEPS):
        north, east = (centre[axis] + across * outward[axis] + forward * along[axis] for axis in (0, 1))
        below = survey.bed_depth(north, east) - centre[2]
        distance = np.sqrt(across**2 + forward**2 + below**2)
        rest = np.sin(steer) * distance - across * (outward @ right[:2]) - below * right[2]
        forward = rest / (along @ right[:2])
    edges = (distance - slant[0]) / (slant[1] - slant[0]) + 0.5
    return GroundLine((north[:-1] + north[1:]) / 2, (east[:-1] + east[1:]) / 2, edges)
