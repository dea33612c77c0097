"""Noise of all receive channels of a sonar: noise of the sea and of the receiver.

Noise of the sea is a field: its level in each channel follows from the channel's directivity, and neighbouring channels
are correlated. Noise of hydrophones and amplifiers is independent from element to element. Tones are coherent.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.ocean.sea_noise import Directionality, SeaNoise
from insonify.ocean.water import Water
from insonify.sonar.aperture import element_positions, shading_weight
from insonify.sonar.array import LineArray, PlanarArray
from insonify.sonar.element_array import AnyArray
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.sonar import Sonar
from insonify.synthesis._noise_mixing_kernel import mix_noise
from insonify.synthesis.noise import Slope, noise_intensity, receiver_filter, receiver_noise
from insonify.synthesis.noise_covariance import Complexes, covariance_factor, noise_covariance
from insonify.synthesis.time_grid import TimeGrid
from insonify.units import amplitude_ratio, level_db

Floats = NDArray[np.float64]

SPECTRUM_NODES = 129
"""Number of frequencies across the band at which the sea's spectrum is evaluated; linear interpolation between them
has an error of 1e-4 dB."""
NEGLIGIBLE = 1e-7
"""Amplitude below which an entry of a mixing matrix is left out [1]."""


@dataclass(frozen=True, slots=True)
class ReceiverTones:
    """Tones of the receiver's self-noise, n of them, in m channels."""

    frequency: Floats
    """Frequency of each tone [Hz], shape (n,)."""
    amplitude: Complexes
    """Complex amplitude in each channel, after the receiver's filter, at the start of the track [uPa], shape (m, n)."""

    def waveform(self, centre: float, start: float, time: Floats) -> Complexes:
        """Sum of the tones in one ping [uPa], shape (m, samples).

        Args:
            centre: Centre frequency [Hz].
            start: Start of the ping's transmission after the start of the track [s].
            time: Sample times after the start of transmission [s], shape (samples,).
        """
        # float64, whole cycles removed: an hour of 100 kHz is 4e8 cycles
        cycles = np.outer(self.frequency - centre, time) + (self.frequency * start % 1.0)[:, None]
        return np.asarray(self.amplitude @ np.exp(2j * np.pi * (cycles % 1.0)))


@dataclass(frozen=True)
class ChannelNoise:
    """Noise of each channel of a sonar; pings differ in the random realisation only."""

    pulse: ReceivedPulse
    seed: int
    sea_level_db: float | None
    """Spectrum level of the mixed noise at the centre frequency [dB re 1 uPa^2/Hz]; None: no sea noise."""
    slope: Slope | None
    """Power of the sea noise as a function of the offset from the centre frequency, re that at the centre."""
    mixing_matrices: tuple[Complexes, ...] | None
    """Lower triangular matrix of each side, that makes the noises of its channels of independent ones [1]; None:
    independent channels of equal power."""
    self_noise_gain: Floats
    """Rms self-noise of each channel re that of one element [1], shape (channels,)."""
    self_noise_level_db: float | None
    """Spectrum level of the receiver's self-noise in one element [dB re 1 uPa^2/Hz]; None: none."""
    tones: ReceiverTones | None
    """Tones of the receiver's self-noise; None: none."""

    @cached_property
    def mean_power(self) -> float:
        """Mean-square pressure of the noise over all channels [uPa^2]."""
        return float(np.mean(self.power))

    @cached_property
    def power(self) -> Floats:
        """Mean-square pressure of the noise in each channel [uPa^2], shape (channels,)."""
        power = self.self_noise_gain**2 * noise_intensity(self.pulse, self.self_noise_level_db)
        sea_power = np.ones(len(self.self_noise_gain))
        if self.mixing_matrices is not None:
            sea_power = np.concatenate([np.sum(np.abs(mixing) ** 2, axis=1) for mixing in self.mixing_matrices])
        power = power + sea_power * noise_intensity(self.pulse, self.sea_level_db, self.slope)
        return power if self.tones is None else power + np.sum(np.abs(self.tones.amplitude) ** 2, axis=1)

    def draw(self, ping: int, start: float, grid: TimeGrid) -> NDArray[np.complex64]:
        """Noise of one ping [uPa], shape (channels, samples).

        Args:
            ping: Number of the ping.
            start: Start of its transmission after the start of the track [s].
            grid: Sample times of the ping.
        """
        size = self.seed, ping, len(self.self_noise_gain), grid.sample_count
        noise = receiver_noise(self.pulse, self.sea_level_db, *size, slope=self.slope)
        if self.mixing_matrices is not None:
            noise = _mix_channels(noise, self.mixing_matrices)
        if self.self_noise_level_db is not None:
            self_noise = receiver_noise(self.pulse, self.self_noise_level_db, *size, stream=random_keys.RECEIVER)
            noise = noise + self.self_noise_gain[:, None].astype(np.float32) * self_noise
        if self.tones is not None:
            noise = noise + self.tones.waveform(self.pulse.pulse.frequency, start, grid.time).astype(np.complex64)
        return noise


def channel_noise(
    sonar: Sonar, water: Water, ping_geometries: Sequence[PingGeometry], pulse: ReceivedPulse, seed: int
) -> ChannelNoise:
    """Noise of all channels of a sonar.

    Args:
        sonar: The sonar, with all its sides.
        water: Water around the sonar.
        ping_geometries: Its sides at the first ping, whose attitude orients the noise from the surface at all pings.
        pulse: The sonar's received pulse.
        seed: Seed of the scenario.
    """
    level = water.noise_level_db
    slope: Slope | None = None
    mixing_matrices: tuple[Complexes, ...] | None = None
    elements = sonar.receiver.record == "elements"
    if water.noise is not None:
        sea = sea_noise_spectrum(water.noise, pulse)
        level, slope = sea.level_db, sea.slope
        mixing_matrices = tuple(covariance_factor(sea.covariance(geometry)) for geometry in ping_geometries)
    elif level is not None and elements:
        mixing_matrices = tuple(
            covariance_factor(_equal_power(noise_covariance(geometry, "isotropic"))) for geometry in ping_geometries
        )
    if mixing_matrices is not None and elements:
        mixing_matrices = tuple(
            _response(geometry)[:, None] * mix for mix, geometry in zip(mixing_matrices, ping_geometries, strict=True)
        )
    self_noise = sonar.receiver.self_noise
    self_noise_gain = np.concatenate(
        [
            _self_noise_gain(side.receive, geometry)
            for side, geometry in zip(sonar.side_sonars, ping_geometries, strict=True)
        ]
    )
    self_noise_level_db = None if self_noise is None else self_noise.level_db
    return ChannelNoise(
        pulse, seed, level, slope, mixing_matrices, self_noise_gain, self_noise_level_db,
        _tones(sonar, ping_geometries, pulse, seed),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class SeaNoiseSpectrum:
    """Spectrum of the sea's noise over the receiver's band, by directionality."""

    offset: Floats
    """Offset from the centre frequency, which is the middle one [Hz], shape (n,)."""
    density: dict[Directionality, Floats]
    """Spectral density at an omnidirectional hydrophone [uPa^2/Hz], each of shape (n,)."""

    @property
    def total_density(self) -> Floats:
        """Spectral density of all directionalities together [uPa^2/Hz], shape (n,)."""
        return np.asarray(sum(self.density.values()))

    @property
    def level_db(self) -> float:
        """Spectrum level at the centre frequency [dB re 1 uPa^2/Hz]."""
        return float(level_db(self.total_density[len(self.offset) // 2]))

    def slope(self, offset: Floats) -> Floats:
        """Power at offsets from the centre, re that at the centre [1], shape of `offset`."""
        density = self.total_density
        return np.interp(offset, self.offset, density / density[len(self.offset) // 2])

    def covariance(self, geometry: PingGeometry) -> Complexes:
        """Covariance of the channels at the centre frequency, for unit power at a hydrophone [1]."""
        power_at_centre = {
            directionality: float(density[len(self.offset) // 2]) for directionality, density in self.density.items()
        }
        covariances = [
            power / sum(power_at_centre.values()) * noise_covariance(geometry, directionality)
            for directionality, power in power_at_centre.items()
        ]
        return np.asarray(sum(covariances))


def sea_noise_spectrum(sea: SeaNoise, pulse: ReceivedPulse) -> SeaNoiseSpectrum:
    """Spectrum of the sea's noise over a receiver's band; laws outside their range of validity raise a warning.

    Args:
        sea: Noise of the sea.
        pulse: The sonar's received pulse, which has centre and band.
    """
    offset = np.linspace(-0.5, 0.5, SPECTRUM_NODES) * pulse.receiver.sample_rate
    return SeaNoiseSpectrum(offset, sea.density(pulse.pulse.frequency + offset))


def _equal_power(covariance: Complexes) -> Complexes:
    """Covariance scaled to equal power in all channels."""
    root = np.sqrt(np.diag(covariance).real)
    return covariance / np.outer(root, root)


def _response(geometry: PingGeometry) -> Complexes:
    """Response of each element, with errors [1], shape (channels,)."""
    assert geometry.elements is not None
    return geometry.elements.response


def _self_noise_gain(array: AnyArray, geometry: PingGeometry) -> Floats:
    """Rms noise in each channel by independent noises of unit power in each element [1], shape (channels,)."""
    if geometry.elements is not None:
        return np.ones(len(geometry.elements))
    # beams are scaled to one on their axis, whatever the gain of their elements in that direction
    return np.broadcast_to(preamplifier_noise_gain(array) * geometry.receive_beams.scale, geometry.channel_count)


def preamplifier_noise_gain(array: AnyArray) -> float:
    """Rms sum of independent noises of unit power in each element, by the array's own beam weights [1].

    Args:
        array: The array; an axis that is not divided into elements counts as one element.
    """
    if isinstance(array, LineArray):
        return _element_weights(array.elements, array.shading)
    if isinstance(array, PlanarArray):
        return _element_weights(array.columns, array.shading) * _element_weights(array.rows, array.shading_down)
    return 1.0


def _element_weights(elements: int | None, shading: str) -> float:
    """Root of the sum of squares of the elements' weights, of which the sum is 1 [1]."""
    weight = shading_weight(shading, element_positions(elements or 1))
    return float(np.linalg.norm(weight / weight.sum()))


def _tones(
    sonar: Sonar, ping_geometries: Sequence[PingGeometry], pulse: ReceivedPulse, seed: int
) -> ReceiverTones | None:
    """Tones of the receiver; their level in a beam is that of a sound on the beam's axis."""
    self_noise = sonar.receiver.self_noise
    if self_noise is None or not self_noise.tones:
        return None
    frequency = np.array([tone.frequency for tone in self_noise.tones])
    amplitude = amplitude_ratio([tone.level_db for tone in self_noise.tones])
    phase = random_keys.uniforms(seed, random_keys.RECEIVER, np.arange(len(frequency)), -1, -1, -1)[:, 0]
    received = amplitude * np.exp(2j * np.pi * phase) * receiver_filter(pulse, frequency - pulse.pulse.frequency)
    axis_gain = [
        np.ones(geometry.channel_count) if geometry.elements is not None
        else np.broadcast_to(geometry.receive_beams.gain(geometry.boresight), geometry.channel_count)
        for geometry in ping_geometries
    ]  # fmt: skip
    return ReceiverTones(frequency, np.outer(np.concatenate(axis_gain), received))


def _mix_channels(white: NDArray[np.complex64], mixing_matrices: tuple[Complexes, ...]) -> NDArray[np.complex64]:
    """Mix independent noises, shape (channels, samples), into those of the channels of each side."""
    parts = (np.ascontiguousarray(white.real), np.ascontiguousarray(white.imag))
    out = np.zeros((2, *white.shape), np.float32)
    first = 0
    for lower in mixing_matrices:
        rows = slice(first, first + len(lower))
        # for elements half a wavelength apart, most off-diagonal entries are rounding errors
        significant = np.where(np.abs(lower) > NEGLIGIBLE, lower, 0)
        triangle = (np.ascontiguousarray(part, np.float32) for part in (significant.real, significant.imag))
        mix_noise(*triangle, parts[0][rows], parts[1][rows], out[0, rows], out[1, rows])
        first = rows.stop
    return np.asarray(out[0] + 1j * out[1], np.complex64)
