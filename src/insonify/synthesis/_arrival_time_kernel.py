"""Time of arrival and spreading of an echo at an element of an array, which may be moving.

A leg is given at the array's centre, at the start of the ping. Over the array, and over its displacement until the
echo arrives, the wavefront is a sphere about the leg's image source: the distance to an element at d from the centre is
|r u - d|, with u the leg's direction away from the sonar and r its radius, so that

    r' - r = (|d|^2 - 2 r u . d) / (|r u - d| + r)

without a difference of two nearly equal numbers. It is exact in water of one sound speed. In layered water the
wavefront has its own curvature in the vertical plane, and the gradient at the array adds a term
(`arrival_refracted`).
`transmit_moving` gives the effects of a moving transmitter on the transmitted sound. Plain numbers and
arrays.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
CLOSEST = 0.01
"""Distance below which the pressure of a sphere about a scatterer grows no further [m]."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class ArrivalColumns(NamedTuple):
    """Echoes at an array's centre, n or more."""

    delay: Floats
    """Time at which the pulse's middle (sonar at rest: its start) would reach an array centre at rest [s], (n,)."""
    vertical_curvature: Floats
    """Curvature of the wavefronts in the vertical plane [1/m], (n,)."""
    radius: Floats
    """Radius of the wavefronts [m], (n,)."""
    horizontal_distance: Floats
    """Horizontal distance of each scatterer [m], (n,); needed in layered water only."""
    north: Floats
    """North component of the unit vector from the receiver towards the arriving sound [1], (n,)."""
    east: Floats
    """East component of that vector [1], (n,)."""
    down: Floats
    """Down component of that vector [1], (n,)."""
    transmit_doppler: Floats
    """1 / (1 - radial Mach number of the transmitter towards the departing sound) [1], (n,)."""
    expansion: Floats
    """Deviation from spherical wavefronts, see `propagation.aperture_expansion`, (terms, n); or (0, n)."""


class ElementMotion(NamedTuple):
    """Motion of an element from the start of the ping."""

    position: Floats
    """Position from the array's centre, in the world [m], (3,)."""
    velocity: Floats
    """Velocity [m/s], (3,)."""
    acceleration: Floats
    """Acceleration [m/s^2], (3,)."""


class ArrayWater(NamedTuple):
    """Water at a receiving array, and the instant of the pulse that is timed."""

    slowness: float
    """Slowness of sound [s/m]."""
    sound_speed_gradient: float
    """Growth of the speed of sound with depth [1/s]."""
    attenuation: float
    """Absorption [Np/m]."""
    is_layered: bool
    """True in layered water."""
    pulse_middle: float
    """Time from the pulse's start to its middle; 0 for a sonar at rest [s]."""


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def transmitter_motion_of_leg(
    north: float, east: float, down: float, wavefront_radius: float, velocity: Floats, pulse_middle: float,
    slowness: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Emission delay, radial Mach number and pressure ratio of one leg, as in `transmit_moving`.

    A leg without length is that of a boundary echo, whose wavefront is plane over the motion during the pulse.
    """
    if wavefront_radius == 0.0:
        radial = (north * velocity[0] + east * velocity[1] + down * velocity[2]) * slowness
        return pulse_middle * (1 - radial), radial, 1.0
    x = wavefront_radius * north - pulse_middle * velocity[0]
    y = wavefront_radius * east - pulse_middle * velocity[1]
    z = wavefront_radius * down - pulse_middle * velocity[2]
    distance = max(math.sqrt(x * x + y * y + z * z), CLOSEST)
    inverse = 1 / distance
    mach = (x * velocity[0] + y * velocity[1] + z * velocity[2]) * inverse * slowness
    return pulse_middle + (distance - wavefront_radius) * slowness, mach, wavefront_radius * inverse


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def transmit_moving(
    departure: Floats, wavefront_radius: Floats, velocity: Floats, pulse_middle: float, slowness: float,
    emission_delay: Floats, transmitter_mach: Floats, amplitude_factor: Floats,
) -> None:  # fmt: skip
    """Effects of a moving transmitter on the pulse's middle: emission delay, radial Mach number, pressure ratio.

    Args:
        departure: Unit vectors of departure in the world [1], (n, 3).
        wavefront_radius: Radius of the wavefronts [m], (n,).
        velocity: Velocity of the transmitter [m/s], (3,).
        pulse_middle: Time from the pulse's start to its middle [s].
        slowness: Slowness of sound at the transmitter [s/m].
        emission_delay: Result: emission delay of the pulse's middle [s], (n,).
        transmitter_mach: Result: radial speed of the transmitter towards the departing sound over that of sound [1],
            (n,).
        amplitude_factor: Result: pressure ratio by the transmitter's motion [1], (n,).
    """
    for n in range(wavefront_radius.size):
        emission_delay[n], transmitter_mach[n], amplitude_factor[n] = transmitter_motion_of_leg(
            departure[n, 0], departure[n, 1], departure[n, 2], wavefront_radius[n], velocity, pulse_middle, slowness
        )


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def direction_at_arrival(
    north: float, east: float, down: float, path_length: float, t: float, element: ElementMotion
) -> tuple[float, float, float]:
    """Unit vector from an element towards one arriving echo at time t [s], as in `turn_to_element`."""
    element_position, velocity, acceleration = element
    inverse = 1 / max(path_length, CLOSEST)
    x = north - inverse * (element_position[0] + t * (velocity[0] + t / 2 * acceleration[0]))
    y = east - inverse * (element_position[1] + t * (velocity[1] + t / 2 * acceleration[1]))
    z = down - inverse * (element_position[2] + t * (velocity[2] + t / 2 * acceleration[2]))
    scale = 1 / math.sqrt(x * x + y * y + z * z)
    return scale * x, scale * y, scale * z


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def turn_to_element(
    direction: Floats, path_length: Floats, arrival_time: Floats, element: ElementMotion, directions: Floats
) -> None:
    """Directions from an element towards echoes at their times of arrival.

    Args:
        direction: Unit vectors towards the echoes from the array's centre at the start of the ping [1], (n, 3).
        path_length: Lengths of the receive legs [m], (n,).
        arrival_time: Times of arrival [s], (n,).
        element: The element.
        directions: Result: unit vectors from the element [1], (n, 3).
    """
    for n in range(path_length.size):
        directions[n, 0], directions[n, 1], directions[n, 2] = direction_at_arrival(
            direction[n, 0], direction[n, 1], direction[n, 2], path_length[n], arrival_time[n], element
        )


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def arrival_stationary(
    echoes: ArrivalColumns, count: int, element_position: Floats, water: ArrayWater, arrival_time: Floats,
    spreading_ratio: NDArray[Any],
) -> None:  # fmt: skip
    """Arrival times and spreading ratios at an element at rest; arguments are those of `arrival_times`."""
    delay, radius, north, east, down = echoes.delay, echoes.radius, echoes.north, echoes.east, echoes.down
    slowness, attenuation = water.slowness, water.attenuation
    x, y, z = element_position[0], element_position[1], element_position[2]
    square = x * x + y * y + z * z
    for i in range(count):
        r = radius[i]
        square_change = square - 2 * r * (north[i] * x + east[i] * y + down[i] * z)
        distance = max(math.sqrt(max(r * r + square_change, 0.0)), CLOSEST)
        sum_of_distances = distance + r
        inverse = 1 / (sum_of_distances * distance)  # one division for two: they are what takes the time
        excess = square_change * distance * inverse
        arrival_time[i] = delay[i] + excess * slowness
        spreading_ratio[i] = np.float32(r * sum_of_distances * inverse * (1 - attenuation * excess))


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def arrival_moving(
    echoes: ArrivalColumns, count: int, element: ElementMotion, water: ArrayWater, arrival_time: Floats,
    spreading_ratio: NDArray[Any], doppler: Floats,
) -> None:  # fmt: skip
    """Arrival times at a moving element, whose position is taken when the pulse's middle arrives; see `arrival_times`.

    Two Newton steps find that time. Waveforms are stretched about their middle, so an echo is timed by its middle, less
    half of the transmitted pulse.
    """
    delay, radius, north, east, down = echoes.delay, echoes.radius, echoes.north, echoes.east, echoes.down
    element_position, velocity, acceleration = element
    transmit_doppler = echoes.transmit_doppler
    slowness, attenuation, pulse_middle = water.slowness, water.attenuation, water.pulse_middle
    for i in range(count):
        r, u, v, w = radius[i], north[i], east[i], down[i]
        rate = 1 - (u * velocity[0] + v * velocity[1] + w * velocity[2]) * slowness  # an approximate step suffices
        tau = delay[i]
        half = 0.5 * tau
        x = element_position[0] + tau * (velocity[0] + half * acceleration[0])
        y = element_position[1] + tau * (velocity[1] + half * acceleration[1])
        z = element_position[2] + tau * (velocity[2] + half * acceleration[2])
        square_change = x * x + y * y + z * z - 2 * r * (u * x + v * y + w * z)
        tau += square_change / (math.sqrt(max(r * r + square_change, 0.0)) + r) * slowness * rate
        half = 0.5 * tau
        x = element_position[0] + tau * (velocity[0] + half * acceleration[0])
        y = element_position[1] + tau * (velocity[1] + half * acceleration[1])
        z = element_position[2] + tau * (velocity[2] + half * acceleration[2])
        square_change = x * x + y * y + z * z - 2 * r * (u * x + v * y + w * z)
        distance = max(math.sqrt(max(r * r + square_change, 0.0)), CLOSEST)
        sum_of_distances = distance + r
        inverse = 1 / (sum_of_distances * distance)
        closing = (
            (r * u - x) * (velocity[0] + tau * acceleration[0])
            + (r * v - y) * (velocity[1] + tau * acceleration[1])
            + (r * w - z) * (velocity[2] + tau * acceleration[2])
        ) * (sum_of_distances * inverse * slowness)
        excess = square_change * distance * inverse
        tau += (delay[i] + excess * slowness - tau) * rate
        spreading_ratio[i] = np.float32(r * sum_of_distances * inverse * (1 - attenuation * excess))
        doppler[i] = (1 + closing) * transmit_doppler[i] - 1
        arrival_time[i] = tau - pulse_middle


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _expansion_delay(expansion: Floats, i: int, x: float, z: float) -> tuple[float, float, float]:
    """Delay beyond that of a spherical wavefront [s], and its derivatives in x and z [s/m].

    The polynomial of `propagation.aperture_expansion`, for an element x nearer and z deeper than the centre [m].
    """
    along_x = expansion[0, i] + x * (expansion[3, i] + x * expansion[7, i])
    along_z = expansion[2, i] + z * (expansion[6, i] + z * expansion[8, i])
    mixed = expansion[1, i] + x * expansion[4, i] + z * expansion[5, i]
    delay = x * x * along_x + z * z * along_z + x * z * mixed
    slope_x = x * (2 * along_x + x * (expansion[3, i] + 2 * x * expansion[7, i])) + z * (mixed + x * expansion[4, i])
    slope_z = z * (2 * along_z + z * (expansion[6, i] + 2 * z * expansion[8, i])) + x * (mixed + z * expansion[5, i])
    return delay, slope_x, slope_z


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def arrival_refracted(
    echoes: ArrivalColumns, count: int, element: ElementMotion, water: ArrayWater, arrival_time: Floats,
    spreading_ratio: NDArray[Any], doppler: Floats,
) -> None:  # fmt: skip
    """Arrival times in layered water at an element that may be moving, by the expansion of the wavefront.

    Arguments are those of `arrival_times`.
    """
    delay, north, east, down, transmit_doppler = (
        echoes.delay, echoes.north, echoes.east, echoes.down, echoes.transmit_doppler,
    )  # fmt: skip
    vertical_curvature, horizontal_distance, expansion = (
        echoes.vertical_curvature, echoes.horizontal_distance, echoes.expansion,
    )  # fmt: skip
    element_position, velocity, acceleration = element
    slowness, attenuation, pulse_middle = water.slowness, water.attenuation, water.pulse_middle
    half_gradient = 0.5 * water.sound_speed_gradient * slowness * slowness
    for i in range(count):
        u, v, w, b, distance = north[i], east[i], down[i], vertical_curvature[i], horizontal_distance[i]
        cosine = math.sqrt(max(u * u + v * v, 1e-30))
        inverse_cosine = 1 / cosine
        rate = 1 - (u * velocity[0] + v * velocity[1] + w * velocity[2]) * slowness
        tau, spreading, closing, excess_delay, log_gain = delay[i], 1.0, 0.0, 0.0, 0.0
        for _ in range(2):
            half = 0.5 * tau
            x = element_position[0] + tau * (velocity[0] + half * acceleration[0])
            y = element_position[1] + tau * (velocity[1] + half * acceleration[1])
            z = element_position[2] + tau * (velocity[2] + half * acceleration[2])
            along_ray, square = (x * u + y * v) * inverse_cosine, x * x + y * y
            # Horizontal approach of the element, without a difference of nearly equal numbers.
            closer = 2 * distance * along_ray - square
            closer /= distance + math.sqrt(max(distance * distance - closer, 0.0))
            along, across = closer * cosine + z * w, z * cosine - closer * w
            square = closer * closer + z * z
            root = max(math.sqrt(max(1 - 2 * b * along + b * b * square, 0.0)), 1e-3)
            inverse = 1 / ((1 + root) * root)
            spreading = (1 + root) * inverse
            excess_delay = (b * square - 2 * along) * root * inverse * slowness
            excess_delay += half_gradient * (w * along * along + 2 * cosine * along * across)
            along_term = 2 * half_gradient * (w * along + cosine * across)
            across_term = 2 * half_gradient * cosine * along
            slope_x = (b * closer - cosine) * spreading * slowness + along_term * cosine - across_term * w
            slope_z = (b * z - w) * spreading * slowness + along_term * w + across_term * cosine
            if expansion.shape[0]:
                expansion_delay, expansion_slope_x, expansion_slope_z = _expansion_delay(expansion, i, closer, z)
                excess_delay, slope_x = excess_delay + expansion_delay, slope_x + expansion_slope_x
                slope_z = slope_z + expansion_slope_z
                log_gain = closer * (expansion[9, i] + closer * expansion[11, i]) + z * (
                    expansion[10, i] + z * expansion[12, i]
                )
            v_north, v_east = velocity[0] + tau * acceleration[0], velocity[1] + tau * acceleration[1]
            closing_speed = (
                (distance * inverse_cosine * u - x) * v_north + (distance * inverse_cosine * v - y) * v_east
            ) / max(distance - closer, 1e-9)
            closing = -(slope_x * closing_speed + slope_z * (velocity[2] + tau * acceleration[2]))
            tau += (delay[i] + excess_delay - tau) * rate
        spreading_ratio[i] = np.float32(
            spreading * (1 + log_gain * (1 + 0.5 * log_gain)) * (1 - attenuation * excess_delay / slowness)
        )
        doppler[i] = (1 + closing) * transmit_doppler[i] - 1
        arrival_time[i] = tau - pulse_middle


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy", inline="always")
def arrival_times(
    echoes: ArrivalColumns, count: int, element: ElementMotion, water: ArrayWater, arrival_time: Floats,
    spreading_ratio: NDArray[Any], doppler: Floats,
) -> None:  # fmt: skip
    """Arrival times at one element, with spreading and Doppler factor.

    Args:
        echoes: Echoes at the array's centre.
        count: Number of echoes, n.
        element: The element.
        water: Water at the array.
        arrival_time: Result: time of arrival at the element [s], (n,).
        spreading_ratio: Result: spreading at the element over that at the centre [1], (n,).
        doppler: Result: d(emission) / d(arrival) - 1 [1], (n,); unchanged for an element at rest in water of one
            sound speed.
    """
    if water.is_layered:
        arrival_refracted(echoes, count, element, water, arrival_time, spreading_ratio, doppler)
    elif water.pulse_middle == 0.0:
        arrival_stationary(echoes, count, element.position, water, arrival_time, spreading_ratio)
    else:
        arrival_moving(echoes, count, element, water, arrival_time, spreading_ratio, doppler)
