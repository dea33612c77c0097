"""Energies of a swath: every pair of legs of every point, and how pairs closer than the pulse interfere."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.sonar._beam_kernels import element_gain, look_up
from insonify.synthesis._fastmath import sincos_cycles

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def swath_gains(
    departure: NDArray[np.float32], axes: Floats, steer: Floats, scale: Floats, tables: tuple[Floats, ...],
    per_unit: Floats, element: int, out: NDArray[np.float32],
) -> None:  # fmt: skip
    """Amplitude of one beam towards all legs of a swath, as `_beam_kernels.gains`, into out of shape (f, n).

    Args:
        departure: Unit vectors in the world [1], (f, 3, n).
        axes: As of `Beams`.
        steer: Of its one beam, (1, 2).
        scale: Likewise, (1,).
        tables: As of `Beams`.
        per_unit: Likewise.
        element: Likewise.
        out: Result [1], (f, n).
    """
    across, down, piston_across, piston_down = tables
    plain = piston_across.shape[0] == 0 and piston_down.shape[0] == 0
    for f in range(departure.shape[0]):
        for n in range(departure.shape[2]):
            x, y, z = np.float64(departure[f, 0, n]), np.float64(departure[f, 1, n]), np.float64(departure[f, 2, n])
            w = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]
            u = x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
            v = x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2]
            gain = scale[0] * element_gain(element, w)
            gain *= look_up(across, per_unit[0], u - steer[0, 0]) * look_up(down, per_unit[1], v - steer[0, 1])
            if not plain:
                gain *= look_up(piston_across, per_unit[2], u) * look_up(piston_down, per_unit[3], v)
            out[f, n] = gain


@njit(cache=True, nogil=True, error_model="numpy")
def pair_energies(
    delay: Floats, amplitude: NDArray[np.complex64], sent: NDArray[Any], heard: NDArray[Any], pair: NDArray[np.int64],
    section: NDArray[Any], level: float, frequency: float, likeness: NDArray[np.complex64], rate: float, kept: float,
    apart: float, begin: int, stop: int, late: Floats, energy: Floats,
) -> int:  # fmt: skip
    """Delays and energies of all that a swath sends back.

    A pair and its reverse arrive together, as one. Two arrivals closer than the pulse add twice the real part of
    their product, laid down half way between them with the energy that their overlap has.

    Args:
        delay: One way, of each leg [s], (f, n).
        amplitude: Of each leg [1], (f, n).
        sent: Gain of the transmit beam [1], (f, n).
        heard: Of the receive beam [1], (f, n).
        pair: Rows of two legs, the first never after the second, (p, 2).
        section: Cross section times area [m^2], (p, n).
        level: Pressure of the source at 1 m [uPa].
        frequency: Of the carrier [Hz].
        likeness: Autocorrelation of the pulse at lags from 0 on, 1 at 0 [1], (lags,).
        rate: Lags per second [Hz].
        kept: Part of interference that jitter leaves [1].
        apart: Energy of each replica that does not interfere [1].
        begin: First point that is wanted.
        stop: After the last of them.
        late: Result, delays [s], room for p (p + 1) / 2 for every point, (room,).
        energy: Result, energies, (room,).

    Returns:
        How many there are.
    """
    count = pair.shape[0]
    tau, real, imag = np.empty((3, count))
    reach = (likeness.size - 1) / rate
    found = 0
    if count == 1:
        for n in range(begin, stop):
            one, gain = amplitude[0, n], np.float64(sent[0, n]) * heard[0, n] * level
            size = np.float64(one.real * one.real + one.imag * one.imag) * gain
            late[n - begin], energy[n - begin] = 2 * delay[0, n], (kept + apart) * size * size * section[0, n]
        return stop - begin
    for n in range(begin, stop):
        m = 0
        for p in range(count):
            i, j = pair[p, 0], pair[p, 1]
            there, back = sent[i, n] * heard[j, n], sent[j, n] * heard[i, n] if i != j else np.float32(0)
            both = amplitude[i, n] * amplitude[j, n]
            size = np.float64(both.real * both.real + both.imag * both.imag) * section[p, n] * level * level
            if not size > 0:
                continue
            tau[m] = delay[i, n] + delay[j, n]
            late[found] = tau[m]
            energy[found] = size * (kept * (there + back) ** 2 + apart * (there * there + back * back))
            root = level * math.sqrt(section[p, n]) * (there + back)
            real[m], imag[m] = root * both.real, root * both.imag
            found += 1
            m += 1
        for p in range(m):
            for q in range(p):
                lag = tau[q] - tau[p]
                if abs(lag) < reach:
                    late[found] = 0.5 * (tau[p] + tau[q])
                    energy[found] = 2 * kept * _overlap(real, imag, p, q, lag, likeness, rate, frequency)
                    found += 1
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _overlap(
    real: Floats, imag: Floats, p: int, q: int, lag: float, likeness: NDArray[np.complex64], rate: float,
    frequency: float,
) -> float:  # fmt: skip
    """Real part of what arrivals p and q, q by a lag [s] the later, have in common; arguments as of `pair_energies`."""
    if lag < 0:
        p, q, lag = q, p, -lag
    place = lag * rate
    cell = min(int(place), likeness.size - 2)
    part = place - cell
    low, high = likeness[cell], likeness[cell + 1]
    a, b = low.real + part * (high.real - low.real), low.imag + part * (high.imag - low.imag)
    sine, cosine = sincos_cycles(frequency * lag)
    turned_real, turned_imag = a * cosine - b * sine, a * sine + b * cosine
    c, d = real[p] * real[q] + imag[p] * imag[q], imag[p] * real[q] - real[p] * imag[q]
    return c * turned_real - d * turned_imag
