"""All the noise of a sonar's channels: what they hear of the sea, and what the receiver adds of its own.

The sea's noise is a field: it reaches every channel, in each as loud as its directivity lets it, and in neighbours much
alike. The noise of hydrophones and amplifiers is each element's own. Tones are picked up by all elements at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

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

NODES = 129
"""Frequencies across the band at which the sea's spectrum is asked for: straight lines between are 1e-4 dB off."""
FAINT = 1e-7
"""Part of a noise that is left out of a mixture [1]."""


@dataclass(frozen=True, slots=True)
class ReceiverTones:
    """Lines of the receiver's own noise, n of them, in m channels."""

    frequency: Floats
    """Of each [Hz], shape (n,)."""
    amplitude: Complexes
    """Of each in each channel, after the receiver's filter, at the start of the track [uPa], shape (m, n)."""

    def waveform(self, centre: float, start: float, time: Floats) -> Complexes:
        """What they sound like in one ping [uPa], shape (m, samples).

        Args:
            centre: Centre frequency [Hz].
            start: Start of the ping's transmission after the start of the track [s].
            time: Of the samples after that [s], shape (samples,).
        """
        # float64, whole cycles left out: an hour of 100 kHz is 4e8 of them
        cycles = np.outer(self.frequency - centre, time) + (self.frequency * start % 1.0)[:, None]
        return np.asarray(self.amplitude @ np.exp(2j * np.pi * (cycles % 1.0)))


@dataclass(frozen=True, slots=True)
class ChannelNoise:
    """What noise each channel of a sonar has, the same from ping to ping but for its draw."""

    pulse: ReceivedPulse
    seed: int
    sea_level_db: float | None
    """Spectrum level of the noises that are mixed, at the centre frequency [dB re 1 uPa^2/Hz]; None: silence."""
    slope: Slope | None
    """How that changes over the band."""
    mixing_matrices: tuple[Complexes, ...] | None
    """What mixes them into the channels of each side, a lower triangle each [1]; None: each channel has one."""
    self_noise_gain: Floats
    """Amplitude of noise of unit spectrum level in each channel that is its own [1], shape (channels,)."""
    self_noise_level_db: float | None
    """Spectrum level of the receiver's own noise in one element [dB re 1 uPa^2/Hz]; None: none."""
    tones: ReceiverTones | None

    @property
    def power(self) -> Floats:
        """Mean-square pressure of the noise in each channel [uPa^2], shape (channels,)."""
        whole = self.self_noise_gain**2 * noise_intensity(self.pulse, self.self_noise_level_db)
        share = np.ones(len(self.self_noise_gain))
        if self.mixing_matrices is not None:
            share = np.concatenate([np.sum(np.abs(one) ** 2, axis=1) for one in self.mixing_matrices])
        whole = whole + share * noise_intensity(self.pulse, self.sea_level_db, self.slope)
        return whole if self.tones is None else whole + np.sum(np.abs(self.tones.amplitude) ** 2, axis=1)

    def draw(self, ping: int, start: float, grid: TimeGrid) -> NDArray[np.complex64]:
        """The noise of one ping [uPa], shape (channels, samples).

        Args:
            ping: Number of the ping.
            start: Of its transmission after the start of the track [s].
            grid: Its samples.
        """
        size = self.seed, ping, len(self.self_noise_gain), grid.sample_count
        heard = receiver_noise(self.pulse, self.sea_level_db, *size, slope=self.slope)
        if self.mixing_matrices is not None:
            heard = _mix_channels(heard, self.mixing_matrices)
        if self.self_noise_level_db is not None:
            own = receiver_noise(self.pulse, self.self_noise_level_db, *size, stream=random_keys.RECEIVER)
            heard = heard + self.self_noise_gain[:, None].astype(np.float32) * own
        if self.tones is not None:
            heard = heard + self.tones.waveform(self.pulse.pulse.frequency, start, grid.time).astype(np.complex64)
        return heard


def channel_noise(
    sonar: Sonar, water: Water, ping_geometries: Sequence[PingGeometry], pulse: ReceivedPulse, seed: int
) -> ChannelNoise:
    """The noise of all channels of a sonar.

    Args:
        sonar: The sonar, with all its sides.
        water: What is around it.
        ping_geometries: Its sides at the first ping: the attitude in which noise from the surface is heard throughout.
        pulse: The sonar's heard pulse.
        seed: Of the scenario.
    """
    level = water.noise_level_db
    slope: Slope | None = None
    mixes: tuple[Complexes, ...] | None = None
    elements = sonar.receiver.record == "elements"
    if water.noise is not None:
        sea = sea_noise_spectrum(water.noise, pulse)
        level, slope = sea.level_db, sea.slope
        mixes = tuple(covariance_factor(sea.covariance(here)) for here in ping_geometries)
    elif level is not None and elements:
        mixes = tuple(covariance_factor(_alike(noise_covariance(here, "isotropic"))) for here in ping_geometries)
    if mixes is not None and elements:
        mixes = tuple(_response(here)[:, None] * mix for mix, here in zip(mixes, ping_geometries, strict=True))
    noisy = sonar.receiver.self_noise
    own = np.concatenate(
        [_self_noise_gain(side.receive, here) for side, here in zip(sonar.side_sonars, ping_geometries, strict=True)]
    )
    own_level = None if noisy is None else noisy.level_db
    return ChannelNoise(pulse, seed, level, slope, mixes, own, own_level, _tones(sonar, ping_geometries, pulse, seed))


@dataclass(frozen=True, slots=True)
class SeaNoiseSpectrum:
    """The sea's noise over the receiver's band, from all causes and by where they come from."""

    offset: Floats
    """From the centre frequency, which is the middle one [Hz], shape (n,)."""
    density: dict[Directionality, Floats]
    """What a hydrophone without directivity hears [uPa^2/Hz], each of shape (n,)."""

    @property
    def total_density(self) -> Floats:
        """All of it [uPa^2/Hz], shape (n,)."""
        return np.asarray(sum(self.density.values()))

    @property
    def level_db(self) -> float:
        """Spectrum level at the centre frequency [dB re 1 uPa^2/Hz]."""
        return float(level_db(self.total_density[len(self.offset) // 2]))

    def slope(self, offset: Floats) -> Floats:
        """Power at offsets from the centre, over that at the centre [1], shape of `offset`."""
        whole = self.total_density
        return np.interp(offset, self.offset, whole / whole[len(self.offset) // 2])

    def covariance(self, geometry: PingGeometry) -> Complexes:
        """What the channels hear of it at the centre frequency, for unit power at a hydrophone [1]."""
        middle = {directionality: float(part[len(self.offset) // 2]) for directionality, part in self.density.items()}
        parts = [
            power / sum(middle.values()) * noise_covariance(geometry, directionality)
            for directionality, power in middle.items()
        ]
        return np.asarray(sum(parts))


def sea_noise_spectrum(sea: SeaNoise, pulse: ReceivedPulse) -> SeaNoiseSpectrum:
    """The sea's noise over a receiver's band; warned where a law is heard outside its range.

    Args:
        sea: What is heard.
        pulse: The sonar's heard pulse, which knows centre and band.
    """
    offset = np.linspace(-0.5, 0.5, NODES) * pulse.receiver.sample_rate
    return SeaNoiseSpectrum(offset, sea.density(pulse.pulse.frequency + offset))


def _alike(covariance: Complexes) -> Complexes:
    """The covariance of channels that are all equally loud."""
    root = np.sqrt(np.diag(covariance).real)
    return covariance / np.outer(root, root)


def _response(geometry: PingGeometry) -> Complexes:
    assert geometry.elements is not None
    return geometry.elements.response


def _self_noise_gain(array: AnyArray, geometry: PingGeometry) -> Floats:
    """Amplitude in each channel of noises of unit power, one in each element [1], shape (channels,)."""
    if geometry.elements is not None:
        return np.ones(len(geometry.elements))
    # a beam is one on its axis, in spite of elements that hear less there
    return np.broadcast_to(preamplifier_noise_gain(array) * geometry.receive_beams.scale, geometry.channel_count)


def preamplifier_noise_gain(array: AnyArray) -> float:
    """Amplitude of noises of unit power, one in each element, after an array's own weights for a beam [1].

    Args:
        array: The array; along a side that is not divided into elements it has one amplifier.
    """
    if isinstance(array, LineArray):
        return _element_weights(array.elements, array.shading)
    if isinstance(array, PlanarArray):
        return _element_weights(array.columns, array.shading) * _element_weights(array.rows, array.shading_down)
    return 1.0


def _element_weights(elements: int | None, shading: str) -> float:
    weight = shading_weight(shading, element_positions(elements or 1))
    return float(np.linalg.norm(weight / weight.sum()))


def _tones(
    sonar: Sonar, ping_geometries: Sequence[PingGeometry], pulse: ReceivedPulse, seed: int
) -> ReceiverTones | None:
    """The receiver's tones, as loud in a beam as a sound from straight ahead would be."""
    noisy = sonar.receiver.self_noise
    if noisy is None or not noisy.tones:
        return None
    frequency = np.array([tone.frequency for tone in noisy.tones])
    level = amplitude_ratio([tone.level_db for tone in noisy.tones])
    turn = random_keys.uniforms(seed, random_keys.RECEIVER, np.arange(len(frequency)), -1, -1, -1)[:, 0]
    heard = level * np.exp(2j * np.pi * turn) * receiver_filter(pulse, frequency - pulse.pulse.frequency)
    ahead = [
        np.ones(here.channel_count) if here.elements is not None
        else np.broadcast_to(here.receive_beams.gain(here.boresight), here.channel_count)
        for here in ping_geometries
    ]  # fmt: skip
    return ReceiverTones(frequency, np.outer(np.concatenate(ahead), heard))


def _mix_channels(white: NDArray[np.complex64], mixes: tuple[Complexes, ...]) -> NDArray[np.complex64]:
    """Independent rows mixed into those of channels, side by side."""
    parts = (np.ascontiguousarray(white.real), np.ascontiguousarray(white.imag))
    out = np.zeros((2, *white.shape), np.float32)
    first = 0
    for lower in mixes:
        rows = slice(first, first + len(lower))
        # of elements half a wavelength apart nearly all of it is nothing but rounding
        some = np.where(np.abs(lower) > FAINT, lower, 0)
        triangle = (np.ascontiguousarray(part, np.float32) for part in (some.real, some.imag))
        mix_noise(*triangle, parts[0][rows], parts[1][rows], out[0, rows], out[1, rows])
        first = rows.stop
    return np.asarray(out[0] + 1j * out[1], np.complex64)
