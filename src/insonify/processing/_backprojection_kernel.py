"""Kernel of back-projection: echoes summed over the pixels of an image."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.processing._fractional_delay import BLOCK, FAST, CellClock, TapBlock, add_interpolated, prepare_taps

Doubles = NDArray[np.float64]
Singles = NDArray[np.float32]


class SonarTrack(NamedTuple):
    """Position and motion of the sonar at some pings."""

    transmit: Doubles
    """Transmitter at the start of each ping [m], shape (pings, 3)."""
    receive: Doubles
    """Receivers at the start of each ping [m], shape (pings, channels, 3)."""
    velocity: Doubles
    """Velocity of the receivers during reception [m/s], shape (pings, channels, 3)."""
    weight: Doubles
    """Shading of each series [1], shape (pings, channels)."""
    axis: Doubles
    """Unit vector to which angles off broadside refer, shape (pings, 3)."""


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def backproject_pings(
    cells: NDArray[np.complex64], clock: CellClock, track: SonarTrack, max_sine: float, window: Singles, grid: Doubles,
    out: Singles, weights: Singles,
) -> None:  # fmt: skip
    """Add the echoes of some pings to some pixels.

    Args:
        cells: Fine cells of matched-filtered series, shape (pings, channels, cells).
        clock: Times of the cells.
        track: Position and motion of the sonar.
        max_sine: Sine of the largest angle, at the transmitter, off the plane perpendicular to the track's axis [1].
        window: Shading by sine over `max_sine`, evenly spaced from 0 to 1; one number: none, shape (n,).
        grid: Positions of the pixels [m], shape (3, pixels).
        out: Sums of echoes, real and imaginary parts alternating, added to in place, shape (2 pixels,).
        weights: Sums of weights, added to in place, shape (pixels,).
    """
    flat, last, scale = cells.view(np.float32), cells.shape[2] - 4, window.size - 1.0
    transmit, receive, velocity, weight, axis = track
    block = TapBlock(np.empty(BLOCK, np.int32), np.empty((4, BLOCK), np.float32), np.empty(4 * BLOCK, np.float32),
                     np.empty((2, BLOCK), np.float32))  # fmt: skip
    transmit_distance, position, cycles = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    angle_weight, pixel_weight = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for begin in range(0, grid.shape[1], BLOCK):
        x, y, z = grid[0, begin : begin + BLOCK], grid[1, begin : begin + BLOCK], grid[2, begin : begin + BLOCK]
        count = x.size
        sums, totals = out[2 * begin : 2 * begin + 2 * count], weights[begin : begin + count]
        for ping in range(cells.shape[0]):
            tx, ty, tz = transmit[ping, 0], transmit[ping, 1], transmit[ping, 2]
            for i in range(count):
                transmit_distance[i] = np.sqrt((x[i] - tx) ** 2 + (y[i] - ty) ** 2 + (z[i] - tz) ** 2)
                angle_weight[i] = np.float32(1)
            if max_sine <= 1:
                ax, ay, az = axis[ping, 0], axis[ping, 1], axis[ping, 2]
                for i in range(count):
                    along = abs((x[i] - tx) * ax + (y[i] - ty) * ay + (z[i] - tz) * az)
                    ratio = along / (max_sine * transmit_distance[i])
                    is_within = ratio <= 1.0
                    angle_weight[i] = (
                        window[np.int32(ratio * scale + 0.5) if is_within else 0] if is_within else np.float32(0)
                    )
            for channel in range(cells.shape[1]):
                if weight[ping, channel] == 0:
                    continue
                _delays(
                    (x, y, z), transmit_distance, receive[ping, channel], velocity[ping, channel], clock, position,
                    cycles,
                )  # fmt: skip
                series_weight = np.float32(weight[ping, channel])
                for i in range(count):
                    inside = (position[i] >= 1.0) & (position[i] < last + 1.0)
                    pixel_weight[i] = series_weight * angle_weight[i] if inside else np.float32(0)
                    totals[i] += pixel_weight[i]
                prepare_taps(count, position, cycles, pixel_weight, last, block)
                add_interpolated(count, flat[ping, channel], block, sums)


@njit(inline="always")
def _delays(
    pixels: tuple[Doubles, Doubles, Doubles], transmit_distance: Doubles, receive: Doubles, velocity: Doubles,
    clock: CellClock, position: Doubles, cycles: Doubles,
) -> None:  # fmt: skip
    """Delay of each pixel's echo at one moving receiver, in cells and in cycles of the carrier.

    With A the transmit path length, q the pixel from the receiver's initial position and v its velocity, the delay
    solves
    |q - v tau| = c tau - A: a quadratic in tau.
    """
    (x, y, z), (first_time, cell_rate, frequency, c) = pixels, clock
    count = x.size
    ex, ey, ez = receive[0], receive[1], receive[2]
    vx, vy, vz = velocity[0], velocity[1], velocity[2]
    gain = 1.0 / (c * c - vx * vx - vy * vy - vz * vz)
    for i in range(count):
        qx, qy, qz = x[i] - ex, y[i] - ey, z[i] - ez
        half = c * transmit_distance[i] - (qx * vx + qy * vy + qz * vz)
        # discriminant over c^2 - v^2, in a form that gives |q| c without cancellation for v = 0
        square = qx * qx + qy * qy + qz * qz - transmit_distance[i] * transmit_distance[i]
        tau = (half + np.sqrt(half * half + square / gain)) * gain
        position[i] = (tau - first_time) * cell_rate
        cycles[i] = frequency * tau
