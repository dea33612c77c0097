"""Fans of beams in the frame of marine_acoustic_msgs: z along boresight, y to starboard or to the right, x along track.

x is forward for a sonar that looks down, and up for one that looks ahead or to a side. Frames of ROS (REP 103) are
right handed: a platform has x forward, y to port, z up, and the map x east, y north, z up.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.frames import mounting_rotation, pose_rotation
from insonify.scenario.scenario import Scenario
from insonify.sonar.aperture import pattern
from insonify.sonar.array import LineArray, PlanarArray
from insonify.sonar.beam import Beams, beams
from insonify.sonar.hydrophones import element_layout, single_element
from insonify.sonar.sonar import Sonar, receiver_mounting
from insonify.units import level_db

Floats = NDArray[np.float64]

PLATFORM = np.diag([1.0, -1.0, -1.0])
"""Forward, starboard, down to forward, port, up, and back."""
MAP = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""North, east, down to east, north, up, and back."""
DOWNWARD = np.radians(80)
"""Tilt from which the angles from nadir of a beam pattern lie across the track [rad]."""
SHADING = "hamming"
"""Shading of the beams of a swath."""
FLOOR = 1e-6
"""Least amplitude of a beam pattern [1]."""


@dataclass(frozen=True, slots=True)
class Fan:
    """Beams of one side of a sonar, with their geometry and patterns."""

    name: str
    """Empty, "port" or "starboard"."""
    channels: slice
    """Its channels in the recording."""
    axes: Floats
    """Axes x, y, z as columns, forward, starboard, down [1], shape (3, 3)."""
    position: Floats
    """Centre of the receive array, forward, starboard, down from the platform's reference point [m], shape (3,)."""
    direction: Floats
    """Unit vectors of the receive beams along x, y, z [1], shape (beam, 3)."""
    transmit_angle: Floats
    """Elevation of the transmit beams from the plane of y and z towards x [rad], shape (beam,)."""
    transmit_width: Floats
    """Widths of the transmit beams at -3 dB towards x [rad], shape (beam,)."""
    receive_width: Floats
    """Widths of the receive beams at -3 dB towards y [rad], shape (beam,)."""
    pattern: tuple[Floats, Floats]
    """Angles from nadir [deg] and combined gain of transmitter and receiver [dB], each of shape (angle,)."""

    @property
    def frame(self) -> str:
        """Name of the frame."""
        return f"sonar_{self.name}" if self.name else "sonar"

    @property
    def topic(self) -> str:
        """Start of the names of its topics."""
        return f"/sonar/{self.name}" if self.name else "/sonar"

    @property
    def receive_angle(self) -> Floats:
        """Elevation of the receive beams from the plane of x and z towards y [rad], shape (beam,)."""
        return np.arcsin(self.direction[:, 1])

    @property
    def rotation(self) -> Floats:
        """Axes as columns, forward, port, up [1], shape (3, 3)."""
        return PLATFORM @ self.axes


def fans(scenario: Scenario) -> list[Fan]:
    """Fans of a recording of beams, one for each side."""
    names = scenario.sonar.sides or ("",)
    messages, first = [], 0
    for name, side in zip(names, scenario.sonar.side_sonars, strict=True):
        messages.append(_fan(scenario, side, name, slice(first, first + side.beam_count)))
        first += side.beam_count
    return messages


def swath_fan(scenario: Scenario, position: Floats, angle: Floats) -> Fan:
    """Fan of beams that a multibeam forms across the track: x forward, y to starboard, z down.

    Args:
        scenario: Its scenario.
        position: Centre of the receive array: forward, starboard, down [m], shape (3,).
        angle: Angles of the beams to starboard of z [rad], shape (beam,).
    """
    sonar, speed, count = scenario.sonar, scenario.water.sound_speed, angle.size
    faces = mounting_rotation(sonar.mounting.bearing, sonar.mounting.tilt)
    transmit = beams(sonar.beam_arrays[0], sonar.pulse.frequency, speed)
    across = (element_layout(sonar.receive)[0] @ mounting_rotation(*_faces(sonar)))[:, 1]
    length = float(np.ptp(across)) * across.size / (across.size - 1)
    sine = np.linspace(0, 2, 20_001) / (length * sonar.pulse.frequency / speed)
    gain = pattern(sine * length * sonar.pulse.frequency / speed, SHADING, across.size)[0]
    half = sine[int(np.argmax(np.abs(gain) < np.sqrt(0.5)))]
    width = np.arcsin(np.minimum(np.sin(angle) + half, 1)) - np.arcsin(np.maximum(np.sin(angle) - half, -1))
    nadir, ray = _across(sonar)
    elements: Floats = np.ones((1, nadir.size))
    if isinstance(sonar.receive, LineArray | PlanarArray):
        elements = beams(single_element(sonar.receive), sonar.pulse.frequency, speed).gain(ray @ mounting_rotation(
            *_faces(sonar)).T)  # fmt: skip
    return Fan(
        "", slice(None), np.eye(3), position, np.stack([np.zeros(count), np.sin(angle), np.cos(angle)], axis=1),
        np.zeros(count), np.full(count, half_power_width(transmit, 0, faces @ np.array([1.0, 0.0, 0.0]))), width,
        (np.degrees(nadir), _decibels(transmit.gain(ray @ faces.T) * elements)),
    )  # fmt: skip


def half_power_width(formed: Beams, channel: int, towards: ArrayLike) -> float:
    """Width of a beam at -3 dB in the plane of its axis and another direction [rad], 2 pi where it has no limit.

    Args:
        formed: Beams in the frame of their array: boresight, right, down.
        channel: Number of the beam.
        towards: The other direction [1], shape (3,).
    """
    beam = formed.single_beam(channel)
    right, down = beam.steer[0]
    axis = np.array([np.sqrt(max(1 - right**2 - down**2, 0.0)), right, down])
    side = np.asarray(towards, float) - axis * (axis @ np.asarray(towards, float))
    turn = np.concatenate([[0.0], np.geomspace(1e-5, np.pi, 4000)])
    width = 0.0
    for sense in (1, -1):
        rays = np.cos(turn)[:, None] * axis + sense * np.sin(turn)[:, None] * side / np.linalg.norm(side)
        below = np.abs(beam.gain(rays)[0]) - np.sqrt(0.5)
        crossing = int(np.argmax(below < 0))
        width += (
            np.interp(0.0, -below[crossing - 1 : crossing + 1], turn[crossing - 1 : crossing + 1])
            if crossing
            else np.pi
        )
    return float(width)


def east_north_up(position: Floats) -> Floats:
    """East, north, up of positions north, east, down [m], shape (..., 3)."""
    return position @ MAP


def map_rotation(attitude: Floats) -> Floats:
    """Forward, port, up of a platform as columns, east, north, up [1], shape (3, 3).

    Args:
        attitude: Heading, pitch, roll [rad], shape (3,).
    """
    return np.asarray(MAP @ pose_rotation(*attitude) @ PLATFORM)


def _fan(scenario: Scenario, side: Sonar, name: str, channels: slice) -> Fan:
    """Fan of one side."""
    transmit, receive = (beams(array, side.pulse.frequency, scenario.water.sound_speed) for array in side.beam_arrays)
    ahead, right, down = mounting_rotation(*_faces(side))
    sent, received = (np.broadcast_to(end.steer, (side.beam_count, 2)) for end in (transmit, receive))
    ray = np.stack([-received[:, 1], received[:, 0], np.sqrt(np.maximum(1 - (received**2).sum(axis=1), 0))], axis=1)
    transmit_width, receive_width = (
        np.broadcast_to([half_power_width(end, beam, towards) for beam in range(end.channel_count)], side.beam_count)
        for end, towards in ((transmit, (0.0, 0.0, -1.0)), (receive, (0.0, 1.0, 0.0)))
    )
    nadir, rays = _across(side)
    gain = transmit.gain(rays @ mounting_rotation(side.mounting.bearing, side.mounting.tilt).T)
    gain = gain * receive.gain(rays @ np.stack([ahead, right, down]).T)
    return Fan(
        name, channels, np.stack([-down, right, ahead], axis=1), np.asarray(side.receive.offset, float), ray,
        np.arcsin(-sent[:, 1]), transmit_width, receive_width, (np.degrees(nadir), _decibels(gain)),
    )  # fmt: skip


def _faces(sonar: Sonar) -> tuple[float, float]:
    """Bearing and tilt of the receive array [rad]."""
    mounting = receiver_mounting(sonar)
    return mounting.bearing, mounting.tilt


def _across(sonar: Sonar) -> tuple[Floats, Floats]:
    """Angles from nadir [rad], and rays in the vertical plane of boresight, or across the track, shape (angle, 3)."""
    nadir = np.radians(np.arange(91.0))
    bearing, tilt = _faces(sonar)
    out = bearing + (np.pi / 2 if tilt > DOWNWARD else 0.0)
    level = np.array([np.cos(out), np.sin(out), 0.0])
    return nadir, np.sin(nadir)[:, None] * level + np.cos(nadir)[:, None] * np.array([0.0, 0.0, 1.0])


def _decibels(gain: Floats) -> Floats:
    """Largest of the beams at each angle [dB], shape (angle,)."""
    return np.asarray(level_db(np.maximum(np.abs(gain).max(axis=0), FLOOR) ** 2))
