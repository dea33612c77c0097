"""Energies of rays at their hits, and of their echoes in each channel."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer.image_legs import coherent_intensity_factor, refracted_sine
from insonify.engines.tracer.ray_bundle import RayBundle, TracedPing
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]

OWN_BOUNCE = {"seabed": "B", "surface": "S", "target": "-"}
"""Bounces excluded from receive legs of an interface: a reflection at the scatterer itself is part of its law."""


def transmitted_energy(ping: TracedPing, rays: RayBundle) -> Floats:
    """Mean-square pressure times the area of each ray at its hit, by transmit beam [uPa^2 m^2], shape (beams, n)."""
    return ray_energy(ping, rays, float(intensity_ratio(ping.ping_geometry.source_level_db)))


def ray_energy(ping: TracedPing, rays: RayBundle, source_intensity: float = 1.0) -> Floats:
    """Mean-square pressure times the area of each ray at its hit, by transmit beam, shape (beams, n).

    It is the ray's solid angle times what reflections and absorption leave, the ratio of the impedances (that of the
    sound speeds at hit and source) and the intensity pattern of the beam.

    Args:
        ping: The ping.
        rays: Rays at their hits, n of them.
        source_intensity: Mean-square pressure of the source re 1 m [uPa^2].
    """
    factor = rays.solid_angle * rays.energy_fraction * np.exp(-ping.attenuation * rays.length)
    sine = np.minimum(np.abs(rays.direction[:, 2]), 1.0)
    # the flux of a ray tube is constant, and pressure squared is flux times impedance
    if ping.propagation_model is not None:
        speed = ping.scene.water.sound_speed_at
        at_hit, at_bed = speed(rays.origin[:, 2]), speed(ping.scene.seabed.depth)
        factor = factor * at_hit / speed(ping.transmit[2])
        sine = refracted_sine(np.hypot(*rays.direction[:, :2].T) * at_bed / at_hit)
    if "T" not in rays.chain:
        factor = factor * coherent_intensity_factor(
            ping.scene, rays.family, float(ping.transmit[2]), rays.length, sine, ping.ping_geometry.wavelength
        )
    return np.asarray(source_intensity * factor * ping.transmit_beams.gain(rays.launch) ** 2)


def channel_energies(ping: TracedPing, transmitted: Floats, gains: Floats) -> Floats:
    """Energy in every channel from its transmit and receive beams [uPa^2], (channels, n).

    Args:
        ping: The ping.
        transmitted: Factor of the energy of each transmit beam, such as `transmitted_energy`, (transmit beams, n).
        gains: Factor of the energy of each receive beam, with its intensity pattern, (receive beams, n).
    """
    channel = np.arange(ping.ping_geometry.channel_count)
    return np.asarray(transmitted[channel % len(transmitted)] * gains[channel % len(gains)])


def in_window(ping: TracedPing, delay: Floats) -> NDArray[np.bool_]:
    """True for delays that are recorded, shape (n,)."""
    first, last = ping.ping_geometry.recorded_delays
    return np.asarray((delay >= first) & (delay <= last))


def interference(ping: TracedPing, lag: Floats) -> Floats:
    """Interference term of two equal echoes, re the mean-square pressure of one of them.

    Args:
        ping: The ping.
        lag: Difference of their delays [s], shape (n,).

    Returns:
        The autocorrelation of the received pulse with its carrier, 1 at no lag [1], shape (n,).
    """
    step, correlation = _pulse_correlation(ping.ping_geometry.pulse)
    lag = np.where(np.isfinite(lag), lag, 1e9)
    value = np.interp(np.abs(lag), step * np.arange(len(correlation)), correlation, right=0.0)
    return np.asarray(np.real(np.exp(2j * np.pi * ping.ping_geometry.frequency * np.abs(lag)) * value))


@lru_cache(maxsize=4)
def _pulse_correlation(pulse: ReceivedPulse) -> tuple[float, NDArray[np.complex128]]:
    """Step of lags [s], and autocorrelation of the received pulse at lags from 0 on, 1 at no lag [1], shape (n,)."""
    step = 1 / (8 * (4 / pulse.resolution_time + abs(pulse.pulse.bandwidth or 0.0)))
    waveform = pulse.samples(np.arange(pulse.start, pulse.stop, step))
    correlation = np.correlate(waveform, waveform, "full")[len(waveform) - 1 :]
    return step, correlation / correlation[0].real
