"""Expected intensity where some arrivals interfere and others do not.

Scatterers have random phases, so echoes of different scatterers add in power. Echoes of one scatterer by
different paths keep their phase relation: within such a group amplitudes add first and are squared afterwards.
Groups are short lists; clusters of arrivals further apart than the pulse duration are processed separately.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

_FAST = {"contract", "reassoc", "nsz", "arcp"}
_MAX_INSERTION_SORT = 64
"""Largest number of arrivals that are sorted by insertion; more are sorted by NumPy."""


@dataclass(frozen=True, slots=True, eq=False)
class PulseTable:
    """Received pulse, sampled finely enough for cubic interpolation."""

    samples: NDArray[np.complex128]
    """Complex envelope of the pulse [1], shape (n,)."""
    start: float
    """Time of the first sample re the arrival [s]."""
    rate: float
    """Samples per second, a whole multiple of the output rate [Hz]."""


def pulse_table(
    pulse: Callable[[NDArray[np.float64]], NDArray[np.complex128]], pulse_start: float, pulse_stop: float,
    sample_rate: float, *, oversampling: int = 32,
) -> PulseTable:  # fmt: skip
    """Sample the received pulse for `add_groups`.

    Args:
        pulse: Complex envelope [1] of the received pulse at times [s] re the arrival, shape preserved.
        pulse_start: First time at which the pulse is not negligible [s].
        pulse_stop: Last time at which the pulse is not negligible [s].
        sample_rate: Output samples per second [Hz].
        oversampling: Table entries per output sample; 32 keep the cubic's error below 3e-6 of the peak.

    Returns:
        Samples of the pulse, which is zero beyond them.
    """
    rate = oversampling * sample_rate
    time = pulse_start + np.arange(int(np.ceil((pulse_stop - pulse_start) * rate)) + 1) / rate
    return PulseTable(np.asarray(pulse(time), np.complex128), pulse_start, rate)


@njit(inline="always")
def _cubic(fraction: float) -> tuple[float, float, float, float]:
    """Weights of the four entries around a position 0..1 between the middle two (Lagrange)."""
    before, after, beyond = fraction + 1.0, 1.0 - fraction, 2.0 - fraction
    return (
        -fraction * after * beyond / 6.0,
        before * after * beyond / 2.0,
        before * fraction * beyond / 2.0,
        -before * fraction * after / 6.0,
    )


@njit(inline="always")
def _sort_by_delay(delay: NDArray[np.float64], order: NDArray[np.int64]) -> None:
    """Fill `order` with the numbers 0..n-1 by increasing delay; equal delays keep their order."""
    if delay.size > _MAX_INSERTION_SORT:
        order[: delay.size] = np.argsort(delay, kind="mergesort")
        return
    for i in range(delay.size):
        k = i
        # Not "greater": with this comparison a NaN delay leaves the others in order.
        while k > 0 and not (delay[order[k - 1]] <= delay[i]):
            order[k] = order[k - 1]
            k -= 1
        order[k] = i


@njit(inline="always")
def _equal_delays(
    delay: NDArray[np.float64], weight: NDArray[Any], order: NDArray[np.int64], j: int
) -> tuple[float, complex, float, int]:
    """Combine the arrivals from the j-th on that share its delay, such as a path and its reverse, to one pulse.

    Returns:
        Delay [s], sum of the weights [uPa], sum of their squared magnitudes [uPa^2], index of the next arrival.
    """
    shared_delay, weight_sum, power_sum = delay[order[j]], 0j, 0.0
    size = delay.size
    is_equal = True
    while is_equal:
        w = weight[order[j]]
        weight_sum += w
        power_sum += w.real * w.real + w.imag * w.imag
        j += 1
        is_equal = j < size and delay[order[j]] == shared_delay
    return shared_delay, weight_sum, power_sum, j


@njit(inline="always")
def _polyphase(table: NDArray[np.complex128], step: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Table regrouped, entries `step` apart side by side: real and imaginary parts, shape (step + 3, entries).

    Row r starts at entry r - 1, so that a cubic at phase r reads rows r to r + 3; zero outside the table.
    """
    length = (table.size - 1) // step + 1
    real, imaginary = np.zeros((step + 3, length)), np.zeros((step + 3, length))
    for r in range(step + 3):
        for k in range(length):
            entry = r - 1 + k * step
            if 0 <= entry < table.size:
                real[r, k], imaginary[r, k] = table[entry].real, table[entry].imag
    return real, imaginary


@njit(inline="always")
def _add_pulse(
    cluster: NDArray[np.float64], count: int, first: int, stop: int, real: NDArray[np.float64],
    imaginary: NDArray[np.float64], row: int, length: int, fraction: float, weight: complex, power: float,
) -> None:  # fmt: skip
    """Add one pulse to samples first..stop of a cluster: real part, imaginary part, and power."""
    c0, c1, c2, c3 = _cubic(fraction)
    # Unsigned indices: negative-index checks on signed ones would prevent vectorisation.
    k0, k1, k2, k3 = np.uint64(row), np.uint64(row + length), np.uint64(row + 2 * length), np.uint64(row + 3 * length)
    sum_real, sum_imaginary, sum_energy = np.uint64(first), np.uint64(count + first), np.uint64(2 * count + first)
    for step in range(stop - first):
        n = np.uint64(step)
        x = c0 * real[k0 + n] + c1 * real[k1 + n] + c2 * real[k2 + n] + c3 * real[k3 + n]
        y = c0 * imaginary[k0 + n] + c1 * imaginary[k1 + n] + c2 * imaginary[k2 + n] + c3 * imaginary[k3 + n]
        cluster[sum_real + n] += weight.real * x - weight.imag * y
        cluster[sum_imaginary + n] += weight.real * y + weight.imag * x
        cluster[sum_energy + n] += power * (x * x + y * y)


@njit(inline="always")
def _add_single_pulse(
    intensity: NDArray[np.float64], first: int, stop: int, real: NDArray[np.float64], imaginary: NDArray[np.float64],
    row: int, length: int, fraction: float, power: float,
) -> None:  # fmt: skip
    """Add the power of one pulse that overlaps no other of its group."""
    c0, c1, c2, c3 = _cubic(fraction)
    k0, k1, k2, k3 = np.uint64(row), np.uint64(row + length), np.uint64(row + 2 * length), np.uint64(row + 3 * length)
    for step in range(stop - first):
        n = np.uint64(step)
        x = c0 * real[k0 + n] + c1 * real[k1 + n] + c2 * real[k2 + n] + c3 * real[k3 + n]
        y = c0 * imaginary[k0 + n] + c1 * imaginary[k1 + n] + c2 * imaginary[k2 + n] + c3 * imaginary[k3 + n]
        intensity[np.uint64(first) + n] += power * (x * x + y * y)


@njit(inline="always")
def _end_cluster(
    intensity: NDArray[np.float64], cluster: NDArray[np.float64], first: int, stop: int, interfering: float,
    independent: float,
) -> None:  # fmt: skip
    """Add the power of samples first..stop of a cluster to the intensity, and clear them."""
    count = intensity.size
    for n in range(first, stop):
        real, imaginary = cluster[n], cluster[count + n]
        intensity[n] += interfering * (real * real + imaginary * imaginary) + independent * cluster[2 * count + n]
        cluster[n] = cluster[count + n] = cluster[2 * count + n] = 0.0


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def add_groups(
    intensity: NDArray[np.float64], start: float, rate: float, table: NDArray[np.complex128], table_start: float,
    table_rate: float, group_first: NDArray[np.int64], delay: NDArray[np.float64], weight: NDArray[Any],
    interfering: float = 1.0, independent: float = 0.0,
) -> None:  # fmt: skip
    """Add interfering |sum_k w_k p(t - tau_k)|^2 + independent sum_k |w_k p(t - tau_k)|^2 of every group.

    With phase jitter up to J wavelengths per replica and relative amplitude spread p, the expectation has
    interfering = sinc^2 J and independent = 1 + p^2 / 3 - sinc^2 J.

    Args:
        intensity: Intensity at the output samples [uPa^2], added to in place, shape (count,).
        start: Time of the first output sample [s].
        rate: Output samples per second [Hz].
        table: Samples of the received pulse, as `pulse_table` makes them, shape (m,).
        table_start: Time of the first entry re the arrival [s].
        table_rate: Entries per second, a whole multiple of the rate [Hz].
        group_first: First arrival of each group and, last, the number of arrivals, shape (groups + 1,).
        delay: Delay of each arrival [s], in any order within its group, shape (n,).
        weight: Complex weight of each arrival, carrier phase included [uPa], shape (n,).
        interfering: Weight of the power of the sum [1].
        independent: Weight of the sum of the powers [1].

    Raises:
        ValueError: The table's rate is not a whole multiple of the output rate.
    """
    step = int(np.rint(table_rate / rate))
    if step < 1 or abs(table_rate / rate - step) > 1e-9 * step:
        raise ValueError("the pulse table needs a whole number of entries per output sample")
    count = intensity.size
    cluster = np.zeros(3 * count)
    rows_real, rows_imaginary = _polyphase(table, step)
    real, imaginary = rows_real.ravel(), rows_imaginary.ravel()
    length = rows_real.shape[1]
    order = np.empty(max(1, np.max(np.diff(group_first))) if group_first.size > 1 else 1, np.int64)
    for g in range(group_first.size - 1):
        tau, w = delay[group_first[g] : group_first[g + 1]], weight[group_first[g] : group_first[g + 1]]
        _sort_by_delay(tau, order)
        begin, end, j = 0, 0, 0  # begin to end: samples of the open cluster
        while j < tau.size:
            shared_delay, weight_sum, power_sum, j = _equal_delays(tau, w, order, j)
            position = (start - shared_delay - table_start) * rate
            if not (abs(position) < 1e15):
                continue
            whole_step = np.floor(position)
            phase_position = (position - whole_step) * step
            phase = min(int(phase_position), step - 1)
            entries_before = int(whole_step)  # entries of the row before the first sample
            first, stop = max(0, -entries_before), min(count, length - entries_before)
            if stop <= first or power_sum == 0:
                continue
            row = phase * length + entries_before + first
            if first >= end:
                _end_cluster(intensity, cluster, begin, end, interfering, independent)
                begin = end = first
                if j == tau.size or tau[order[j]] - shared_delay > (length + 1) / rate:
                    power = interfering * abs(weight_sum) ** 2 + independent * power_sum
                    _add_single_pulse(
                        intensity, first, stop, real, imaginary, row, length, phase_position - phase, power
                    )
                    continue
            end = max(end, stop)
            _add_pulse(
                cluster, count, first, stop, real, imaginary, row, length, phase_position - phase, weight_sum, power_sum
            )
        _end_cluster(intensity, cluster, begin, end, interfering, independent)
