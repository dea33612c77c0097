"""Waveform basis: Doppler-stretched copies of a pulse, of which the echoes of a moving sonar are weighted sums.

An echo from ahead is the pulse compressed in time. Instead of a waveform for every echo there are a few, at nodes in
the range of Doppler factors in the beams, and every echo is a weighted sum of these. Each is stretched about its
middle, where its phase is that of the transmitted pulse: only the phase of half a pulse has to be approximated.

Echoes from side lobes, whose Doppler factors differ most, are weak, and so are their errors. The nodes are Chebyshev's
of a part of the range about the Doppler factor of the main lobe, as wide as the error, times the gain of the direction,
is least. Their number follows from the error bound.

Source: error of interpolation by polynomials, Davis (1975), Interpolation and Approximation, theorem 3.1.1: for n nodes
x_k and exp(j phi x), at most phi^n / n! |(x - x_1) ... (x - x_n)|.
"""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.recent_results import Identity, RecentResults
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.sub_bands import SubBand, half_bandwidth, lagrange_weights, node_count
from insonify.synthesis._waveform_basis_kernel import BasisWeights, basis_weight_table
from insonify.synthesis.time_grid import TimeGrid, grid_factors

Floats = NDArray[np.float64]

ERROR = 1e-6
"""Largest error of the weighted sum, re the peak of an echo from the direction of the largest gain [1]."""
MAX_WAVEFORMS = 48
"""Largest number of waveforms [1]."""
NEGLIGIBLE_GAIN = 10 ** (-60 / 20)
"""Two-way amplitude gain below which a direction's Doppler factor is neglected, re the largest gain [1]."""
_LEAST_BOUND = 1.15 * NEGLIGIBLE_GAIN
"""Least gain of a `DopplerSpectrum` [1]: few evaluated directions are near the threshold, and those between them may
exceed their gain, by 0.3 % at -59 dB."""
_AZIMUTHS, _ELEVATIONS = 720, 37
"""Numbers of azimuths and elevations of the directions in which gains are evaluated."""
_STEPS = 129
"""Number of Doppler factors of a `DopplerSpectrum`."""
_MARGIN = 0.02
"""Tolerance for the spacing of evaluated directions, more than the sine of half of it [1]."""
_MAX_EXPONENT = 600.0
"""Largest exponent with which errors are evaluated, against overflow: products of distances may exceed 1 [1]."""
_SPREADS = np.array([1.0, 0.95, 0.9, 0.8, 0.65, 0.5, 0.4, 0.32, 0.25, 0.2, 0.16, 0.12, 0.1])
"""Spreads of nodes about the peak that are tried, re that of Chebyshev nodes of the whole range [1]."""


@dataclass(frozen=True, slots=True)
class WaveformBasis:
    """Waveforms of which every echo is a weighted sum: one for each Doppler node at each frequency node."""

    doppler: Floats
    """Doppler factor less one of each node, increasing [1], shape (dopplers,)."""
    doppler_limits: tuple[float, float] = (0.0, 0.0)
    """Doppler factors less one below and above which an echo has the waveform of the limit [1]."""
    band: Floats = field(default_factory=lambda: np.zeros(1))
    """Offset of each node from the carrier, increasing [Hz], shape (bands,)."""
    band_edge: float = np.inf
    """Offset from the carrier beyond which the absorption of an echo is held constant [Hz]."""

    def grid_factors(self, pulse: ReceivedPulse, grid: TimeGrid) -> NDArray[np.complex128]:
        """Factors of each waveform for `convolve_waveforms` [1], shape (bands, dopplers, padded).

        Cached for the last few sonars: at constant speed and attitude they are the same at every ping.
        """
        key = (Identity(pulse), self.doppler.tobytes(), self.band.tobytes(), self.band_edge, grid)
        return _FACTORS.get(key, lambda: grid_factors(grid, self.spectra(pulse, grid.frequencies)))

    def spectra(self, pulse: ReceivedPulse, frequencies: Floats) -> NDArray[np.complex128]:
        """Spectrum of each waveform at offsets from the carrier [s], shape (bands, dopplers, frequencies)."""
        stretched = [
            pulse.spectrum(frequencies, float(factor)) * _stretch_about_middle(pulse, float(factor), frequencies)
            for factor in self.doppler
        ]
        return np.asarray(
            lagrange_weights(self.band, frequencies, -self.band_edge, self.band_edge)[:, None] * np.array(stretched)
            + 0j
        )

    def _part(self, pulse: ReceivedPulse, band: int, row: int, offset: Floats) -> NDArray[np.complex128]:
        """Weight of frequency node `band` at offsets from the carrier [Hz], with the shift of Doppler node `row` [1].

        The shift is that of `_stretch_about_middle`; shape of offset.
        """
        centred = _stretch_about_middle(pulse, float(self.doppler[row]), offset)
        return np.asarray(lagrange_weights(self.band, offset, -self.band_edge, self.band_edge)[band] * centred)

    def weights(self, doppler: Floats) -> Floats:
        """Weight of each Doppler node in some echoes [1], shape (dopplers, n).

        Args:
            doppler: Doppler factors of the echoes less one [1], shape (n,).
        """
        return lagrange_weights(self.doppler, doppler, *self.doppler_limits)

    @property
    def weight_table(self) -> BasisWeights:
        """Weights of echoes in the waveforms, for kernels."""
        return basis_weight_table(self.doppler, *self.doppler_limits)

    def samples(self, pulse: ReceivedPulse, time: Floats, doppler: Floats) -> NDArray[np.complex128]:
        """Waveforms of some echoes of unit pressure in each band [1], shape (bands, n), of which the echo is the sum.

        Args:
            pulse: The received pulse.
            time: Time since each echo's delay [s], shape (n,).
            doppler: Doppler factors of the echoes less one [1], shape (n,).
        """
        if len(self.band) == 1 and len(self.doppler) == 1:
            return pulse.samples(time)[None]
        node_weights, waveforms = self.weights(doppler), np.zeros((len(self.band), len(time)), complex)
        shift = start_delay(pulse, doppler)
        for band, row in np.ndindex(waveforms.shape[0], len(node_weights)):
            tables = pulse.doppler_filtered(float(self.doppler[row]), partial(self._part, pulse, band, row))
            waveforms[band] += node_weights[row] * tables.samples(time + shift)
        return waveforms * np.exp(2j * np.pi * pulse.pulse.frequency * shift)


def start_delay(pulse: ReceivedPulse, doppler: ArrayLike) -> Floats:
    """Delay of a stretched pulse's start re an unstretched pulse with the same middle [s], shape of doppler.

    Args:
        pulse: The received pulse.
        doppler: Doppler factors less one [1], any shape.
    """
    d = np.asarray(doppler, float)
    return np.asarray(pulse.pulse.duration / 2 * d / (1 + d))


def _stretch_about_middle(pulse: ReceivedPulse, doppler: float, offset: Floats) -> NDArray[np.complex128]:
    """Phase factors that shift a pulse stretched about its start to one about its middle [1], shape of offset."""
    return np.asarray(np.exp(-2j * np.pi * (pulse.pulse.frequency + offset) * start_delay(pulse, doppler)))


Plane = tuple[Floats, float]
"""Directions about a plane: its normal, a unit vector (3,), and their largest cosine with it [1]."""


def waveform_basis(
    ping_geometry: PingGeometry, error: float = ERROR, bands: Sequence[SubBand] | None = None,
    across: Plane | None = None,
) -> WaveformBasis:  # fmt: skip
    """Waveform basis of one ping.

    Args:
        ping_geometry: The sonar, which may be moving.
        error: Largest error of the weighted sum, see `ERROR` [1].
        bands: Frequencies of the band; None: those of the ping's sub-bands.
        across: Directions of arrival to which the basis is restricted; None: all.
    """
    bands = ping_geometry.sub_bands if bands is None else bands
    band = np.array([sub.offset for sub in bands] if bands else [0.0])
    if ping_geometry.is_static:
        return WaveformBasis(np.zeros(1), (0.0, 0.0), band, half_bandwidth(ping_geometry.pulse) if bands else np.inf)
    key = (*_motion_key(ping_geometry), band.tobytes(), error, across and (across[0].tobytes(), across[1]))
    return _BASES.get(key, lambda: _moving_basis(ping_geometry, error, band, bool(bands), across))


def _motion_key(ping_geometry: PingGeometry) -> tuple[Hashable, ...]:
    """All that Doppler factors depend on; a sonar at constant speed and attitude has the same at every ping."""
    motion = ping_geometry.receive_motion
    assert motion is not None
    objects = ping_geometry.pulse, ping_geometry.transmit_beams, ping_geometry.receive_beams, ping_geometry.elements
    _, velocity, acceleration = motion.kinematics(ping_geometry.lever_arms[1:])
    return (
        *map(Identity, objects), ping_geometry.receive_track_extent is None, motion.window, velocity.tobytes(),
        acceleration.tobytes(), ping_geometry.transmit_velocity.tobytes(), ping_geometry.sound_speed,
        ping_geometry.receive_sound_speed,
    )  # fmt: skip


def _moving_basis(
    ping_geometry: PingGeometry, error: float, band: Floats, has_bands: bool, across: Plane | None
) -> WaveformBasis:  # fmt: skip
    """Compute the waveform basis of a moving sonar; arguments are those of `waveform_basis`."""
    pulse, edge = ping_geometry.pulse.pulse, half_bandwidth(ping_geometry.pulse) if has_bands else np.inf
    widening = pulse.frequency / max(pulse.frequency - edge, pulse.frequency / 2) if has_bands else 1.0
    spectrum = doppler_spectrum(ping_geometry, widening, across)
    middle, half = (spectrum.low + spectrum.high) / 2, (spectrum.high - spectrum.low) / 2
    phase = math.pi * (pulse.frequency + pulse.bandwidth / 2) * pulse.duration * half
    nodes = middle + half * doppler_nodes(spectrum, phase, error)
    return WaveformBasis(nodes, (spectrum.low, spectrum.high), band, edge)


class DopplerSpectrum(NamedTuple):
    """Doppler factors in the beams during one ping, and the gain with which echoes of such factors are received."""

    low: float
    """Least Doppler factor less one [1]."""
    high: float
    """Greatest Doppler factor less one [1]."""
    peak: float
    """Doppler factor less one in the direction of the largest gain, -1..1 from the least to the greatest [1]."""
    gain: Floats
    """Two-way gain re the largest, of the strongest direction at each of some equal steps from the least to the
    greatest factor, or farther from the peak [1], shape (steps,)."""


def doppler_nodes(spectrum: DopplerSpectrum, phase: float, error: float = ERROR) -> Floats:
    """Smallest number of Doppler nodes that keep the error, as far apart as they then may be; at most `MAX_WAVEFORMS`.

    Args:
        spectrum: Doppler factors and gains.
        phase: Largest phase by which a Doppler factor at the end of the range turns the end of the pulse, re the middle
            of both [rad].
        error: Largest error times gain [1].

    Returns:
        Nodes, increasing, -1..1 from the least to the greatest factor [1], shape (n,).
    """
    fewest, most = 1, node_count(phase, error, MAX_WAVEFORMS)  # Chebyshev's of the whole range
    while fewest < most:
        count = (fewest + most) // 2
        if _nodes_and_error(spectrum, phase, count, error)[1] <= error:
            most = count
        else:
            fewest = count + 1
    return _nodes_and_error(spectrum, phase, most, error)[0]


def _nodes_and_error(spectrum: DopplerSpectrum, phase: float, count: int, error: float) -> tuple[Floats, float]:
    """Chebyshev nodes, drawn together about the peak until the error is kept (or least), and their error times gain."""
    node = -np.cos((np.arange(count) + 0.5) * np.pi / count)
    nodes = spectrum.peak + _SPREADS[:, None] * (node - spectrum.peak)
    x = np.linspace(-1, 1, len(spectrum.gain))
    product = np.abs(x - nodes[:, :, None]).prod(axis=1)
    scale = math.exp(min(count * math.log(max(phase, 1e-300)) - math.lgamma(count + 1), _MAX_EXPONENT))
    errors = scale * (spectrum.gain * product).max(axis=1)
    row = int(np.argmax(errors <= error)) if (errors <= error).any() else int(np.argmin(errors))
    return nodes[row], float(errors[row])


def doppler_spectrum(
    ping_geometry: PingGeometry, widening: float = 1.0, across: Plane | None = None
) -> DopplerSpectrum:  # fmt: skip
    """Doppler factors and gains of one ping.

    A monostatic sonar has both legs in one direction; a bistatic one combines all transmit with all receive directions,
    at a gain of 1.

    Args:
        ping_geometry: The sonar, which is moving.
        widening: Largest ratio of beam widths at any frequency of the band to those at the carrier [1].
        across: Directions of arrival to which it is restricted; None: all.
    """
    assert ping_geometry.receive_motion is not None
    is_bistatic = ping_geometry.receive_track_extent is not None
    same_orientation = ping_geometry.elements is None or not np.any(ping_geometry.elements.orientations)
    transmit_directions, receive_directions, gain = _insonified_directions(
        ping_geometry.transmit_beams, ping_geometry.receive_beams if same_orientation else None, is_bistatic=is_bistatic
    )
    if across is not None:
        near = np.abs(receive_directions @ across[0]) <= across[1] + _MARGIN / 2
        if near.any():
            receive_directions = receive_directions[near]
            if not is_bistatic:
                transmit_directions, gain = transmit_directions[near], gain[near]
    _, first, acceleration = (row[0] for row in ping_geometry.receive_motion.kinematics(ping_geometry.lever_arms[1:]))
    transmit_velocity = ping_geometry.transmit_velocity
    receive_velocities = [first, first + acceleration * ping_geometry.receive_motion.window]
    departing = 1 - transmit_directions @ transmit_velocity / ping_geometry.sound_speed
    arriving = [
        1 + receive_directions @ velocity / ping_geometry.receive_sound_speed for velocity in receive_velocities
    ]
    if is_bistatic:
        departing, arriving = _extremes(departing)[:, None], [_extremes(part) for part in arriving]
    factor = np.concatenate([(part / departing - 1).ravel() for part in arriving])
    margin = (
        _MARGIN
        * float(max(np.linalg.norm(transmit_velocity), *(np.linalg.norm(v) for v in receive_velocities)))
        / ping_geometry.sound_speed
    )
    low, high = float(factor.min()) - margin, float(factor.max()) + margin
    if is_bistatic or low == high:  # two platforms; arrays that turn about their centres
        return DopplerSpectrum(low, high, 0.0, np.ones(_STEPS))
    per_step, x = (high - low) / (_STEPS - 1), np.linspace(low, high, _STEPS)
    peak, gains = factor[int(np.argmax(gain))], np.resize(gain, len(factor))
    off_peak = factor - peak
    step = np.clip((peak + widening * off_peak + np.sign(off_peak) * margin - low) / per_step, 0, _STEPS - 1)
    above_peak, below_peak = np.zeros((2, _STEPS))
    np.maximum.at(above_peak, step[off_peak >= 0].astype(int), gains[off_peak >= 0])
    np.maximum.at(below_peak, np.ceil(step[off_peak <= 0]).astype(int), gains[off_peak <= 0])
    envelope = np.where(x >= peak, np.maximum.accumulate(above_peak[::-1])[::-1], np.maximum.accumulate(below_peak))
    envelope[np.abs(x - peak) <= margin] = 1.0  # between the directions
    envelope = np.maximum(envelope, _LEAST_BOUND)
    return DopplerSpectrum(low, high, 2 * (peak - low) / (high - low) - 1, envelope)


def doppler_range(ping_geometry: PingGeometry) -> tuple[float, float]:
    """Least and greatest Doppler factor less one in the beams during one ping [1]."""
    spectrum = doppler_spectrum(ping_geometry)
    return spectrum.low, spectrum.high


_DIRECTIONS: RecentResults[tuple[Floats, Floats, Floats]] = RecentResults(8)
_BASES: RecentResults[WaveformBasis] = RecentResults(8)
_FACTORS: RecentResults[NDArray[np.complex128]] = RecentResults(8)
_AXES_DECIMALS = 12
"""Decimals of the receive array's axes in the transmit array's frame: the same for all attitudes of the sonar."""


def _insonified_directions(
    transmit_beams: Beams, receive_beams: Beams | None, *, is_bistatic: bool
) -> tuple[Floats, Floats, Floats]:
    """Directions in the transmit and the receive beams, and amplitude gain in the latter; cached for the same arrays.

    Args:
        transmit_beams: Transmit beams.
        receive_beams: Receive beams; None: omnidirectional.
        is_bistatic: True for two platforms; otherwise the two-way gain counts.

    Returns:
        Unit vectors with transmit gain in the world [1], shape (any, 3).
        Unit vectors with receive gain in the world [1], shape (n, 3).
        Gain in the latter re the largest [1], shape (n,).
    """
    frame, key = transmit_beams.axes, [is_bistatic, transmit_beams.pattern_key]
    transmit, receive = transmit_beams.rotated(np.eye(3)), None
    if receive_beams is not None:
        receive = receive_beams.rotated(np.round(receive_beams.axes @ frame.T, _AXES_DECIMALS) + 0.0)
        key += [receive.axes.tobytes(), receive.pattern_key]
    directions = _DIRECTIONS.get(tuple(key), lambda: _directions_in_beams(transmit, receive, is_bistatic=is_bistatic))
    return directions[0] @ frame, directions[1] @ frame, directions[2]


def _directions_in_beams(
    transmit_beams: Beams, receive_beams: Beams | None, *, is_bistatic: bool
) -> tuple[Floats, Floats, Floats]:
    """Compute the result of `_insonified_directions` in the frame of the transmit array."""
    azimuth, down = np.meshgrid(
        np.linspace(-np.pi, np.pi, _AZIMUTHS, endpoint=False), np.linspace(-np.pi / 2, np.pi / 2, _ELEVATIONS)
    )
    horizontal = np.cos(down)
    direction = np.stack([horizontal * np.cos(azimuth), horizontal * np.sin(azimuth), np.sin(down)], axis=-1).reshape(
        -1, 3
    )
    transmit_gain = transmit_beams.largest_gain(direction)
    receive_gain = np.ones(len(direction)) if receive_beams is None else receive_beams.largest_gain(direction)
    if not is_bistatic:
        transmit_gain = receive_gain = transmit_gain * receive_gain
    transmit_directions, receive_directions = (
        direction[gain >= NEGLIGIBLE_GAIN * gain.max()] for gain in (transmit_gain, receive_gain)
    )
    gain = receive_gain[receive_gain >= NEGLIGIBLE_GAIN * receive_gain.max()]
    return transmit_directions, receive_directions, gain / gain.max()


def _extremes(values: Floats) -> Floats:
    """Least and greatest of some values, shape (2,)."""
    return np.array([values.min(), values.max()])
