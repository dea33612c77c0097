"""Relief of a sediment: a patch of it, and its spectrum from the longest slopes to acoustic roughness."""

from functools import lru_cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from insonify.plotting import style
from insonify.plotting.validity_style import Floats
from insonify.scattering.sediments import Sediment
from insonify.scene.terrain.power_law import PowerLaw
from insonify.scene.terrain.roughness_cutoff import RoughnessCutoff

SIDE = 40.0
"""Side of the patch that is drawn [m]."""
POINTS = 640
"""Points along a side of the patch [1]."""
BINS = 36
"""Rings of wavenumber, evenly spaced in its logarithm, for the spectrum of the patch [1]."""


def relief(bed: Sediment, path: str | Path, *, seed: int = 0, frequency: float = 100e3) -> Path:
    """Draw a patch of the relief of a sediment, beside its spectrum.

    Args:
        bed: Sediment, whose roughness spectrum is extended to longer wavelengths.
        path: File of the figure.
        seed: Random seed of the patch [1].
        frequency: Acoustic frequency whose Bragg wavenumber is marked [Hz].

    Returns:
        The path.

    Example:
        >>> sand = insonify.scattering.Sediment.named("medium sand")
        >>> picture = relief(sand, "relief.png", frequency=300e3)
        >>> picture.name, picture.stat().st_size > 0
        ('relief.png', True)
    """
    with style.plot_style():
        figure = style.new_figure(12, 5)
        left, right = figure.subplots(1, 2)
        ground(left, bed, seed=seed)
        ground_spectrum(right, bed, seed=seed, frequency=frequency)
        return style.save_figure(figure, path)


def ground(axes: Axes, bed: Sediment, *, seed: int = 0) -> None:
    """Draw a patch of relief from above.

    Args:
        axes: Axes to draw on.
        bed: Sediment.
        seed: Random seed of the patch [1].
    """
    height = 100 * patch(bed, seed)
    image = axes.imshow(height, origin="lower", extent=(0, SIDE, 0, SIDE), cmap=style.COPPER)
    axes.grid(False)
    axes.figure.colorbar(image, ax=axes, label="height [cm]", pad=0.02)
    axes.set_title(f"A patch of {bed.name or 'this'} relief, rms height {height.std():.2g} cm")
    axes.set_xlabel("east [m]")
    axes.set_ylabel("north [m]")


def ground_spectrum(axes: Axes, bed: Sediment, *, seed: int = 0, frequency: float = 100e3) -> None:
    """Draw the spectrum of the relief: of the law, of its resolved part, and measured on the patch.

    Args:
        axes: Axes to draw on.
        bed: Sediment.
        seed: Random seed of the patch [1].
        frequency: Acoustic frequency whose Bragg wavenumber is marked [Hz]; the sound speed is 1500 m/s.
    """
    law, cutoff = PowerLaw.of_sediment(bed), RoughnessCutoff()
    K = np.geomspace(0.05, 3000, 400)
    spectrum, share = law.spectrum(K), law.resolved_fraction(K, cutoff)
    brown = style.CONTRIBUTION_COLOURS["seabed"]
    axes.fill_between(K, spectrum, 1e-30, where=share > 0.5, color=brown, alpha=0.15, linewidth=0)
    axes.plot(K, spectrum, color=style.INK, label="law of the relief")
    resolved = np.where(share > 1e-4, share * spectrum, np.nan)
    axes.plot(K, resolved, color=brown, label="resolved as terrain")
    ring, measured = ring_spectrum(patch(bed, seed), SIDE / POINTS)
    axes.plot(ring, measured, ".", color=style.FAMILIES["S"], markersize=5, label="measured on the patch")
    axes.axvline(cutoff.wavenumber, color=style.QUIET, linestyle=":", label=f"cutoff, {cutoff.wavelength:g} m")
    bragg = 4 * np.pi * frequency / 1500 * np.cos(np.radians(20))
    label = f"Bragg at {frequency / 1e3:g} kHz at 20°, {2e3 * np.pi / bragg:.2g} mm"
    axes.axvline(bragg, color=style.EXPECTED, linestyle="--", label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(K[0], K[-1])
    axes.set_ylim(spectrum[-1] / 3, spectrum[0] * 10)
    axes.set_title("Spectrum of the relief")
    axes.set_xlabel("wavenumber [rad/m]")
    axes.set_ylabel("two-sided spectrum [m$^4$]")
    axes.legend(loc="lower left")


@lru_cache(maxsize=2)
def patch(bed: Sediment, seed: int) -> Floats:
    """Height of a square patch of a sediment's relief about its mean [m], shape (north, east)."""
    at = (np.arange(POINTS) + 0.5) * SIDE / POINTS
    terrain = PowerLaw.of_sediment(bed).build_relief(seed=seed, layer=0, cutoff=RoughnessCutoff())
    height = terrain.sample(at[:, None], at[None, :]).height
    centred: Floats = height - height.mean()
    centred.setflags(write=False)  # cached, and drawn twice
    return centred


def ring_spectrum(height: Floats, step: float) -> tuple[Floats, Floats]:
    """Two-sided, two-dimensional spectrum measured on a square patch, averaged over rings.

    Args:
        height: Heights [m], shape (n, n).
        step: Spacing of the heights [m].

    Returns:
        Wavenumber [rad/m] and spectrum [m^4] of each ring that is not empty; its integral over the plane of
        wavenumbers is the variance.

    Source: the periodogram under Hann's window, |FFT|^2 over the energy of the window.
    """
    n = len(height)
    window = np.outer(np.hanning(n), np.hanning(n))
    energy = np.abs(np.fft.fft2(height * window)) ** 2 * (step / (2 * np.pi)) ** 2 / np.sum(window**2)
    wave = 2 * np.pi * np.fft.fftfreq(n, step)
    length = np.hypot(wave[:, None], wave[None, :])
    # the window blurs the lowest three waves into one another
    edges = np.geomspace(3 * 2 * np.pi / (n * step), np.pi / step, BINS + 1)
    ring = np.digitize(length.ravel(), edges)
    count = np.bincount(ring, minlength=BINS + 2)[1:-1]
    total, radius = (np.bincount(ring, c.ravel(), BINS + 2)[1:-1] for c in (energy, length))
    occupied = count > 0
    return radius[occupied] / count[occupied], total[occupied] / count[occupied]
