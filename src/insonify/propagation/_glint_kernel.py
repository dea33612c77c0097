"""Kernels that draw glints from the waves of a sea. Plain numbers and arrays only.

The phase that the surface's height adds to reflected sound is a Gaussian process. Its exponential splits exactly into
quanta: n of them with Poisson's probability for the mean nu = (2 k sigma sin(grazing))^2, each of one wave of the
sea, drawn in proportion to its variance, with either sign; their wavenumbers and frequencies add. No
quantum is the coherent bounce. Where nu is large, the many quanta of long waves are one Gaussian draw.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._displaced_bounce_kernel import displaced_bounce_path
from insonify.random_keys import philox, uniform_from_word

Floats = NDArray[np.float64]

STAGGER = 1 << 16
"""Fourth counter of the random number for the end of a glint's first life: above all quanta."""
LIVES = 0xFFF
"""Lives of a glint after which its random numbers repeat."""
MOST = 4.0  # mean number of quanta that are drawn one by one; those of longer waves, beyond it, as one Gaussian
NONE_OF_MOST = math.exp(-MOST)
"""Probability of no quantum: used by most glints of a rough sea."""


@njit(cache=True, nogil=True, error_model="numpy")
def tabulated_row(column: Floats, value: float, guide: NDArray[np.int32]) -> int:
    """Row of the last entry of an increasing column that is not above a value, and never the last row.

    The search starts at the guide, see `insonify.propagation.wind_waves.WindWaves`.
    """
    whole, steps = column[-1], guide.size - 1
    i = min(int(steps * math.sqrt(max(1 - value / whole, 0.0))), steps - 1)
    # one more row on each side, for rounding of the guide
    low, high = max(guide[i + 1] - 1, 0), min(guide[i] + 2, column.size - 1)
    while high - low > 1:
        middle = (low + high) // 2
        if column[middle] <= value:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, nogil=True, error_model="numpy")
def sine_cosine(angle: float) -> tuple[float, float]:
    """Sine and cosine of an angle from -pi to pi [rad], to 1.2e-7: by the series of its half."""
    x = angle / 2
    y = x * x
    s = x * (1 + y * (-1 / 6 + y * (1 / 120 + y * (-1 / 5040 + y * (1 / 362880 + y * (-1 / 39916800))))))
    c = 1 + y * (-1 / 2 + y * (1 / 24 + y * (-1 / 720 + y * (1 / 40320 + y * (-1 / 3628800 + y / 479001600)))))
    return 2 * s * c, c * c - s * s


@njit(cache=True, nogil=True, error_model="numpy")
def sample_glint(
    scatterer_id: np.uint64, code: int, k0: int, k1: int, phase: float, at_least_one: bool, wavenumber: Floats,
    variance: Floats,
    frequency: Floats, direction_quantiles: Floats, moment: Floats, guide: NDArray[np.int32],
) -> tuple[float, float, float, float]:  # fmt: skip
    """One glint of one scatterer: wavenumber along and across the wind [rad/m], angular frequency [rad/s], phase [rad].

    Args:
        scatterer_id: Identifier of the scatterer.
        code: Identifier of the glint, third counter of its random numbers.
        k0: First word of the key.
        k1: Second word of the key.
        phase: Phase per height, 2 k sin(grazing) [rad/m].
        at_least_one: True to condition on at least one quantum.
        wavenumber: Table of `insonify.propagation.wind_waves.WindWaves`.
        variance: Table of `WindWaves`.
        frequency: Table of `WindWaves`.
        direction_quantiles: Table of `WindWaves`.
        moment: Table of `WindWaves`.
        guide: Table of `WindWaves`.
    """
    whole = variance[-1]
    low, high = scatterer_id & np.uint64(0xFFFFFFFF), scatterer_id >> np.uint64(32)
    w0, w1, w2, w3 = philox(low, high, code, 0, k0, k1)
    along, across, turning = 0.0, 0.0, 0.0
    q2 = phase * phase
    mean, from_variance = q2 * whole, 0.0
    if mean > MOST:
        from_variance = whole - MOST / q2
        mean = MOST
        along, across, turning = _gaussian(
            w2, w3, low, high, code, k0, k1, phase, from_variance, variance, moment, guide
        )
    count = _poisson(uniform_from_word(w0), mean, at_least_one and from_variance == 0.0)
    for quantum in range(count):
        u0, u1, u2, _ = philox(low, high, code, quantum + 2, k0, k1)
        share = from_variance + uniform_from_word(u0) * (whole - from_variance)
        row = tabulated_row(variance, share, guide)
        step = max(variance[row + 1] - variance[row], 1e-300)
        part = min(1.0, max(0.0, (share - variance[row]) / step))
        k = wavenumber[row] + part * (wavenumber[row + 1] - wavenumber[row])
        omega = frequency[row] + part * (frequency[row + 1] - frequency[row])
        angle = _turned(direction_quantiles, (row + part) / (wavenumber.size - 1), uniform_from_word(u1))
        sign = 1.0 if u2 & np.uint32(1) else -1.0
        sine, cosine = sine_cosine(angle)
        along += sign * k * cosine
        across += sign * k * sine
        turning += sign * omega
    return along, across, turning, 2 * math.pi * uniform_from_word(w1)


@njit(cache=True, nogil=True, error_model="numpy")
def _gaussian(
    w2: np.uint32, w3: np.uint32, low: np.uint64, high: np.uint64, code: int, k0: int, k1: int, phase: float,
    upto: float, variance: Floats, moment: Floats, guide: NDArray[np.int32],
) -> tuple[float, float, float]:  # fmt: skip
    """Sum of the wavenumbers and frequencies of all quanta of the longer waves."""
    row = tabulated_row(variance, upto, guide)
    part = min(1.0, (upto - variance[row]) / max(variance[row + 1] - variance[row], 1e-300))
    ahead = moment[0, row] + part * (moment[0, row + 1] - moment[0, row])
    aside = moment[1, row] + part * (moment[1, row + 1] - moment[1, row])
    speed = moment[2, row] + part * (moment[2, row + 1] - moment[2, row])
    both = moment[3, row] + part * (moment[3, row + 1] - moment[3, row])
    v0, v1, _, _ = philox(low, high, code, 1, k0, k1)
    r, s = math.sqrt(-2 * math.log(uniform_from_word(w2))), math.sqrt(-2 * math.log(uniform_from_word(v0)))
    sine, cosine = sine_cosine(math.pi * (2 * uniform_from_word(w3) - 1))
    _, other = sine_cosine(math.pi * (2 * uniform_from_word(v1) - 1))
    # half a turn back: the angles begin at -pi
    first, second, third = -r * cosine, -r * sine, -s * other
    root = math.sqrt(max(ahead, 1e-300))
    shared = both / root
    own = math.sqrt(max(speed - shared * shared, 0.0))
    return phase * root * first, phase * math.sqrt(aside) * second, phase * (shared * first + own * third)


@njit(cache=True, nogil=True, error_model="numpy")
def _poisson(u: float, mean: float, at_least_one: bool) -> int:
    """Poisson number from a uniform one, optionally conditioned on at least one."""
    chance = NONE_OF_MOST if mean == MOST else math.exp(-mean)
    if at_least_one:
        u = chance + u * -math.expm1(-mean)
    count, total = 0, chance
    while u > total and count < 64:
        count += 1
        chance *= mean / count
        total += chance
    return max(count, 1) if at_least_one else count


@njit(cache=True, nogil=True, error_model="numpy")
def _turned(direction_quantiles: Floats, length: float, chance: float) -> float:
    """Direction of a wave re the wind's [rad], interpolated in the table."""
    x, y = length * (direction_quantiles.shape[0] - 1), chance * (direction_quantiles.shape[1] - 1)
    i, j = min(int(x), direction_quantiles.shape[0] - 2), min(int(y), direction_quantiles.shape[1] - 2)
    p, q = x - i, y - j
    here = direction_quantiles[i, j] + q * (direction_quantiles[i, j + 1] - direction_quantiles[i, j])
    there = direction_quantiles[i + 1, j] + q * (direction_quantiles[i + 1, j + 1] - direction_quantiles[i + 1, j])
    return here + p * (there - here)


@njit(cache=True, nogil=True, error_model="numpy")
def apply_glints_to_row(
    keys: NDArray[np.uint64], points: Floats, normal: Floats, code: int, k0: int, k1: int, phase: Floats,
    wavenumber: Floats, variance: Floats, frequency: Floats, direction_quantiles: Floats, moment: Floats,
    guide: NDArray[np.int32],
    axes: Floats, sonar_position: Floats, transmit_position: Floats, start: float, correlation_time: float,
    image_depth: float, starts_upward: bool,
    reverses_vertically: bool, bounce_heights: Floats, sound_frequency: float, speed: float, loss: float,
    delay: Floats, length: Floats,
    absorption: Floats, departure: Floats, arrival: Floats, grazing: Floats, status: NDArray[np.uint8],
    facing_away: int, visibility: Any, phasor_out: NDArray[np.complex128], phasor_back: NDArray[np.complex128],
) -> None:  # fmt: skip
    """Turn one row of legs off a flat surface into glints, in place; legs that do not exist stay unchanged.

    Args:
        keys: Identifiers of the scatterers, (n,).
        points: Ends of the legs [m], (n, 3).
        normal: Normals of their interfaces; 0 for points without one, (n, 3).
        code: Identifier of the glint, the same for transmit and receive legs.
        k0: First word of the key.
        k1: Second word of the key.
        phase: Phase per height of one bounce, 2 k sin(grazing) [rad/m], (n,).
        wavenumber: Table of `insonify.propagation.wind_waves.WindWaves`.
        variance: Table of `WindWaves`.
        frequency: Table of `WindWaves`.
        direction_quantiles: Table of `WindWaves`.
        moment: Table of `WindWaves`.
        guide: Table of `WindWaves`.
        axes: North and east of the waves' direction, and of that to the right of it, (2, 2).
        sonar_position: North, east, depth of this end of the sonar [m], (3,).
        transmit_position: North, east, depth of the transmitting end [m], (3,).
        start: Start of the ping [s].
        correlation_time: Lifetime of a glint [s].
        image_depth: Depth of the family's image source [m].
        starts_upward: True if the legs begin upwards.
        reverses_vertically: True for legs that end in the opposite vertical direction.
        bounce_heights: Vertical travel up to each surface bounce [m], (bounces,).
        sound_frequency: Frequency of the sound [Hz].
        speed: Sound speed at the sonar [m/s].
        loss: Absorption [dB/m].
        delay: Changed, one-way travel time [s], (n,).
        length: Changed [m], (n,).
        absorption: Changed, pressure ratio [1], (n,).
        departure: Changed, unit vectors of travel at the sonar, (n, 3).
        arrival: Changed, unit vectors of travel at the points, (n, 3).
        grazing: Changed [rad], (n,).
        status: Changed for legs that now arrive from behind, (n,).
        facing_away: `LegStatus` of such legs.
        visibility: Changed for such legs, (n,).
        phasor_out: Result: phasor of transmit legs, (n,).
        phasor_back: Result: phasor of receive legs, (n,).
    """
    slopes, bent = np.empty((bounce_heights.size, 2)), np.empty(7)
    for n in range(keys.size):
        if visibility[n] == 0:
            continue
        dn, de = points[n, 0] - sonar_position[0], points[n, 1] - sonar_position[1]
        away = (
            (points[n, 0] - transmit_position[0]) ** 2
            + (points[n, 1] - transmit_position[1]) ** 2
            + (points[n, 2] - transmit_position[2]) ** 2
        )
        far = math.sqrt(dn * dn + de * de)
        north, east = (dn / far, de / far) if far > 1e-6 else (1.0, 0.0)
        climb = max(abs(points[n, 2] - image_depth), 1e-6)
        there = math.sqrt(away) / speed
        turned, gone, came = 0.0, 0.0, 0.0
        living = code << 4 | _glint_generation(keys[n], code, k0, k1, start / correlation_time) << 20
        for b in range(bounce_heights.size):
            # At least one bounce is incoherent; of several the first represents it.
            along, across, omega, first = sample_glint(keys[n], living | b, k0, k1, phase[n], b == 0, wavenumber,
                                                     variance, frequency, direction_quantiles, moment,
                                                     guide)  # fmt: skip
            k_north, k_east = along * axes[0, 0] + across * axes[1, 0], along * axes[0, 1] + across * axes[1, 1]
            part = min(bounce_heights[b] / climb, 1.0)
            reach = part * far
            # from the point itself: re a distant origin, a wavenumber that follows a moving sonar would change the
            # phase
            turned += k_north * (sonar_position[0] + reach * north - points[n, 0])
            turned += k_east * (sonar_position[1] + reach * east - points[n, 1]) + first
            slopes[b, 0] = -(k_north * north + k_east * east) / phase[n]
            slopes[b, 1] = -(k_east * north - k_north * east) / phase[n]
            before = part * delay[n]
            # Receive legs are timed after a direct transmit leg: other legs differ by milliseconds.
            gone += omega * (start + before)
            came += omega * (start + there + delay[n] - before)
        displaced_bounce_path(far, climb, north, east, starts_upward, reverses_vertically, bounce_heights, slopes, bent)
        # The waves set the phase; the glint's own way only when it is received.
        cycles = sound_frequency * bent[0] / speed
        still = turned + 2 * math.pi * (cycles - math.floor(cycles + 0.5))
        phasor_out[n] = complex(math.cos(still - gone), math.sin(still - gone))
        phasor_back[n] = complex(math.cos(still - came), math.sin(still - came))
        delay[n] += bent[0] / speed
        length[n] += bent[0]
        absorption[n] *= math.exp(-loss * bent[0] * (math.log(10) / 20))
        _turn(departure[n], bent, 1)
        _turn(arrival[n], bent, 4)
        sine = -(arrival[n, 0] * normal[n, 0] + arrival[n, 1] * normal[n, 1] + arrival[n, 2] * normal[n, 2])
        grazing[n] = math.asin(min(max(sine, -1.0), 1.0))
        if sine <= 0 and (normal[n, 0] != 0 or normal[n, 1] != 0 or normal[n, 2] != 0):
            if status[n] == 0:
                status[n] = facing_away
            visibility[n] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def _glint_generation(scatterer_id: np.uint64, code: int, k0: int, k1: int, lives: float) -> int:
    """Index of the current glint; each scatterer's glints change at times of their own."""
    w0, _, _, _ = philox(scatterer_id & np.uint64(0xFFFFFFFF), scatterer_id >> np.uint64(32), code, STAGGER, k0, k1)
    return math.floor(lives + uniform_from_word(w0)) & LIVES


@njit(cache=True, nogil=True, error_model="numpy")
def _turn(direction: Floats, change: Floats, at: int) -> None:
    """Add three entries to a unit vector, and normalise it."""
    x, y, z = direction[0] + change[at], direction[1] + change[at + 1], direction[2] + change[at + 2]
    inverse = 1 / math.sqrt(x * x + y * y + z * z)
    direction[0], direction[1], direction[2] = x * inverse, y * inverse, z * inverse
