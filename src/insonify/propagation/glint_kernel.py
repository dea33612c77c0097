"""Kernels that draw glints from the waves of a sea. Plain numbers and arrays only.

The phase that the surface's height adds to reflected sound is a Gaussian process. Its exponential splits exactly into
quanta: a Poisson number with the mean nu = (2 k sigma sin(grazing))^2, each of one wave of the sea, drawn in proportion
to its variance, with either sign; their wavenumbers and frequencies add. Without any quantum the bounce is coherent.
Where nu is large, the many quanta of long waves are one Gaussian draw. Waves of the seabed are constant in time; its
glints change with the bounce point. See decisions 24 and 54.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._displaced_bounce_kernel import SurfaceBounces, displaced_bounce_path
from insonify.propagation.wind_waves import WindWaves
from insonify.random_keys import philox, uniform_from_word
from insonify.records.legs import LegStatus

Floats = NDArray[np.float64]

STAGGER = 1 << 16
"""Fourth counter, above those of all quanta, of a glint's random offsets: of its lives, or its cells of the seabed."""
LIVES = 0xFFF
"""Mask of the number of a glint's life: its random numbers repeat after 4096 lives."""
CELLS = 0x3F
"""Mask of the number of a cell of the seabed: a glint's random numbers repeat after 64 cells along each axis."""
FIRST = STAGGER + 2
"""Fourth counter of the random number for the first incoherent bounce of a path by both boundaries."""
PRESENCE = STAGGER + 3
"""Fourth counter of the random number by which a reflection by the seabed is incoherent."""
ATTEMPTS, ATTEMPT = 64, 128
"""Largest number of draws of a glint of the seabed, until the wavenumber changes little, and counters for each draw."""
MAX_SINGLE_QUANTA = 4.0
"""Largest mean number of quanta drawn one by one, those of the shortest waves; all others are one Gaussian [1]."""
NO_QUANTUM_PROBABILITY = math.exp(-MAX_SINGLE_QUANTA)
"""Probability of no quantum at that mean, the usual one of a rough sea."""
_FACING_AWAY = int(LegStatus.FACING_AWAY)


class GlintPoints(NamedTuple):
    """Scatterers at the ends of the legs: n of them."""

    scatterer_id: NDArray[np.uint64]
    """Identifiers, (n,)."""
    position: Floats
    """North, east, depth [m], (n, 3)."""
    normal: Floats
    """Normals of their interfaces; 0 for points without one, (n, 3)."""
    phase_per_height: Floats
    """Phase per height of one surface bounce, 2 k sin(grazing) [rad/m], (n,)."""
    bed_phase_per_height: Floats
    """Phase per height of one bottom bounce [rad/m], (n,)."""
    long_variance: Floats
    """Variance of the seabed's waves that are longer than the Fresnel zone and make no glints [m^2], (n,)."""
    bed_quanta: Floats
    """Mean number of quanta of one bottom bounce, see `BedRoughness.mean_quanta`: coherent with exp(-it) [1], (n,)."""


class GlintSource(NamedTuple):
    """Origin of the random numbers of one glint, and the waves that it is drawn from."""

    waves: WindWaves
    """Tables of the waves."""
    axes: Floats
    """North and east of the waves' direction, and of that to the right of it, (2, 2)."""
    lifetime: float
    """Lifetime of a glint [s]."""
    key: tuple[int, int]
    """Key of the random numbers, see `insonify.random_keys`."""
    code: int
    """Identifier of the glint, third counter of its random numbers, the same for transmit and receive legs."""
    bed_waves: WindWaves
    """Tables of the seabed's roughness."""
    bed_axes: Floats
    """North and east of the axes of the seabed's cells, (2, 2)."""
    max_bed_wavenumber: float
    """Largest change of the horizontal wavenumber by a glint of the seabed [rad/m]."""
    cell: float
    """Side of a cell of the seabed within which a bounce point keeps its glint [m]."""


class CalmPaths(NamedTuple):
    """Geometry and medium of one family's legs, reflected at flat boundaries."""

    sonar_position: Floats
    """North, east, depth of the end of the sonar at which the legs begin [m], (3,)."""
    transmit_position: Floats
    """North, east, depth of the transmitter [m], (3,)."""
    ping_time: float
    """Start of the ping [s]."""
    image_depth: float
    """Depth of the family's image source [m]."""
    bounces: SurfaceBounces
    """Reflections by rough boundaries."""
    on_bed: NDArray[np.bool_]
    """True for bounces on the seabed, False for those on the surface, (bounces,)."""
    frequency: float
    """Frequency of the sound [Hz]."""
    speed: float
    """Sound speed at the sonar [m/s]."""
    absorption: float
    """Absorption [dB/m]."""


class GlintLegs(NamedTuple):
    """Columns of one row of legs, changed in place."""

    delay: Floats
    """One-way travel time [s], (n,)."""
    length: Floats
    """Length [m], (n,)."""
    absorption: Floats
    """Pressure re that without absorption [1], (n,)."""
    departure: Floats
    """Unit vectors of travel at the sonar, (n, 3)."""
    arrival: Floats
    """Unit vectors of travel at the points, (n, 3)."""
    grazing_sine: Floats
    """Sine of the grazing angle [1], (n,)."""
    status: NDArray[np.uint8]
    """`LegStatus`, (n,)."""
    visibility: Any
    """Fraction of the pressure that passes edges [1], (n,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def tabulated_row(column: Floats, value: float, guide: NDArray[np.int32]) -> int:
    """Row of the last entry of an increasing column that is not above a value, at most the last but one.

    The guide bounds the search, see `insonify.propagation.wind_waves.WindWaves`.
    """
    largest, steps = column[-1], guide.size - 1
    i = min(int(steps * math.sqrt(max(1 - value / largest, 0.0))), steps - 1)
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
    """Sine and cosine of an angle from -pi to pi [rad], to 1.2e-7: by Taylor's series of half the angle."""
    x = angle / 2
    y = x * x
    s = x * (1 + y * (-1 / 6 + y * (1 / 120 + y * (-1 / 5040 + y * (1 / 362880 + y * (-1 / 39916800))))))
    c = 1 + y * (-1 / 2 + y * (1 / 24 + y * (-1 / 720 + y * (1 / 40320 + y * (-1 / 3628800 + y / 479001600)))))
    return 2 * s * c, c * c - s * s


@njit(cache=True, nogil=True, error_model="numpy")
def sample_glint(
    scatterer_id: np.uint64,
    code: int,
    key: tuple[int, int],
    phase_per_height: float,
    at_least_one: bool,
    waves: WindWaves,
    long_variance: float,
    first_counter: int,
) -> tuple[float, float, float, float]:
    """One glint of one scatterer: wavenumber along and across the wind [rad/m], angular frequency [rad/s], phase [rad].

    Args:
        scatterer_id: Identifier of the scatterer.
        code: Identifier of the glint, third counter of its random numbers.
        key: Key of the random numbers.
        phase_per_height: 2 k sin(grazing) [rad/m].
        at_least_one: True to condition on at least one quantum.
        waves: Tables of the waves.
        long_variance: Variance of the longest waves, which are left out [m^2].
        first_counter: Fourth counter of its first random numbers; each quantum takes the next one.
    """
    variance, guide = waves.variance, waves.row_guide
    total_variance, (k0, k1) = variance[-1], key
    low, high = scatterer_id & np.uint64(0xFFFFFFFF), scatterer_id >> np.uint64(32)
    w0, w1, w2, w3 = philox(low, high, code, first_counter, k0, k1)
    along, across, omega_sum = 0.0, 0.0, 0.0
    q2 = phase_per_height * phase_per_height
    mean, from_variance = q2 * (total_variance - long_variance), long_variance
    if mean > MAX_SINGLE_QUANTA:
        from_variance = total_variance - MAX_SINGLE_QUANTA / q2
        mean = MAX_SINGLE_QUANTA
        v0, v1, _, _ = philox(low, high, code, first_counter + 1, k0, k1)
        along, across, omega_sum = _gaussian_quanta(
            (w2, w3, v0, v1), phase_per_height, long_variance, from_variance, waves
        )
    count = _poisson(uniform_from_word(w0), mean, at_least_one and from_variance == long_variance)
    for quantum in range(count):
        u0, u1, u2, _ = philox(low, high, code, first_counter + quantum + 2, k0, k1)
        variance_below = from_variance + uniform_from_word(u0) * (total_variance - from_variance)
        row = tabulated_row(variance, variance_below, guide)
        step = max(variance[row + 1] - variance[row], 1e-300)
        t = min(1.0, max(0.0, (variance_below - variance[row]) / step))
        k = waves.wavenumber[row] + t * (waves.wavenumber[row + 1] - waves.wavenumber[row])
        omega = waves.frequency[row] + t * (waves.frequency[row + 1] - waves.frequency[row])
        angle = _wave_direction(
            waves.direction_quantiles, (row + t) / (waves.wavenumber.size - 1), uniform_from_word(u1)
        )
        sign = 1.0 if u2 & np.uint32(1) else -1.0
        sine, cosine = sine_cosine(angle)
        along += sign * k * cosine
        across += sign * k * sine
        omega_sum += sign * omega
    return along, across, omega_sum, 2 * math.pi * uniform_from_word(w1)


@njit(cache=True, nogil=True, error_model="numpy")
def sample_bed_glint(
    points: GlintPoints, source: GlintSource, n: int, code: int, at_least_one: bool
) -> tuple[float, float, float]:
    """Wavenumber along both of the seabed's axes [rad/m], and phase [rad], of one bottom bounce; 0 if it is coherent.

    The first of up to `ATTEMPTS` draws that is within `GlintSource.max_bed_wavenumber`; else the last, reduced to it.

    Args:
        points: Scatterers at the ends of the legs.
        source: Origin of the glints.
        n: Row of the scatterer.
        code: Identifier of the glint and its cell, third counter of its random numbers.
        at_least_one: True for an incoherent bounce; False for one that is incoherent by chance.
    """
    scatterer_id = points.scatterer_id[n]
    if not at_least_one:
        low, high = scatterer_id & np.uint64(0xFFFFFFFF), scatterer_id >> np.uint64(32)
        w0, _, _, _ = philox(low, high, code, PRESENCE, *source.key)
        if uniform_from_word(w0) < math.exp(-points.bed_quanta[n]):
            return 0.0, 0.0, 0.0
    along, across, phase, largest = 0.0, 0.0, 0.0, source.max_bed_wavenumber
    for attempt in range(ATTEMPTS):
        along, across, _, phase = sample_glint(
            scatterer_id, code, source.key, points.bed_phase_per_height[n], True, source.bed_waves,
            points.long_variance[n], attempt * ATTEMPT,
        )  # fmt: skip
        if along * along + across * across <= largest * largest:
            return along, across, phase
    scale = largest / math.sqrt(along * along + across * across)
    return scale * along, scale * across, phase


@njit(cache=True, nogil=True, error_model="numpy")
def _gaussian_quanta(
    words: tuple[np.uint32, np.uint32, np.uint32, np.uint32], q: float, low: float, high: float,
    waves: WindWaves,
) -> tuple[float, float, float]:  # fmt: skip
    """Wavenumber along and across the wind [rad/m], and angular frequency [rad/s], of the quanta of many long waves.

    Normal variables, from four random words. q: phase per height [rad/m]; low, high: height variances between [m^2].
    """
    w2, w3, v0, v1 = words
    along, across, speed, cross = _moments_below(high, waves)
    if low > 0:
        longer = _moments_below(low, waves)
        along, across, speed, cross = (along - longer[0], across - longer[1], speed - longer[2], cross - longer[3])
    r, s = math.sqrt(-2 * math.log(uniform_from_word(w2))), math.sqrt(-2 * math.log(uniform_from_word(v0)))
    sine, cosine = sine_cosine(math.pi * (2 * uniform_from_word(w3) - 1))
    _, third_sine = sine_cosine(math.pi * (2 * uniform_from_word(v1) - 1))
    # three standard normal numbers (Box & Muller); minus, as the angles of `sine_cosine` begin at -pi, not at 0
    first, second, third = -r * cosine, -r * sine, -s * third_sine
    root = math.sqrt(max(along, 1e-300))
    shared = cross / root
    remainder = math.sqrt(max(speed - shared * shared, 0.0))
    return q * root * first, q * math.sqrt(across) * second, q * (shared * first + remainder * third)


@njit(cache=True, nogil=True, error_model="numpy")
def _moments_below(height_variance: float, waves: WindWaves) -> tuple[float, float, float, float]:
    """`WindWaves.slope_moments` of the longest waves, up to those with which the height has a variance [m^2]."""
    variance, moment = waves.variance, waves.slope_moments
    row = tabulated_row(variance, height_variance, waves.row_guide)
    fraction = min(1.0, (height_variance - variance[row]) / max(variance[row + 1] - variance[row], 1e-300))
    return (
        moment[0, row] + fraction * (moment[0, row + 1] - moment[0, row]),
        moment[1, row] + fraction * (moment[1, row + 1] - moment[1, row]),
        moment[2, row] + fraction * (moment[2, row + 1] - moment[2, row]),
        moment[3, row] + fraction * (moment[3, row + 1] - moment[3, row]),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _poisson(u: float, mean: float, at_least_one: bool) -> int:
    """Poisson number from a uniform random number in 0..1, if so requested on the condition that it is at least 1."""
    probability = NO_QUANTUM_PROBABILITY if mean == MAX_SINGLE_QUANTA else math.exp(-mean)
    if at_least_one:
        u = probability + u * -math.expm1(-mean)
    count, total = 0, probability
    while u > total and count < 64:
        count += 1
        probability *= mean / count
        total += probability
    return max(count, 1) if at_least_one else count


@njit(cache=True, nogil=True, error_model="numpy")
def _wave_direction(direction_quantiles: Floats, scale: float, probability: float) -> float:
    """Direction of a wave re the wind's [rad], below which it lies with a probability; `WindWaves.direction_quantiles`.

    scale: logarithm of the wavenumber, 0 for the longest waves, 1 for the shortest.
    """
    x, y = scale * (direction_quantiles.shape[0] - 1), probability * (direction_quantiles.shape[1] - 1)
    i, j = min(int(x), direction_quantiles.shape[0] - 2), min(int(y), direction_quantiles.shape[1] - 2)
    p, q = x - i, y - j
    near_angle = direction_quantiles[i, j] + q * (direction_quantiles[i, j + 1] - direction_quantiles[i, j])
    far_angle = direction_quantiles[i + 1, j] + q * (direction_quantiles[i + 1, j + 1] - direction_quantiles[i + 1, j])
    return near_angle + p * (far_angle - near_angle)


@njit(cache=True, nogil=True, error_model="numpy")
def apply_glints_to_row(
    points: GlintPoints, source: GlintSource, paths: CalmPaths, legs: GlintLegs, phasor_out: NDArray[np.complex128],
    phasor_back: NDArray[np.complex128],
) -> None:  # fmt: skip
    """Turn one row of legs reflected by flat boundaries into glints, in place; legs of no visibility stay unchanged.

    Args:
        points: Scatterers at the ends of the legs.
        source: Origin of the glints.
        paths: Geometry of the legs by flat boundaries.
        legs: Columns of the legs; status and visibility change where legs now arrive from behind an interface.
        phasor_out: Result: unit phasors of the glints on transmit legs [1], (n,).
        phasor_back: Result: unit phasors of the same glints on receive legs [1], (n,).
    """
    bounce_heights, code = paths.bounces.heights, source.code
    sonar_position, transmit_position, start = paths.sonar_position, paths.transmit_position, paths.ping_time
    ids, normal = points.scatterer_id, points.normal
    delay, visibility = legs.delay, legs.visibility
    slopes, change = np.empty((bounce_heights.size, 2)), np.empty(7)
    off_surface, off_bed = not paths.on_bed.all(), paths.on_bed.any()
    for n in range(ids.size):
        if visibility[n] == 0:
            continue
        x, y, z = points.position[n]
        dn, de = x - sonar_position[0], y - sonar_position[1]
        square = (x - transmit_position[0]) ** 2 + (y - transmit_position[1]) ** 2 + (z - transmit_position[2]) ** 2
        distance = math.sqrt(dn * dn + de * de)
        north, east = (dn / distance, de / distance) if distance > 1e-6 else (1.0, 0.0)
        vertical_travel = max(abs(z - paths.image_depth), 1e-6)
        transmit_delay = math.sqrt(square) / paths.speed
        ramp_phase, phase_out, phase_back = 0.0, 0.0, 0.0
        generation = 0
        if off_surface:
            generation = code << 4 | _glint_generation(ids[n], code, source.key, start / source.lifetime) << 20
        # At least one bounce is incoherent: the first on the only rough boundary, or one that is drawn of both.
        incoherent = _first_incoherent_bounce(points, source, paths.on_bed, n) if off_surface and off_bed else 0
        for b in range(bounce_heights.size):
            fraction = min(bounce_heights[b] / vertical_travel, 1.0)
            reach = fraction * distance
            # re the scatterer: re a distant origin, a wavenumber that follows a moving sonar would change the phase
            offset_north = sonar_position[0] + reach * north - x
            offset_east = sonar_position[1] + reach * east - y
            if paths.on_bed[b]:
                axes, phase_per_height = source.bed_axes, points.bed_phase_per_height[n]
                cell, cell_x, cell_y = _cell_of_bounce(ids[n], code << 4 | b, source, offset_north, offset_east)
                # re the middle of the cell: the wavenumber follows the angles of a moving sonar
                offset_north = cell_x * axes[0, 0] + cell_y * axes[1, 0]
                offset_east = cell_x * axes[0, 1] + cell_y * axes[1, 1]
                omega = 0.0
                along, across, random_phase = sample_bed_glint(
                    points, source, n, code << 4 | cell << 20 | b, b == incoherent
                )
                k_north, k_east = along * axes[0, 0] + across * axes[1, 0], along * axes[0, 1] + across * axes[1, 1]
            else:
                sea, phase_per_height = source.axes, points.phase_per_height[n]
                along, across, omega, random_phase = sample_glint(
                    ids[n], generation | b, source.key, phase_per_height, b == incoherent, source.waves, 0.0, 0
                )
                k_north, k_east = along * sea[0, 0] + across * sea[1, 0], along * sea[0, 1] + across * sea[1, 1]
            if b < incoherent:
                slopes[b, 0], slopes[b, 1] = 0.0, 0.0
                continue
            ramp_phase += k_north * offset_north
            ramp_phase += k_east * offset_east + random_phase
            slopes[b, 0] = -(k_north * north + k_east * east) / phase_per_height
            slopes[b, 1] = -(k_east * north - k_north * east) / phase_per_height
            before = fraction * delay[n]  # delay from the sonar to the bounce [s]
            # Receive legs are timed after a direct transmit leg: by other families it takes milliseconds more.
            phase_out += omega * (start + before)
            phase_back += omega * (start + transmit_delay + delay[n] - before)
        displaced_bounce_path(distance, vertical_travel, north, east, paths.bounces, slopes, change)
        # The waves alone set the phase: that of the additional delay is taken back.
        cycles = paths.frequency * change[0] / paths.speed
        static_phase = ramp_phase + 2 * math.pi * (cycles - math.floor(cycles + 0.5))
        phasor_out[n] = complex(math.cos(static_phase - phase_out), math.sin(static_phase - phase_out))
        phasor_back[n] = complex(math.cos(static_phase - phase_back), math.sin(static_phase - phase_back))
        delay[n] += change[0] / paths.speed
        legs.length[n] += change[0]
        legs.absorption[n] *= math.exp(-paths.absorption * change[0] * (math.log(10) / 20))
        _redirect(legs.departure[n], change, 1)
        _redirect(legs.arrival[n], change, 4)
        arrival = legs.arrival[n]
        sine = -(arrival[0] * normal[n, 0] + arrival[1] * normal[n, 1] + arrival[2] * normal[n, 2])
        legs.grazing_sine[n] = min(max(sine, -1.0), 1.0)
        if sine <= 0 and (normal[n, 0] != 0 or normal[n, 1] != 0 or normal[n, 2] != 0):
            if legs.status[n] == 0:
                legs.status[n] = _FACING_AWAY
            visibility[n] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def _glint_generation(scatterer_id: np.uint64, code: int, key: tuple[int, int], lives: float) -> int:
    """Number of a glint's life at a time in lifetimes [1]; each scatterer's glints change at times of their own."""
    w0, _, _, _ = philox(scatterer_id & np.uint64(0xFFFFFFFF), scatterer_id >> np.uint64(32), code, STAGGER, *key)
    return math.floor(lives + uniform_from_word(w0)) & LIVES


@njit(cache=True, nogil=True, error_model="numpy")
def _cell_of_bounce(
    scatterer_id: np.uint64, code: int, source: GlintSource, offset_north: float, offset_east: float
) -> tuple[int, float, float]:
    """Cell of the seabed with one bounce point, and position in it; each scatterer's glints have cells of their own.

    Args:
        scatterer_id: Identifier of the scatterer.
        code: Identifier of the glint and its bounce.
        source: Origin of the glint.
        offset_north: Bounce point less scatterer, north [m].
        offset_east: Bounce point less scatterer, east [m].

    Returns:
        Index of the cell, and position of the bounce point along both axes from its middle [m].
    """
    w0, w1, _, _ = philox(scatterer_id & np.uint64(0xFFFFFFFF), scatterer_id >> np.uint64(32), code, STAGGER,
                          *source.key)  # fmt: skip
    first_axis, second_axis = source.bed_axes[0], source.bed_axes[1]
    x = (first_axis[0] * offset_north + first_axis[1] * offset_east) / source.cell + uniform_from_word(w0)
    y = (second_axis[0] * offset_north + second_axis[1] * offset_east) / source.cell + uniform_from_word(w1)
    row, column = math.floor(x), math.floor(y)
    return (row & CELLS) << 6 | (column & CELLS), (x - row - 0.5) * source.cell, (y - column - 0.5) * source.cell


@njit(cache=True, nogil=True, error_model="numpy")
def _first_incoherent_bounce(points: GlintPoints, source: GlintSource, on_bed: NDArray[np.bool_], n: int) -> int:
    """Index of the first bounce with a quantum of leg n, by both boundaries, on the condition that there is one."""
    low, high = points.scatterer_id[n] & np.uint64(0xFFFFFFFF), points.scatterer_id[n] >> np.uint64(32)
    w0, _, _, _ = philox(low, high, source.code, FIRST, *source.key)
    surface_quanta = points.phase_per_height[n] ** 2 * source.waves.variance[-1]  # mean number per bounce
    bed_quanta = points.bed_quanta[n]
    total = 0.0
    for b in range(on_bed.size):
        total += bed_quanta if on_bed[b] else surface_quanta
    # the first event of a Poisson process with one interval for each bounce
    drawn, up_to_bounce = -math.log1p(uniform_from_word(w0) * math.expm1(-total)), 0.0
    for b in range(on_bed.size):
        up_to_bounce += bed_quanta if on_bed[b] else surface_quanta
        if drawn < up_to_bounce:
            return b
    return on_bed.size - 1


@njit(cache=True, nogil=True, error_model="numpy")
def _redirect(direction: Floats, change: Floats, at: int) -> None:
    """Add the three entries of change from index at to a unit vector, and normalise it in place."""
    x, y, z = direction[0] + change[at], direction[1] + change[at + 1], direction[2] + change[at + 2]
    inverse = 1 / math.sqrt(x * x + y * y + z * z)
    direction[0], direction[1], direction[2] = x * inverse, y * inverse, z * inverse
