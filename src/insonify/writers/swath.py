"""Swaths of a multibeam: beams, detections and refracted soundings of each ping, as a survey system computes them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.demos.products import product_kind
from insonify.demos.products.forward_looking import compressed
from insonify.demos.products.multibeam import BEAMS, WIDEST
from insonify.formats.store_description import StoreError
from insonify.frames import direction, pose_rotation
from insonify.processing import beam_recording, multibeam_soundings, recorded_level
from insonify.processing.recorded_geometry import recorded_element_positions, recorded_transmitter_position
from insonify.surveys.survey import Survey

Floats = NDArray[np.float64]

LAYERS = 2000
"""Layers of constant sound speed between the surface and the deepest bed [1]."""
DEEPER = 1.3
"""Depth of the profile re the deepest bed under the track [1]."""


@dataclass(frozen=True, slots=True)
class Swath:
    """One ping: arrays over its beams, from port to starboard, those without a detection NaN."""

    angle: Floats
    """Angle of the beams re the array, to starboard [rad]."""
    vertical_angle: Floats
    """Angle of the beams re vertical, to starboard [rad]."""
    travel_time: Floats
    """Two-way travel time [s]."""
    deviation: Floats
    """Its standard deviation [s]."""
    by_phase: NDArray[np.bool_]
    """True for detections by phase."""
    sounding: Floats
    """Position re the reference point, forward, starboard (both horizontal), down [m], shape (beam, 3)."""
    level: Floats
    """Level of the beams [dB re 1 uPa], shape (beam, time)."""


@dataclass(frozen=True, slots=True)
class Arrays:
    """Transmitter and receiver on the platform: forward, starboard, down [m], shape (3,)."""

    transmitter: Floats
    receiver: Floats


def arrays(survey: Survey) -> Arrays:
    """Positions of the arrays of a multibeam.

    Raises:
        StoreError: The recording is not one of a multibeam's elements.
    """
    if product_kind(survey.scenario) != "multibeam":
        raise StoreError(f"{survey.name}: KMALL holds the swaths of a multibeam with record: elements, and this is "
                         "none. See insonify new --template multibeam")  # fmt: skip
    transmitter = recorded_transmitter_position(survey.recording, survey.scenario.sonar.transmit.offset)
    return Arrays(transmitter, recorded_element_positions(survey.recording).mean(axis=0))


def attitude_at(survey: Survey, time: Floats) -> Floats:
    """Logged heading, pitch, roll, and depth of the platform at times, between pings and behind the last one.

    Args:
        survey: The survey.
        time: Times [s since 1970], shape (n,).

    Returns:
        Radians and metres, shape (n, 4).
    """
    known = np.concatenate([np.unwrap(survey.attitude, axis=0), survey.position[:, 2:]], axis=1)
    known, when = np.concatenate([known, known[-1:]]), np.append(survey.time, survey.time[-1] + _pause(survey))
    if survey.rows.size > 1:
        known[-1] = 2 * known[-2] - known[-3]
    return np.stack([np.interp(time, when, column) for column in known.T], axis=-1)


def attitude_times(survey: Survey) -> Floats:
    """Times at which the attitude is known: each ping, and one interval behind the last [s since 1970]."""
    return np.append(survey.time, survey.time[-1] + _pause(survey))


def _pause(survey: Survey) -> float:
    return survey.ping_interval or 1.0


def profile(survey: Survey) -> tuple[Floats, Floats]:
    """Depths and sound speeds of the water, down to below the bed [m], [m/s]; two points where it is constant."""
    deepest = DEEPER * float(np.nanmax(survey.altitude + survey.position[:, 2]))
    depth = np.linspace(0.0, deepest, 201 if survey.scenario.water.layered else 2)
    return depth, np.asarray(survey.scenario.water.sound_speed_at(depth), float)


def surface_speed(survey: Survey, number: int) -> float:
    """Sound speed at the receiver in one ping [m/s]."""
    return float(survey.scenario.water.sound_speed_at(survey.position[number, 2] + arrays(survey).receiver[2]))


def swaths(survey: Survey) -> Iterator[Swath]:
    """Swaths of all recorded pings, one after the other."""
    arms = arrays(survey)
    depth, speed = profile(survey)
    angle = np.linspace(-WIDEST, WIDEST, BEAMS)
    fan = direction(np.pi / 2, np.pi / 2 - angle)
    for number, row in enumerate(survey.rows):
        ping = compressed(survey.recording.isel(ping=[int(row)]).load(), survey.scenario)
        local = surface_speed(survey, number)
        soundings = multibeam_soundings(
            ping, angle, sound_speed=local, transmitter_position=arms.transmitter
        ).isel(ping=0)  # fmt: skip
        beams = beam_recording(ping, np.full(angle.size, np.pi / 2), elevation=np.pi / 2 - angle, sound_speed=local,
                               shading="hamming")  # fmt: skip
        time = np.asarray(soundings["travel_time"].values, float)
        sounding, vertical = _refracted(survey, number, time, (arms, fan), (depth, speed))
        yield Swath(
            angle, vertical, time, np.asarray(soundings["deviation"].values, float), soundings["by_phase"].values,
            sounding, np.asarray(recorded_level(beams).values[0], float),
        )  # fmt: skip


def _refracted(
    survey: Survey, number: int, time: Floats, sonar: tuple[Arrays, Floats], water: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """Soundings of one ping re the reference point [m], and angles of its beams re vertical, to starboard [rad].

    Beams have the heading and the pitch of the transmission and the roll of the reception. Rays start midway between
    transmitter and receiver, which for their distance far below the range is as long as the two legs.
    """
    arms, fan = sonar
    sent = attitude_at(survey, survey.time[number : number + 1])[0]
    waits = 0.0 if survey.scenario.track.stop_and_hop else np.nan_to_num(time)
    roll = attitude_at(survey, survey.time[number] + waits * np.ones(time.size))[:, 2]
    level = pose_rotation(np.zeros(time.size), sent[1], roll)
    middle = (arms.transmitter + arms.receiver) / 2
    reach = (arms.receiver - middle) + fan * np.nan_to_num(time, nan=1e-3)[:, None] * water[1].mean() / 2
    aim = np.einsum("bij,bj->bi", level, reach / np.linalg.norm(reach, axis=1)[:, None])
    start = np.einsum("bij,j->bi", level, middle)
    across, down = refracted_rays(time / 2, np.arccos(aim[:, 2]), survey.position[number, 2] + start[:, 2], water)
    flat = aim[:, :2] / np.maximum(np.hypot(*aim[:, :2].T), 1e-12)[:, None]
    sounding = np.concatenate([start[:, :2] + flat * across[:, None], (start[:, 2] + down)[:, None]], axis=1)
    return sounding, np.arctan2(aim[:, 1], aim[:, 2])


def refracted_rays(time: Floats, angle: Floats, depth: Floats, water: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Ends of downward rays in layered water by Snell's law through thin layers.

    Args:
        time: One-way travel time [s], shape (n,); NaN gives NaN.
        angle: Angle re vertical at the start [rad], shape (n,).
        depth: Depth of the start [m], shape (n,).
        water: Depths [m] and sound speeds [m/s] of the profile, linear in between.

    Returns:
        Horizontal distance and distance down from the start [m], each of shape (n,).
    """
    far, below = np.full(time.size, np.nan), np.full(time.size, np.nan)
    for ray in np.flatnonzero(np.isfinite(time)):
        edges = np.linspace(depth[ray], water[0][-1], LAYERS + 1)
        speed = np.interp((edges[1:] + edges[:-1]) / 2, *water)
        start = float(np.interp(depth[ray], *water))
        sine = np.minimum(np.sin(angle[ray]) / start * speed, 1 - 1e-12)
        cosine = np.sqrt(1 - sine**2)
        step = np.diff(edges)
        clock = np.concatenate([[0.0], np.cumsum(step / (speed * cosine))])
        run = np.concatenate([[0.0], np.cumsum(step * sine / cosine)])
        beyond = max(float(time[ray]) - clock[-1], 0.0) * speed[-1]  # below the profile its last speed holds on
        far[ray] = np.interp(time[ray], clock, run) + beyond * sine[-1]
        below[ray] = np.interp(time[ray], clock, edges) - depth[ray] + beyond * cosine[-1]
    return far, below
