"""Echoes summed over a picture's pixels: the loop of back-projection."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.processing._fractional_delay import BLOCK, FAST, add_interpolated, prepare_taps

Doubles = NDArray[np.float64]
Singles = NDArray[np.float32]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def backproject_pings(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, frequency: float, sound_speed: float,
    transmit: Doubles, receive: Doubles, velocity: Doubles, weight: Doubles, axis: Doubles, max_sine: float,
    window: Singles, grid: Doubles, out: Singles, weights: Singles,
) -> None:  # fmt: skip
    """Add the echoes of some pings to some pixels.

    Args:
        cells: Fine cells of matched-filtered series, shape (pings, channels, cells).
        first_time: Time of the first cell [s].
        cell_rate: Cells per second [Hz].
        frequency: Carrier [Hz].
        sound_speed: Of the water [m/s].
        transmit: Transmitter at the start of each ping [m], shape (pings, 3).
        receive: Receivers at the start of each ping [m], shape (pings, channels, 3).
        velocity: Of the receivers while they listen [m/s], shape (pings, channels, 3).
        weight: Shading of each series [1], shape (pings, channels).
        axis: Unit vector from which angles are measured, seen from the transmitter, shape (pings, 3).
        max_sine: Sine of the widest angle off the plane across `axis` at which a pixel is still seen [1].
        window: Shading by sine over `max_sine`, evenly spaced from 0 to 1; one number: none, shape (n,).
        grid: Pixels [m], shape (3, pixels).
        out: Sums of echoes, real and imaginary in turn, added to, shape (2 pixels,).
        weights: Sums of weights, added to, shape (pixels,).
    """
    flat, last, scale = cells.view(np.float32), cells.shape[2] - 4, window.size - 1.0
    at, taps, turned = np.empty(BLOCK, np.int32), np.empty(4 * BLOCK, np.float32), np.empty((2, BLOCK), np.float32)
    loose = np.empty((4, BLOCK), np.float32)
    away, position, cycles = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    seen, share = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for begin in range(0, grid.shape[1], BLOCK):
        x, y, z = grid[0, begin : begin + BLOCK], grid[1, begin : begin + BLOCK], grid[2, begin : begin + BLOCK]
        count = x.size
        sums, totals = out[2 * begin : 2 * begin + 2 * count], weights[begin : begin + count]
        for ping in range(cells.shape[0]):
            tx, ty, tz = transmit[ping, 0], transmit[ping, 1], transmit[ping, 2]
            for i in range(count):
                away[i] = np.sqrt((x[i] - tx) ** 2 + (y[i] - ty) ** 2 + (z[i] - tz) ** 2)
                seen[i] = np.float32(1)
            if max_sine <= 1:
                ax, ay, az = axis[ping, 0], axis[ping, 1], axis[ping, 2]
                for i in range(count):
                    along = abs((x[i] - tx) * ax + (y[i] - ty) * ay + (z[i] - tz) * az)
                    ratio = along / (max_sine * away[i])
                    near = ratio <= 1.0
                    seen[i] = window[np.int32(ratio * scale + 0.5) if near else 0] if near else np.float32(0)
            for channel in range(cells.shape[1]):
                if weight[ping, channel] == 0:
                    continue
                _delays(
                    count, x, y, z, away, receive[ping, channel], velocity[ping, channel], sound_speed, first_time,
                    cell_rate, frequency, position, cycles,
                )  # fmt: skip
                part = np.float32(weight[ping, channel])
                for i in range(count):
                    inside = (position[i] >= 1.0) & (position[i] < last + 1.0)
                    share[i] = part * seen[i] if inside else np.float32(0)
                    totals[i] += share[i]
                prepare_taps(count, position, cycles, share, last, at, loose, taps, turned)
                add_interpolated(count, flat[ping, channel], at, taps, turned, sums)


@njit(inline="always")
def _delays(
    count: int, x: Doubles, y: Doubles, z: Doubles, away: Doubles, receive: Doubles, velocity: Doubles, c: float,
    first_time: float, cell_rate: float, frequency: float, position: Doubles, cycles: Doubles,
) -> None:  # fmt: skip
    """Delay of each pixel's echo by way of one receiver that moves, as a place among cells and as cycles.

    With A the way out, q the pixel seen from the receiver's place at the start and v its velocity, the delay solves
    |q - v tau| = c tau - A: a quadratic in tau.
    """
    ex, ey, ez = receive[0], receive[1], receive[2]
    vx, vy, vz = velocity[0], velocity[1], velocity[2]
    gain = 1.0 / (c * c - vx * vx - vy * vy - vz * vz)
    for i in range(count):
        qx, qy, qz = x[i] - ex, y[i] - ey, z[i] - ez
        half = c * away[i] - (qx * vx + qy * vy + qz * vz)
        # discriminant over c^2 - v^2, written so that still water and a still sonar give |q| c without cancelling
        square = qx * qx + qy * qy + qz * qz - away[i] * away[i]
        tau = (half + np.sqrt(half * half + square / gain)) * gain
        position[i] = (tau - first_time) * cell_rate
        cycles[i] = frequency * tau
