"""Receiver electronics: feedthrough, crosstalk, blanking, gain, clipping and quantisation.

Order: feedthrough from the transmitter and crosstalk between neighbours; blanking, which removes both; gain; full
scale; converter. Afterwards the gain is divided out, so that the recording stays in uPa.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.sonar.hydrophones import element_layout
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.receiver import Receiver
from insonify.sonar.sonar import Sonar
from insonify.synthesis.time_grid import TimeGrid
from insonify.units import amplitude_ratio

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

MAX_NEIGHBOUR_DISTANCE = 1.2
"""Largest distance of neighbouring elements, re the larger of their distances to the nearest element [1]."""
MAX_STEPWISE_DEVIATION = 1.5
"""Standard deviation below which the power of rounded numbers is summed over codes [steps]; above, rounding adds a
twelfth of a squared step, with an error of 1e-18."""
STEPS = 16
"""Number of codes in that sum."""


@dataclass(frozen=True, slots=True)
class ReceiverChain:
    """Receiver chain behind the hydrophones, prepared for the pings of one sonar."""

    feedthrough: Complexes
    """Feedthrough of the transmission into every channel [uPa], shape (samples,); empty for none."""
    neighbour_coupling: csr_array | None
    """Fraction of each channel that couples into each other one [1], shape (channels, channels); None for none."""
    blanked: NDArray[np.bool_]
    """Mask of the blanked samples, shape (samples,)."""
    gain: Floats
    """Gain before the converter, as a pressure ratio [1], shape (samples,)."""
    full_scale: float
    """Largest rms pressure of a tone at the converter [uPa]; infinite: no limit."""
    quantisation_step: float
    """Quantisation step of the converter [uPa]; 0: no rounding."""

    def pressures(self, received: NDArray[np.complex64]) -> NDArray[np.complex64]:
        """Recorded pressures [uPa], shape (channels, samples).

        A band-pass signal that clips keeps its phase, and its harmonics fall outside the band: the envelope is limited.
        Its two quadratures are rounded, with 0 at the middle of a step.
        """
        signal = received.astype(complex)
        if self.neighbour_coupling is not None:
            signal += self.neighbour_coupling @ signal
        if self.feedthrough.size:
            signal += self.feedthrough
        if self.full_scale < np.inf:
            signal = self._digitised(np.asarray(signal * self.gain, complex)) / self.gain
        return np.where(self.blanked, 0, signal).astype(np.complex64)

    def _digitised(self, amplified: Complexes) -> Complexes:
        """Pressures before the converter, limited to full scale and rounded [uPa], shape kept."""
        magnitude = np.abs(amplified)
        # values within full scale stay unchanged: a quotient by zero would overflow
        limited = amplified * (self.full_scale / np.maximum(magnitude, self.full_scale))
        if self.quantisation_step == 0:
            return limited
        top = self.full_scale / self.quantisation_step  # codes from -top to top - 1
        rounded = _quantised_code(limited.real / self.quantisation_step, top) + 1j * _quantised_code(
            limited.imag / self.quantisation_step, top
        )
        return np.asarray(self.quantisation_step * rounded, complex)

    def intensities(self, received: Floats) -> Floats:
        """Mean recorded intensities, given expected intensities [uPa^2], shape (channels, samples).

        Pressures are taken as circular Gaussian, as those of many scatterers and of noise are. Clipped, their power is
        I (1 - exp(-F / I)) with F the power of full scale, because powers are exponential; rounding is a sum over
        codes.
        """
        if self.feedthrough.size:
            received = received + np.abs(self.feedthrough) ** 2
        if self.full_scale < np.inf:
            amplified = received * self.gain**2
            # exp(-700) is negligible: a quotient by zero would overflow
            limited = amplified * -np.expm1(-(self.full_scale**2) / np.maximum(amplified, self.full_scale**2 / 700))
            received = self._quantised_power(limited) / self.gain**2
        return np.where(self.blanked, 0.0, received)

    def _quantised_power(self, power: Floats) -> Floats:
        """Mean power of rounded circular Gaussian numbers of a given power: each gains a twelfth of a squared step.

        Source: Widrow's statistical theory of quantisation (the twelfth); the sum over steps is the mean of the
        squared code, term by term.
        """
        from scipy.special import erfc

        if self.quantisation_step == 0:
            return power
        deviation = np.sqrt(power / 2) / self.quantisation_step
        rounded = power + self.quantisation_step**2 / 6
        is_small = deviation < MAX_STEPWISE_DEVIATION
        edges = np.arange(STEPS) + 0.5
        tail_probability = erfc(edges / (np.sqrt(2) * np.maximum(deviation[is_small], 1e-12)[:, None]))
        rounded[is_small] = 2 * self.quantisation_step**2 * (tail_probability @ (2 * np.arange(STEPS) + 1.0))
        return rounded


def _quantised_code(value: Floats, top: float) -> Floats:
    """Codes of the converter nearest to values in its steps [1], from -top to top - 1."""
    return np.asarray(np.clip(np.round(value), -top, top - 1))


def receiver_chain(sonar: Sonar, water: Water, pulse: ReceivedPulse, grid: TimeGrid) -> ReceiverChain | None:
    """Receiver chain of a sonar; None where it changes nothing.

    Args:
        sonar: The sonar, with all its sides.
        water: Water, whose sound speed and absorption determine the gain over time.
        pulse: The sonar's received pulse.
        grid: Sample times of a ping.
    """
    from scipy.sparse import csr_array

    receiver = sonar.receiver
    if not receiver.stages:
        return None
    feedthrough, neighbours = np.empty(0, complex), None
    if receiver.crosstalk is not None and receiver.crosstalk.feedthrough_db is not None:
        feedthrough_level_db = sonar.source_level_db + receiver.crosstalk.feedthrough_db
        feedthrough = amplitude_ratio(feedthrough_level_db) * pulse.samples(grid.time)
    if receiver.crosstalk is not None and receiver.crosstalk.neighbours_db is not None:
        neighbours = csr_array(float(amplitude_ratio(receiver.crosstalk.neighbours_db)) * neighbour_matrix(sonar))
    blanked = np.zeros(grid.sample_count, bool)
    if receiver.blanking is not None:
        blanked = grid.time < pulse.pulse.duration + receiver.blanking
    full_scale, step = _scale(receiver)
    return ReceiverChain(feedthrough, neighbours, blanked, receiver_gain(sonar, water, grid.time), full_scale, step)


def _scale(receiver: Receiver) -> tuple[float, float]:
    """Full scale and quantisation step of the converter [uPa]."""
    converter = receiver.adc
    if converter is None:
        return np.inf, 0.0
    full_scale = float(amplitude_ratio(converter.full_scale_db))
    return full_scale, 0.0 if converter.bits is None else full_scale * 2.0 ** (1 - converter.bits)


def receiver_gain(sonar: Sonar, water: Water, time: Floats) -> Floats:
    """Gain before the converter, as a pressure ratio [1], shape of `time`.

    Args:
        sonar: The sonar.
        water: Water, whose mean sound speed and absorption at the centre frequency are used.
        time: Time after the start of transmission [s], any shape.
    """
    if sonar.receiver.gain is None:
        return np.ones(np.shape(time))
    absorption = float(water.absorption(sonar.pulse.frequency))
    return amplitude_ratio(sonar.receiver.gain.db(time, water.sound_speed, absorption))


def neighbour_matrix(sonar: Sonar) -> Floats:
    """Adjacency of the channels: 1 for neighbours, else 0, shape (channels, channels).

    Args:
        sonar: The sonar, with all its sides; elements are neighbours on their own side, at their design positions.
    """
    from scipy.sparse import block_diag

    sides = []
    for side in sonar.side_sonars:
        position = element_layout(side.receive)[0]
        distance = np.linalg.norm(position[:, None] - position, axis=-1)
        np.fill_diagonal(distance, np.inf)
        nearest = distance.min(axis=1)
        sides.append((distance <= MAX_NEIGHBOUR_DISTANCE * np.maximum(nearest[:, None], nearest)).astype(float))
    return np.asarray(block_diag(sides).toarray())
