"""Sound between two points by a rough plane: Kirchhoff's integral over the plane, for waves of a power-law band.

The mean intensity is that of the coherent reflection and of all patches, each with Kirchhoff's cross section for
heights of a Gaussian surface, itself an integral over the correlation function. Source: Ishimaru (1978), Wave
Propagation and Scattering in Random Media, chapter 21 (chapter not verified; its total is 1 for a smooth plane).
"""

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.special import j0, j1


def energies(height, distance, k, sediment, low, *, beyond, reach=12.0, step=0.025):
    """Intensity re that off a smooth plane: coherent, scattered within a lobe, scattered outside it.

    Args:
        height: Height of both points over the plane [m].
        distance: Horizontal distance between them [m].
        k: Wavenumber of the sound, and of the shortest waves [rad/m].
        sediment: Spectrum of the waves.
        low: Wavenumber of the longest waves [rad/m].
        beyond: Change of the horizontal wavenumber over k at the edge of the lobe [1].
        reach: Half the side of the plane [m].
        step: Side of a patch [m].
    """
    waves, spacing = np.geomspace(low, k, 300), 0.3 / k
    apart = (np.arange(3000) + 0.5) * spacing
    density = 2 * np.pi * sediment.spectral_strength * waves ** (1 - sediment.spectral_exponent)
    correlation = np.trapezoid(density * j0(np.outer(apart, waves)), waves, axis=1)
    variance = np.trapezoid(density, waves)
    down, across = np.linspace(0.02, 2, 100) * k, np.concatenate([np.linspace(0, 60, 240, False),
                                                                  np.linspace(60, 2 * k, 400)])  # fmt: skip
    kernel = j0(np.outer(across, apart)) * apart * spacing * np.exp(-((2.7 * apart / apart[-1]) ** 2))
    square = down[:, None] ** 2
    table = 2 * np.pi * (np.exp(-square * (variance - correlation)) - np.exp(-square * variance)) @ kernel.T
    transform = RegularGridInterpolator((down, across), table, bounds_error=False, fill_value=0.0)
    x, y = distance / 2 + np.arange(-reach, reach, step), np.arange(step / 2, reach, step)[:, None]  # half the plane
    one, other = (np.sqrt((x - end) ** 2 + y**2 + height**2) for end in (0.0, distance))
    vertical = k * height * (1 / one + 1 / other)
    level = k * np.hypot(x / one + (x - distance) / other, y / one + y / other)
    section = (level**2 + vertical**2) ** 2 / (4 * np.pi * vertical) ** 2 * transform(np.stack([vertical, level], -1))
    length = np.hypot(distance, 2 * height)
    patches = 2 * section / (one * other) ** 2 * (step * length) ** 2
    lobe = level < beyond * k
    return np.exp(-((4 * k * height / length) ** 2) * variance), patches[lobe].sum(), patches[~lobe].sum()


def ring_energies(k, phase, sediment, low, edges):
    """Energy scattered into rings of the change of horizontal wavenumber re all that is scattered, in any unit [1].

    Args:
        k: Wavenumber of the sound, and of the shortest waves [rad/m].
        phase: Phase per height, 2 k sin(grazing) [rad/m].
        sediment: Spectrum of the waves.
        low: Wavenumber of the longest waves [rad/m].
        edges: Edges of the rings over k [1], shape (n + 1,).

    Returns:
        Energies, shape (n,), and the energy of the coherent reflection re all that is reflected.
    """
    waves, apart = np.geomspace(low, k, 600), (np.arange(5000) + 0.5) * 0.3 / k
    density = 2 * np.pi * sediment.spectral_strength * waves ** (1 - sediment.spectral_exponent)
    less = phase**2 * np.trapezoid(density * (1 - j0(np.outer(apart, waves))), waves, axis=1)
    coherent = np.exp(-(phase**2) * np.trapezoid(density, waves))
    incoherent = (np.exp(-less) - coherent) * np.exp(-((2.7 * apart / apart[-1]) ** 2))
    return np.diff([np.sum(incoherent * edge * j1(edge * k * apart)) for edge in edges]), coherent
