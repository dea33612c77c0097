"""When an echo reaches an element of an array that may be under way, and what its way there makes of it.

A leg is known at the array's centre, at the start of the ping. Over the array, and over the way that it goes until the
echo comes, the wavefront is a sphere about the leg's image source: the distance to an element at d from the centre is
|r u - d|, with u the leg's direction away from the sonar and r its radius, so that

    r' - r = (|d|^2 - 2 r u . d) / (|r u - d| + r)

without a difference of two nearly equal numbers. It is exact in water of one sound speed. Where rays bend, the
wavefront has a curvature of its own in the vertical plane, and the gradient at the array adds a term
(`arrival_refracted`).
Before that, `transmit_moving` tells what a transmitter that is under way makes of what it sends. Plain numbers and
arrays.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
CLOSEST = 0.01
"""Distance below which the sphere about a scatterer grows no louder [m]."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def transmitter_motion_of_leg(
    north: float,
    east: float,
    down: float,
    wavefront_radius: float,
    velocity: Floats,
    pulse_middle: float,
    slowness: float,
) -> tuple[float, float, float]:
    """What `transmit_moving` tells of one leg: how much later, how fast it is followed, how much louder."""
    x = wavefront_radius * north - pulse_middle * velocity[0]
    y = wavefront_radius * east - pulse_middle * velocity[1]
    z = wavefront_radius * down - pulse_middle * velocity[2]
    left = max(math.sqrt(x * x + y * y + z * z), CLOSEST)
    once = 1 / left
    leaving = (x * velocity[0] + y * velocity[1] + z * velocity[2]) * once * slowness
    return pulse_middle + (left - wavefront_radius) * slowness, leaving, wavefront_radius * once


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def transmit_moving(
    departure: Floats, wavefront_radius: Floats, velocity: Floats, pulse_middle: float, slowness: float,
    delay_change: Floats, transmitter_mach: Floats,
    amplitude_factor: Floats,
) -> None:  # fmt: skip
    """What is later for the pulse's middle than for its start, for a transmitter under way, and what else its way does.

    Args:
        departure: Directions in which the sound leaves, (n, 3).
        wavefront_radius: Radius of its wavefronts [m], (n,).
        velocity: Of the transmitter [m/s], (3,).
        pulse_middle: Time from the pulse's start to its middle [s].
        slowness: Of sound at the transmitter [s/m].
        delay_change: Result [s], (n,).
        transmitter_mach: Result, part of the speed of sound at which it follows what it sends [1], (n,).
        amplitude_factor: Result, by what its way changes the pressure [1], (n,).
    """
    for n in range(wavefront_radius.size):
        delay_change[n], transmitter_mach[n], amplitude_factor[n] = transmitter_motion_of_leg(
            departure[n, 0], departure[n, 1], departure[n, 2], wavefront_radius[n], velocity, pulse_middle, slowness
        )


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def direction_at_arrival(
    north: float,
    east: float,
    down: float,
    path_length: float,
    t: float,
    element_position: Floats,
    velocity: Floats,
    acceleration: Floats,
) -> tuple[float, float, float]:
    """What `turn_to_element` tells of one echo."""
    once = 1 / max(path_length, CLOSEST)
    x = north - once * (element_position[0] + t * (velocity[0] + t / 2 * acceleration[0]))
    y = east - once * (element_position[1] + t * (velocity[1] + t / 2 * acceleration[1]))
    z = down - once * (element_position[2] + t * (velocity[2] + t / 2 * acceleration[2]))
    scale = 1 / math.sqrt(x * x + y * y + z * z)
    return scale * x, scale * y, scale * z


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def turn_to_element(
    direction: Floats,
    path_length: Floats,
    arrival_time: Floats,
    element_position: Floats,
    velocity: Floats,
    acceleration: Floats,
    directions: Floats,
) -> None:
    """Directions in which an element sees echoes when they come.

    Args:
        direction: Directions to where they come from, from the array's centre at the start, (n, 3).
        path_length: Ways back [m], (n,).
        arrival_time: When they come [s], (n,).
        element_position: Of the element from the centre at the start, in the world [m], (3,).
        velocity: Of the element [m/s], (3,).
        acceleration: Likewise [m/s^2], (3,).
        directions: Result, (n, 3).
    """
    for n in range(path_length.size):
        directions[n, 0], directions[n, 1], directions[n, 2] = direction_at_arrival(
            direction[n, 0],
            direction[n, 1],
            direction[n, 2],
            path_length[n],
            arrival_time[n],
            element_position,
            velocity,
            acceleration,
        )


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def arrival_stationary(
    delay: Floats, radius: Floats, north: Floats, east: Floats, down: Floats, element_position: Floats, slowness: float,
    attenuation: float, arrival_time: Floats, spreading_ratio: NDArray[Any],
) -> None:  # fmt: skip
    """When echoes reach an element that stands still, and by what its distance changes their pressure.

    Args:
        delay: At the centre [s], (n,).
        radius: Of the wavefronts [m], (n,).
        north: Direction to where each comes from, away from the sonar, (n,).
        east: Likewise.
        down: Likewise.
        element_position: Of the element from the centre, in the world [m], (3,).
        slowness: Of sound at the array [s/m].
        attenuation: Part of the pressure that the water takes on a metre [1/m].
        arrival_time: Result [s], (n,).
        spreading_ratio: Result, spreading at the element over that at the centre [1], (n,).
    """
    x, y, z = element_position[0], element_position[1], element_position[2]
    square = x * x + y * y + z * z
    for i in range(delay.size):
        r = radius[i]
        part = square - 2 * r * (north[i] * x + east[i] * y + down[i] * z)
        there = max(math.sqrt(max(r * r + part, 0.0)), CLOSEST)
        both = there + r
        once = 1 / (both * there)  # one division for two: they are what takes the time
        farther = part * there * once
        arrival_time[i] = delay[i] + farther * slowness
        spreading_ratio[i] = np.float32(r * both * once * (1 - attenuation * farther))


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def arrival_moving(
    delay: Floats, radius: Floats, north: Floats, east: Floats, down: Floats, transmit_doppler: Floats,
    element_position: Floats,
    velocity: Floats, acceleration: Floats, slowness: float, attenuation: float, pulse_middle: float,
    arrival_time: Floats,
    spreading_ratio: NDArray[Any], doppler: Floats,
) -> None:  # fmt: skip
    """The same for an element under way: its place is that of the moment when the pulse's middle comes.

    Two Newton steps find that moment. Shapes are stretched about their middle, so an echo is where its middle is, less
    half of the pulse as it was sent.

    Args:
        delay: Of the pulse's middle at the centre, had it stayed, its sending included [s], (n,).
        radius: Likewise.
        north: Likewise.
        east: Likewise.
        down: Likewise.
        transmit_doppler: One over one less the part of the speed of sound at which the transmitter follows what it
            sends
            [1], (n,).
        element_position: Of the element from the centre, at the start of the ping [m], (3,).
        velocity: Of the element at the start of the ping [m/s], (3,).
        acceleration: Of the element [m/s^2], (3,).
        slowness: As of `arrival_stationary`.
        attenuation: Likewise.
        pulse_middle: Time from the pulse's start to its middle [s].
        arrival_time: As of `arrival_stationary`.
        spreading_ratio: Likewise.
        doppler: Result, d(emission) / d(arrival) - 1 [1], (n,).
    """
    for i in range(delay.size):
        r, u, v, w = radius[i], north[i], east[i], down[i]
        rate = 1 - (u * velocity[0] + v * velocity[1] + w * velocity[2]) * slowness  # a step's length may be inexact
        tau = delay[i]
        half = 0.5 * tau
        x = element_position[0] + tau * (velocity[0] + half * acceleration[0])
        y = element_position[1] + tau * (velocity[1] + half * acceleration[1])
        z = element_position[2] + tau * (velocity[2] + half * acceleration[2])
        part = x * x + y * y + z * z - 2 * r * (u * x + v * y + w * z)
        tau += part / (math.sqrt(max(r * r + part, 0.0)) + r) * slowness * rate
        half = 0.5 * tau
        x = element_position[0] + tau * (velocity[0] + half * acceleration[0])
        y = element_position[1] + tau * (velocity[1] + half * acceleration[1])
        z = element_position[2] + tau * (velocity[2] + half * acceleration[2])
        part = x * x + y * y + z * z - 2 * r * (u * x + v * y + w * z)
        there = max(math.sqrt(max(r * r + part, 0.0)), CLOSEST)
        both = there + r
        once = 1 / (both * there)
        closing = (
            (r * u - x) * (velocity[0] + tau * acceleration[0])
            + (r * v - y) * (velocity[1] + tau * acceleration[1])
            + (r * w - z) * (velocity[2] + tau * acceleration[2])
        ) * (both * once * slowness)
        farther = part * there * once
        tau += (delay[i] + farther * slowness - tau) * rate
        spreading_ratio[i] = np.float32(r * both * once * (1 - attenuation * farther))
        doppler[i] = (1 + closing) * transmit_doppler[i] - 1
        arrival_time[i] = tau - pulse_middle


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _beyond(expansion: Floats, i: int, x: float, z: float) -> tuple[float, float, float]:
    """Delay beyond the expansion [s], and its growth with x and z [s/m]: for an element x nearer and z deeper.

    The polynomial of `propagation.beside`.
    """
    level = expansion[0, i] + x * (expansion[3, i] + x * expansion[7, i])
    upright = expansion[2, i] + z * (expansion[6, i] + z * expansion[8, i])
    mixed = expansion[1, i] + x * expansion[4, i] + z * expansion[5, i]
    late = x * x * level + z * z * upright + x * z * mixed
    to_x = x * (2 * level + x * (expansion[3, i] + 2 * x * expansion[7, i])) + z * (mixed + x * expansion[4, i])
    to_z = z * (2 * upright + z * (expansion[6, i] + 2 * z * expansion[8, i])) + x * (mixed + z * expansion[5, i])
    return late, to_x, to_z


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def arrival_refracted(
    delay: Floats, vertical_curvature: Floats, horizontal_distance: Floats, north: Floats, east: Floats, down: Floats,
    transmit_doppler: Floats,
    expansion: Floats, element_position: Floats, velocity: Floats, acceleration: Floats, slowness: float,
    sound_speed_gradient: float,
    attenuation: float, pulse_middle: float, arrival_time: Floats, spreading_ratio: NDArray[Any], doppler: Floats,
) -> None:  # fmt: skip
    """The same where rays bend, for an element that may be under way; the expansion of `propagation.elements`.

    Args:
        delay: As of `arrival_moving`.
        vertical_curvature: Curvature of the wavefronts in the vertical plane [1/m], (n,).
        horizontal_distance: Horizontal distance to where each comes from [m], (n,).
        north: As of `arrival_stationary`.
        east: Likewise.
        down: Likewise.
        transmit_doppler: As of `arrival_moving`.
        expansion: What they have beyond this expansion, see `propagation.beside`, (terms, n); or (0, n).
        element_position: As of `arrival_moving`.
        velocity: Likewise.
        acceleration: Likewise.
        slowness: Likewise.
        sound_speed_gradient: Growth of the speed of sound with depth at the array [1/s].
        attenuation: As of `arrival_stationary`.
        pulse_middle: As of `arrival_moving`.
        arrival_time: Likewise.
        spreading_ratio: Likewise.
        doppler: Likewise.
    """
    half_gradient = 0.5 * sound_speed_gradient * slowness * slowness
    for i in range(delay.size):
        u, v, w, b, far = north[i], east[i], down[i], vertical_curvature[i], horizontal_distance[i]
        cosine = math.sqrt(max(u * u + v * v, 1e-30))
        level = 1 / cosine
        rate = 1 - (u * velocity[0] + v * velocity[1] + w * velocity[2]) * slowness
        tau, over, closing, later, louder = delay[i], 1.0, 0.0, 0.0, 0.0
        for _ in range(2):
            half = 0.5 * tau
            x = element_position[0] + tau * (velocity[0] + half * acceleration[0])
            y = element_position[1] + tau * (velocity[1] + half * acceleration[1])
            z = element_position[2] + tau * (velocity[2] + half * acceleration[2])
            ahead, square = (x * u + y * v) * level, x * x + y * y
            # How much closer the element is over ground, without a difference of nearly equal numbers.
            closer = 2 * far * ahead - square
            closer /= far + math.sqrt(max(far * far - closer, 0.0))
            along, aside = closer * cosine + z * w, z * cosine - closer * w
            square = closer * closer + z * z
            root = max(math.sqrt(max(1 - 2 * b * along + b * b * square, 0.0)), 1e-3)
            once = 1 / ((1 + root) * root)
            over = (1 + root) * once
            later = (b * square - 2 * along) * root * once * slowness
            later += half_gradient * (w * along * along + 2 * cosine * along * aside)
            turn, tilt = 2 * half_gradient * (w * along + cosine * aside), 2 * half_gradient * cosine * along
            to_x = (b * closer - cosine) * over * slowness + turn * cosine - tilt * w
            to_z = (b * z - w) * over * slowness + turn * w + tilt * cosine
            if expansion.shape[0]:
                beyond, more_x, more_z = _beyond(expansion, i, closer, z)
                later, to_x, to_z = later + beyond, to_x + more_x, to_z + more_z
                louder = closer * (expansion[9, i] + closer * expansion[11, i]) + z * (
                    expansion[10, i] + z * expansion[12, i]
                )
            v_north, v_east = velocity[0] + tau * acceleration[0], velocity[1] + tau * acceleration[1]
            nearing = ((far * level * u - x) * v_north + (far * level * v - y) * v_east) / max(far - closer, 1e-9)
            closing = -(to_x * nearing + to_z * (velocity[2] + tau * acceleration[2]))
            tau += (delay[i] + later - tau) * rate
        spreading_ratio[i] = np.float32(over * (1 + louder * (1 + 0.5 * louder)) * (1 - attenuation * later / slowness))
        doppler[i] = (1 + closing) * transmit_doppler[i] - 1
        arrival_time[i] = tau - pulse_middle
