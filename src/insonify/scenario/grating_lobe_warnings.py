"""Warnings on elements so far apart that beams have grating lobes: beams that are recorded, or formed of elements."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.beam import beams, grating_lobes

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

Floats = NDArray[np.float64]
Transducers = LineArray | PlanarArray | PointTransducer

FARTHEST_STEER = np.radians(75)
"""Largest angle of a beam that may be formed of recorded elements [rad]."""
_BEARINGS = 301
LEVEL = 1e-9
"""Cosine to the array's down below which a lobe lies in the plane of the beams [1]."""


def grating_lobe_warnings(scenario: ScenarioParts, sound_speed: float) -> Iterator[str]:
    """Warnings on the arrays of a sonar.

    Args:
        scenario: The scenario.
        sound_speed: Least sound speed at the sonar [m/s]: where waves are shortest, lobes are nearest.
    """
    sonar = scenario.sonar
    for end, array in zip(("transmit", "receive"), sonar.beam_arrays, strict=False):
        yield _of_beams(end, array, sonar.pulse.frequency, sound_speed)
    if sonar.receiver.record == "elements" and isinstance(sonar.receive, LineArray | PlanarArray):
        if sonar.receive.steer is not None:
            yield _of_beams("receive", sonar.receive, sonar.pulse.frequency, sound_speed)
        else:
            yield _of_elements(sonar.receive, sonar.channel_arrays, sonar.pulse.frequency, sound_speed)


def _of_beams(end: str, array: Transducers, frequency: float, sound_speed: float) -> str:
    """Warning on steered beams with grating lobes; empty where they have none."""
    if not len(grating_lobes(array, frequency, sound_speed)):
        return ""
    steers = array.steers
    lobes = [grating_lobes(array.steered((steer,)), frequency, sound_speed) for steer in steers]
    asides = [_nearest(steer, replicas) for steer, replicas in zip(steers, lobes, strict=True) if len(replicas)]
    return (
        f"sonar.{end}: grating lobes in {len(asides)} of {len(steers)} beams; the nearest stands "
        f"{np.degrees(min(asides)):.1f} deg from its beam. The elements are more than half a wavelength apart: "
        "give more elements, or steer less."
    )


def _of_elements(
    array: LineArray | PlanarArray, channels: tuple[Transducers, ...], frequency: float, sound_speed: float
) -> str:
    """Warning on recorded elements of which beams towards two insonified directions are the same; empty without.

    Args:
        array: Receive array.
        channels: Transmit array and one element.
        frequency: Frequency [Hz].
        sound_speed: Sound speed at the array [m/s].
    """
    bearing = np.linspace(-FARTHEST_STEER, FARTHEST_STEER, _BEARINGS)
    inside = bearing[_insonified(channels, np.sin(bearing), frequency, sound_speed)]
    first, last = np.sin(inside[[0, -1]]).tolist()
    replicas = grating_lobes(array.steered(((float(inside[-1]), 0.0),)), frequency, sound_speed)
    across = replicas[np.abs(replicas[:, 1]) < LEVEL, 0]  # of a panel: those in the plane of its beams
    if not np.any((across >= first) & (across < last)):
        return ""
    wavelength, width = sound_speed / frequency, last - first
    count, length = (array.elements, array.length) if isinstance(array, LineArray) else (array.columns, array.width)
    return (
        f"sonar.receive: the elements are {length / (count or 1) / wavelength:.2f} wavelengths apart, and beams formed "
        f"of them have grating lobes within the {np.degrees(inside[0]):.0f} to {np.degrees(inside[-1]):.0f} deg that "
        "are insonified and received: an echo has a second bearing. Give at least "
        f"{int(np.ceil(length * width / wavelength))} elements, a narrower transmitter, or sonar.receive.steer with "
        "the beams that will be formed."
    )


def _insonified(
    channels: tuple[Transducers, ...], across: Floats, frequency: float, sound_speed: float
) -> NDArray[np.bool_]:
    """True for directions of at least half the largest power of transmitter and element together.

    Args:
        channels: Transmit array and one element.
        across: Cosines of the directions to the array's right [1], shape (n,).
        frequency: Frequency [Hz].
        sound_speed: Sound speed at the arrays [m/s].
    """
    directions = np.stack([np.sqrt(1 - across**2), across, np.zeros_like(across)], axis=-1)
    gains = [np.abs(beams(one, frequency, sound_speed).gain(directions)).max(axis=0) for one in channels]
    power = np.prod(gains, axis=0) ** 2
    return np.asarray(power >= power.max() / 2)


def _nearest(steer: tuple[float, float], replicas: Floats) -> float:
    """Angle from a beam to the nearest of its replicas [rad], given by cosines to right and down, shape (n, 2)."""
    right, down = steer
    axis = np.array([np.cos(down) * np.cos(right), np.cos(down) * np.sin(right), np.sin(down)])
    front = np.sqrt(np.clip(1 - np.sum(replicas**2, axis=1), 0, None))
    return float(np.arccos(np.clip(np.column_stack([front, replicas]) @ axis, -1, 1)).min())
