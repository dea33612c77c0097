"""Kernel of delay-and-sum: element series summed along the delays of a dynamic focus."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.processing._fractional_delay import BLOCK, FAST, CellClock, TapBlock, add_interpolated, prepare_taps

Doubles = NDArray[np.float64]


class WeightedElements(NamedTuple):
    """Elements that are summed to beams, positions from the centre of their array."""

    element: Doubles
    """Position of each element [m], shape (channels, 3)."""
    weight: Doubles
    """Weight of each element [1], shape (channels,)."""
    transmit: Doubles
    """Position of the transmitter [m], shape (3,)."""


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def delay_and_sum(
    cells: NDArray[np.complex64], clock: CellClock, time: Doubles, array: WeightedElements, direction: Doubles,
    focus: float, out: NDArray[np.float32],
) -> None:  # fmt: skip
    """Add one ping's elements to beams.

    Args:
        cells: Fine cells of the elements, shape (channels, cells).
        clock: Times of the cells.
        time: Sample times of the beams [s], shape (samples,).
        array: The elements.
        direction: Unit vectors, shape (beams, 3).
        focus: Range of the focus [m]: negative for a dynamic focus, above 1e9 for infinity.
        out: Beams, real and imaginary parts alternating, added to in place, shape (beams, 2 samples).
    """
    flat, last = cells.view(np.float32), cells.shape[1] - 4
    first_time, cell_rate, frequency, sound_speed = clock
    element, weight, transmit = array
    block = TapBlock(np.empty(BLOCK, np.int32), np.empty((4, BLOCK), np.float32), np.empty(4 * BLOCK, np.float32),
                     np.empty((2, BLOCK), np.float32))  # fmt: skip
    focus_range, position, cycles = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    sample_weight = np.empty(BLOCK, np.float32)
    for begin in range(0, time.size, BLOCK):
        sample_time = time[begin : begin + BLOCK]
        for beam in range(direction.shape[0]):
            _focus(sample_time, sound_speed, transmit, direction[beam], focus, focus_range)
            sums = out[beam, 2 * begin : 2 * begin + 2 * sample_time.size]
            for channel in range(cells.shape[0]):
                ex, ey, ez = element[channel, 0], element[channel, 1], element[channel, 2]
                along = ex * direction[beam, 0] + ey * direction[beam, 1] + ez * direction[beam, 2]
                square = ex * ex + ey * ey + ez * ez
                element_weight = np.float32(weight[channel])
                for i in range(sample_time.size):
                    # |r u - e| - r without the difference of two long ranges
                    change = square - 2.0 * along * focus_range[i]
                    excess_range = change / (np.sqrt(focus_range[i] * focus_range[i] + change) + focus_range[i])
                    delay = (-along if focus > 1e9 else excess_range) / sound_speed
                    position[i] = (sample_time[i] + delay - first_time) * cell_rate
                    cycles[i] = frequency * delay
                    sample_weight[i] = element_weight
                prepare_taps(sample_time.size, position, cycles, sample_weight, last, block)
                add_interpolated(sample_time.size, flat[channel], block, sums)


@njit(inline="always")
def _focus(time: Doubles, c: float, transmit: Doubles, direction: Doubles, focus: float, focus_range: Doubles) -> None:
    """Range from the array's centre at which each sample is in focus [m], shape (samples,).

    An echo received at t comes from the r for which |r u - d| + r = c t, with d the transmitter's position.
    """
    dx, dy, dz = transmit[0], transmit[1], transmit[2]
    along, square = dx * direction[0] + dy * direction[1] + dz * direction[2], dx * dx + dy * dy + dz * dz
    for i in range(time.size):
        path = c * time[i]
        beyond = path > np.sqrt(square)
        moving = (path * path - square) / (2.0 * (path - along)) if beyond else 0.0
        focus_range[i] = max(moving if focus < 0 else focus, 1e-3)
