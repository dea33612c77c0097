"""Selection of scatterers whose echoes can fall into an interval of delays; paths to others are not evaluated."""

import numpy as np
from numpy.typing import NDArray

from insonify.engines.face_reflection import faces_in_reach
from insonify.propagation.families import bounce_count, image_depth
from insonify.propagation.path_settings import PathSettings
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.sonar.ping_geometry import PingGeometry
from insonify.units import si
from insonify.validity import require_number

DelayInterval = tuple[float | str, float | str]
"""First and last of some times [s], or with their units: "200 ms"."""
MIN_TRAVEL_TIME_RATIO, MAX_TRAVEL_TIME_RATIO = 0.99, 1.1
"""Least and greatest travel time re that of the straight ray to the image, in refracting or inhomogeneous water [1]."""
BOUNCE_EXCESS_LENGTH = 2.0
"""Increase of a path's length by each reflection at waves or slopes, beyond the height of the relief [m]."""


def delay_interval(ping_geometry: PingGeometry, window: DelayInterval | None) -> tuple[float, float]:
    """First and last delay of an interval of echoes [s]; all that touch the recording by default.

    Raises:
        ValueError: The interval is empty, or lies beyond all that touches the recording: then often in milliseconds.
    """
    earliest, latest = ping_geometry.recorded_delays
    if window is None:
        return earliest, latest
    if isinstance(window, str) or len(window) != 2:
        raise ValueError(f"window is {window!r}; give the first and the last delay, such as (0.2, 0.201) [s]")
    first, last = (require_number("window", si(end, "time"), "s", example="(0.2, 0.201)") for end in window)
    if first > last:
        raise ValueError(f"window is {window!r}, which ends before it begins; exchange the two")
    if last < earliest or first > latest:
        recorded = f"{max(earliest, 0.0) * 1e3:.6g} to {latest * 1e3:.6g} ms"
        meant = first > latest and earliest <= last / 1e3 and first / 1e3 <= latest
        hint = f"Did you mean ('{first:g} ms', '{last:g} ms')?" if meant else "Give a part of that."
        raise ValueError(
            f"window is {first:g} to {last:g} s, and delays that touch the recording are {recorded}. {hint}"
        )
    return first, last


def in_delay_window(
    scatterers: Scatterers, ping_geometry: PingGeometry, scene: Scene, path_settings: PathSettings,
    window: tuple[float, float],
) -> NDArray[np.bool_]:  # fmt: skip
    """True for scatterers of which some pair may fall into an interval of delays.

    Args:
        scatterers: The points, n of them.
        ping_geometry: The sonar at this ping.
        scene: Water and boundaries.
        path_settings: Path settings.
        window: First and last delay [s].

    Returns:
        Shape (n,); True for all of a body that reflects as a whole.
    """
    if not scatterers.has_random_phase:
        return np.ones(len(scatterers), bool)
    terrain = scene.seabed.terrain
    rise = 0.0 if terrain is None else max(terrain.depth - terrain.span[0], terrain.span[1] - terrain.depth)
    faces = faces_in_reach(scene, path_settings, ping_geometry)
    nearest, farthest = np.zeros((2, len(scatterers)))
    for position in (ping_geometry.transmit_position, ping_geometry.receive_position):
        flat = np.linalg.norm(scatterers.position[:, :2] - position[:2], axis=1)
        longest = np.zeros(len(scatterers))
        for family in path_settings.followed_families:
            down = scatterers.position[:, 2] - image_depth(family, float(position[2]), scene.seabed.depth)
            bounces = bounce_count(family)
            np.maximum(longest, np.hypot(flat, down) + 2 * bounces * (rise + BOUNCE_EXCESS_LENGTH), out=longest)
        longest += 2 * max((max(float(face.signed_distance(position)), 0.0) for face in faces), default=0.0)
        nearest += np.linalg.norm(scatterers.position - position, axis=1)
        farthest += longest
    earliest = MIN_TRAVEL_TIME_RATIO * nearest / scene.water.max_sound_speed - ping_geometry.delay_margin
    latest = MAX_TRAVEL_TIME_RATIO * farthest / scene.water.min_sound_speed + ping_geometry.delay_margin
    return np.asarray((earliest <= window[1]) & (latest >= window[0]))
