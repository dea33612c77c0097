"""Spectra and variances of relief, resolved and not, from the laws that it is made of."""

import numpy as np
from scipy.special import gamma, kv

from insonify.scene.terrain import PowerLaw, Ripples


def structure(law, lag):
    """Structure function of a power law over a lag: 2 rms^2 (1 - 2^(1-H)/Gamma(H) (K0 r)^H K_H(K0 r)) [m^2]."""
    x, H = law.outer_wavenumber * np.asarray(lag, float), law.gamma / 2 - 1
    safe = np.maximum(x, 1e-12)
    correlation = 2 ** (1 - H) / gamma(H) * safe**H * kv(H, safe)
    return np.where(x == 0, 0.0, 2 * law.band_variance() * (1 - correlation))


def residual_spectrum(relief, wavenumber):
    """Spectrum of the fractal roughness that the terrain leaves to the scattering law [m^4]."""
    laws = [kind for kind in relief.components if isinstance(kind, PowerLaw)]
    return sum((k.spectrum(wavenumber) * (1 - k.resolved_fraction(wavenumber, relief.cutoff)) for k in laws), 0.0)


def residual_rms(relief):
    """Root mean square height of all that is finer than the terrain [m]."""
    # The cut is an octave wide: beyond it the integral is known.
    K = np.geomspace(relief.cutoff.wavenumber / 100, 100 * relief.cutoff.wavenumber, 2000)
    cut = np.trapezoid(2 * np.pi * K**2 * residual_spectrum(relief, K) * np.ones(K.size), np.log(K))
    fine = sum(k.band_variance(K[-1], np.inf) for k in relief.components if isinstance(k, PowerLaw))
    ripples = [kind for kind in relief.components if isinstance(kind, Ripples)]
    return np.sqrt(cut + fine + sum(k.variance for k in ripples if k.wavenumber >= relief.cutoff.wavenumber))


def roughness_rms(relief, low, high):
    """Root mean square height [m] between two wavenumbers [rad/m], resolved or not."""
    laws = [kind for kind in relief.components if isinstance(kind, PowerLaw)]
    ripples = [k for k in relief.components if isinstance(k, Ripples) and low <= k.wavenumber < high]
    return np.sqrt(sum(k.band_variance(low, high) for k in laws) + sum(k.variance for k in ripples))
