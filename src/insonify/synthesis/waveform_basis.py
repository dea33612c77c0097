"""Waveform basis: Doppler-stretched copies of a pulse, of which the echoes of a moving sonar are weighted sums.

An echo from ahead is the pulse compressed in time. Instead of a waveform for every echo there are a few, at Chebyshev
nodes over the range of Doppler factors in the beams, and every echo is a weighted sum of these; their number follows
from the error bound. Each is stretched about its middle, where its phase is that of the transmitted pulse: only the
phase of half a pulse has to be approximated.

Source: interpolation at Chebyshev nodes, as in `sub_bands`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.recent_results import Identity, RecentResults
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.pulse import Pulse
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.sub_bands import SubBand, half_bandwidth, lagrange_weights, node_count

Floats = NDArray[np.float64]

ERROR = 1e-6
"""Error of the weighted sum, re the pulse's peak [1]."""
MAX_WAVEFORMS = 48
"""Largest number of waveforms [1]."""
NEGLIGIBLE_GAIN = 10 ** (-45 / 20)
"""Two-way gain below which a direction's Doppler factor is neglected, re the largest gain [1]."""
_AZIMUTHS, _ELEVATIONS = 720, 37


@dataclass(frozen=True, slots=True)
class WaveformBasis:
    """Waveforms of which every echo is a weighted sum: one for each Doppler node at each frequency node."""

    doppler: Floats
    """Doppler factor less one of each node, increasing [1], shape (dopplers,)."""
    band: Floats = field(default_factory=lambda: np.zeros(1))
    """Offset of each node from the carrier, increasing [Hz], shape (bands,)."""
    band_edge: float = np.inf
    """Offset from the carrier beyond which the absorption of an echo is held constant [Hz]."""

    def spectra(self, pulse: ReceivedPulse, frequencies: Floats) -> NDArray[np.complex128]:
        """Spectrum of each waveform at offsets from the carrier [s], shape (bands, dopplers, frequencies).

        Cached for the last few sonars: at constant speed and attitude they are the same at every ping.
        """
        key = (Identity(pulse), self.doppler.tobytes(), self.band.tobytes(), self.band_edge, frequencies.tobytes())
        return _SPECTRA.get(key, lambda: self._spectra(pulse, frequencies))

    def _spectra(self, pulse: ReceivedPulse, frequencies: Floats) -> NDArray[np.complex128]:
        """Spectrum of each waveform, computed."""
        stretched = [
            pulse.spectrum(frequencies, float(factor)) * _stretch_about_middle(pulse, float(factor), frequencies)
            for factor in self.doppler
        ]
        return np.asarray(
            lagrange_weights(self.band, frequencies, -self.band_edge, self.band_edge)[:, None] * np.array(stretched)
            + 0j
        )

    def _part(self, pulse: ReceivedPulse, band: int, row: int, offset: Floats) -> NDArray[np.complex128]:
        """Weight of one waveform's frequency node at offsets from the carrier [Hz], with the shift about its middle."""
        centred = _stretch_about_middle(pulse, float(self.doppler[row]), offset)
        return np.asarray(lagrange_weights(self.band, offset, -self.band_edge, self.band_edge)[band] * centred)

    def weights(self, doppler: Floats) -> Floats:
        """Weight of each Doppler node in some echoes [1], shape (dopplers, n).

        Args:
            doppler: Doppler factors of the echoes less one [1], shape (n,).
        """
        middle, half = (self.doppler[0] + self.doppler[-1]) / 2, (self.doppler[-1] - self.doppler[0]) / 2
        half = half / math.cos(math.pi / 2 / len(self.doppler)) if half > 0 else 0.0
        return lagrange_weights(self.doppler, doppler, middle - half, middle + half)

    def samples(self, pulse: ReceivedPulse, time: Floats, doppler: Floats) -> NDArray[np.complex128]:
        """Waveforms of some echoes of unit pressure in each band [1], shape (bands, n), of which the echo is the sum.

        Args:
            pulse: The received pulse.
            time: Time since each echo's delay [s], shape (n,).
            doppler: Doppler factors of the echoes less one [1], shape (n,).
        """
        if len(self.band) == 1 and len(self.doppler) == 1:
            return pulse.samples(time)[None]
        parts, waveforms = self.weights(doppler), np.zeros((len(self.band), len(time)), complex)
        shift = start_delay(pulse, doppler)
        for band, row in np.ndindex(waveforms.shape[0], len(parts)):
            tables = pulse.doppler_filtered(float(self.doppler[row]), partial(self._part, pulse, band, row))
            waveforms[band] += parts[row] * tables.samples(time + shift)
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
    """Phase factors that shift a pulse stretched about its start to one stretched about its middle."""
    return np.asarray(np.exp(-2j * np.pi * (pulse.pulse.frequency + offset) * start_delay(pulse, doppler)))


def waveform_basis(
    ping_geometry: PingGeometry, error: float = ERROR, bands: Sequence[SubBand] | None = None
) -> WaveformBasis:  # fmt: skip
    """Waveform basis of one ping.

    Args:
        ping_geometry: The sonar, which may be moving.
        error: Largest error of the weighted sum, re the pulse's peak [1].
        bands: Frequencies of the band; None: those of the ping's sub-bands.
    """
    band, edge, bands = np.array([0.0]), np.inf, ping_geometry.sub_bands if bands is None else bands
    if bands:
        band, edge = np.array([sub.offset for sub in bands]), half_bandwidth(ping_geometry.pulse)
    if ping_geometry.is_static:
        return WaveformBasis(np.zeros(1), band, edge)
    low, high = doppler_range(ping_geometry)
    count = doppler_node_count(ping_geometry.pulse.pulse, high - low, error)
    node = -np.cos((np.arange(count) + 0.5) * np.pi / count)
    return WaveformBasis((low + high) / 2 + (high - low) / 2 * node, band, edge)


def doppler_node_count(pulse: Pulse, width: float, error: float = ERROR) -> int:
    """Number of waveforms for a range of Doppler factors; `MAX_WAVEFORMS` where that is not enough.

    Args:
        pulse: The transmitted pulse.
        width: Greatest less least Doppler factor [1].
        error: Largest error of the weighted sum, re the pulse's peak [1].
    """
    phase = math.pi * (pulse.frequency + pulse.bandwidth / 2) * pulse.duration * width / 2
    return node_count(phase, error, MAX_WAVEFORMS)


def doppler_range(ping_geometry: PingGeometry) -> tuple[float, float]:
    """Least and greatest Doppler factor less one in the beams during one ping [1].

    A monostatic sonar has both legs in one direction; a bistatic one combines all transmit with all receive directions.
    """
    assert ping_geometry.receive_motion is not None
    is_bistatic = ping_geometry.receive_track_extent is not None
    same_orientation = ping_geometry.elements is None or not np.any(ping_geometry.elements.orientations)
    transmit_directions, receive_directions = _insonified_directions(
        ping_geometry.transmit_beams, ping_geometry.receive_beams if same_orientation else None, is_bistatic=is_bistatic
    )
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
        0.02
        * float(max(np.linalg.norm(transmit_velocity), *(np.linalg.norm(v) for v in receive_velocities)))
        / ping_geometry.sound_speed
    )
    return float(factor.min()) - margin, float(factor.max()) + margin


_DIRECTIONS: RecentResults[tuple[Floats, Floats]] = RecentResults(8)
_SPECTRA: RecentResults[NDArray[np.complex128]] = RecentResults(8)
_AXES_DECIMALS = 12
"""Decimals of the receive array's axes in the transmit array's frame: the same for all attitudes of the sonar."""


def _insonified_directions(
    transmit_beams: Beams, receive_beams: Beams | None, *, is_bistatic: bool
) -> tuple[Floats, Floats]:
    """Directions in the beams, out of a set all around the transmit array, each (any, 3); cached for the same arrays.

    Args:
        transmit_beams: Transmit beams.
        receive_beams: Receive beams; None: omnidirectional.
        is_bistatic: True for two platforms; otherwise the two-way gain counts.
    """
    frame, key = transmit_beams.axes, [is_bistatic, transmit_beams.pattern_key]
    transmit, receive = transmit_beams.rotated(np.eye(3)), None
    if receive_beams is not None:
        receive = receive_beams.rotated(np.round(receive_beams.axes @ frame.T, _AXES_DECIMALS) + 0.0)
        key += [receive.axes.tobytes(), receive.pattern_key]
    directions = _DIRECTIONS.get(tuple(key), lambda: _directions_in_beams(transmit, receive, is_bistatic=is_bistatic))
    return directions[0] @ frame, directions[1] @ frame


def _directions_in_beams(
    transmit_beams: Beams, receive_beams: Beams | None, *, is_bistatic: bool
) -> tuple[Floats, Floats]:
    """Directions in the beams, in the frame of their axes, computed."""
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
    return transmit_directions, receive_directions


def _extremes(values: Floats) -> Floats:
    """Least and greatest of some values, shape (2,)."""
    return np.array([values.min(), values.max()])
