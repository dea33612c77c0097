"""Ground that a sediment makes: a patch of it, and its spectrum from the longest slopes to what sound feels."""

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
"""Points along it."""
BINS = 36
"""Rings of wavenumber, evenly spaced in its logarithm, in which a patch is measured."""


def relief(bed: Sediment, path: str | Path, *, seed: int = 0, frequency: float = 100e3) -> Path:
    """Draw a patch of the relief that a sediment makes, beside its spectrum.

    Args:
        bed: The sediment; its own roughness is continued to longer wavelengths.
        path: Picture to write.
        seed: Another seed is another patch of the same kind [1].
        frequency: Of the sound whose resonant relief is marked [Hz].

    Returns:
        The path.
    """
    with style.plot_style():
        figure = style.new_figure(12, 5)
        left, right = figure.subplots(1, 2)
        ground(left, bed, seed=seed)
        ground_spectrum(right, bed, seed=seed, frequency=frequency)
        return style.save_figure(figure, path)


def ground(axes: Axes, bed: Sediment, *, seed: int = 0) -> None:
    """A patch of relief from above.

    Args:
        axes: Where to draw.
        bed: The sediment.
        seed: Of the patch [1].
    """
    height = 100 * patch(bed, seed)
    image = axes.imshow(height, origin="lower", extent=(0, SIDE, 0, SIDE), cmap=style.COPPER)
    axes.grid(False)
    axes.figure.colorbar(image, ax=axes, label="height [cm]", pad=0.02)
    axes.set_title(f"A patch of {bed.name or 'this'} relief, rms height {height.std():.2g} cm")
    axes.set_xlabel("east [m]")
    axes.set_ylabel("north [m]")


def ground_spectrum(axes: Axes, bed: Sediment, *, seed: int = 0, frequency: float = 100e3) -> None:
    """Spectrum of the relief: asked, resolved as ground, and measured on the patch that is drawn.

    Args:
        axes: Where to draw.
        bed: The sediment.
        seed: Of the patch [1].
        frequency: Of the sound whose resonant relief is marked [Hz]; the sound speed is taken as 1500 m/s.
    """
    law, split = PowerLaw.of_sediment(bed), RoughnessCutoff()
    K = np.geomspace(0.05, 3000, 400)
    asked, share = law.spectrum(K), law.resolved_fraction(K, split)
    axes.fill_between(
        K, asked, 1e-30, where=share > 0.5, color=style.CONTRIBUTION_COLOURS["seabed"], alpha=0.15, linewidth=0
    )
    axes.plot(K, asked, color=style.INK, label="asked of the whole relief")
    drawn = np.where(share > 1e-4, share * asked, np.nan)
    axes.plot(K, drawn, color=style.CONTRIBUTION_COLOURS["seabed"], label="resolved as ground")
    ring, measured = ring_spectrum(patch(bed, seed), SIDE / POINTS)
    axes.plot(ring, measured, ".", color=style.FAMILIES["S"], markersize=5, label="measured on the patch")
    axes.axvline(split.wavenumber, color=style.QUIET, linestyle=":", label=f"split, {split.wavelength:g} m")
    resonant = 4 * np.pi * frequency / 1500 * np.cos(np.radians(20))
    label = f"echoes {frequency / 1e3:g} kHz at 20°, {2e3 * np.pi / resonant:.2g} mm"
    axes.axvline(resonant, color=style.EXPECTED, linestyle="--", label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(K[0], K[-1])
    axes.set_ylim(asked[-1] / 3, asked[0] * 10)
    axes.set_title("Spectrum of the relief")
    axes.set_xlabel("wavenumber [rad/m]")
    axes.set_ylabel("two-sided spectrum [m$^4$]")
    axes.legend(loc="lower left")


@lru_cache(maxsize=2)
def patch(bed: Sediment, seed: int) -> Floats:
    """Height of a square patch of a sediment's relief [m], shape (north, east), about its own mean."""
    at = (np.arange(POINTS) + 0.5) * SIDE / POINTS
    walked = PowerLaw.of_sediment(bed).build_relief(seed=seed, layer=0, cutoff=RoughnessCutoff())
    height = walked.sample(at[:, None], at[None, :]).height
    level: Floats = height - height.mean()
    level.setflags(write=False)  # it is drawn twice
    return level


def ring_spectrum(height: Floats, step: float) -> tuple[Floats, Floats]:
    """Two-sided, two-dimensional spectrum measured on a square patch, averaged over rings.

    Args:
        height: Heights [m], shape (n, n).
        step: Distance of neighbours [m].

    Returns:
        Wavenumber [rad/m] and spectrum [m^4] of each ring that holds any wave; its integral over the plane of
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
    there = count > 0
    return radius[there] / count[there], total[there] / count[there]
