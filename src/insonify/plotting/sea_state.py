"""Sea surface of a wind speed: wave spectra, a patch of the surface, coherent reflection and backscatter."""

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from insonify.ocean.directional_spreading import ElfouhailySpreading
from insonify.ocean.elfouhaily import Elfouhaily
from insonify.ocean.jonswap import Jonswap
from insonify.ocean.pierson_moskowitz import PiersonMoskowitz
from insonify.ocean.sea_surface import SeaSurface
from insonify.ocean.wave_spectrum import WaveSpectrum, mean_square_slope, significant_height
from insonify.plotting import style
from insonify.plotting.laws import GRAZING, STRENGTH, backscatter_db
from insonify.plotting.validity_style import Caveats, Floats, add_caveats, curve, evaluate_with_caveats, with_caveats
from insonify.scattering.apl_surface import apl_surface_strength_db
from insonify.scattering.bubbles import Bubbles
from insonify.scattering.surface_coherence import coherent_reflection
from insonify.scattering.surface_scattering import SurfaceScattering
from insonify.units import level_db

FETCH = 50e3
"""Distance to the shore of the young sea [m]."""
WAVES = ("#1A1A1A", "#E69F00", "#0072B2")
"""Colours of the spectra: fully developed, young, unified."""
ACROSS = 3.0
"""Side of the patch, in wavelengths of the dominant waves [1]."""
POINTS = 160
"""Points along a side of the patch [1]."""


def sea(path: str | Path, *, wind_speed: float = 7.0, frequency: float = 100e3, seed: int = 0) -> Path:
    """Draw the sea surface of a wind speed, and its reflection and backscatter.

    Args:
        path: File of the figure.
        wind_speed: Wind 10 m above the sea [m/s].
        frequency: Acoustic frequency [Hz].
        seed: Random seed of the patch [1].

    Returns:
        The path.

    Example:
        >>> picture = sea("sea.png", wind_speed=5.0, frequency=200e3)
        >>> picture.name, picture.stat().st_size > 0
        ('sea.png', True)
    """
    # the laws' caveats about the wind are collected here once, and printed on the figure
    kinds, caveats = with_caveats(lambda: seas(wind_speed))
    moving, _ = with_caveats(lambda: wind_sea(wind_speed, seed))
    with style.plot_style():
        figure = style.new_figure(13.5, 8.5)
        grid = figure.subplots(2, 3)
        heights(grid[0, 0], kinds)
        slopes(grid[0, 1], kinds, frequency)
        surface_patch(grid[0, 2], moving)
        coherence(grid[1, 0], kinds, frequency)
        caveats += echo(grid[1, 1], wind_speed, frequency)
        caveats += winds(grid[1, 2], wind_speed, frequency)
        figure.suptitle(f"A sea under a wind of {wind_speed:g} m/s", ha="left", x=0.01, fontsize=11)
        add_caveats(figure, caveats, "Outside the validity of the laws (strengths: thin and dashed): ")
        return style.save_figure(figure, path)


def seas(wind_speed: float) -> dict[str, WaveSpectrum]:
    """Published wave spectra of a wind speed [m/s], by name."""
    return {
        "Pierson-Moskowitz": PiersonMoskowitz(wind_speed),
        f"JONSWAP, {FETCH / 1e3:g} km": Jonswap(wind_speed, FETCH),
        "Elfouhaily": Elfouhaily(wind_speed),
    }


def wind_sea(wind_speed: float, seed: int) -> SeaSurface:
    """Random sea surface of a wind speed [m/s], travelling north."""
    spectrum = Elfouhaily(wind_speed)
    shortest = min(0.3, 0.2 * np.pi / spectrum.peak)  # a light air raises no waves of 0.3 m
    return SeaSurface(spectrum, ElfouhailySpreading(spectrum), seed=seed, shortest_wavelength=shortest)


def heights(axes: Axes, kinds: dict[str, WaveSpectrum]) -> None:
    """Draw the variance of the height over wavenumber, with the significant height of each spectrum.

    Args:
        axes: Axes to draw on.
        kinds: Spectra by name.
    """
    top = 0.0
    for (name, spectrum), colour in zip(kinds.items(), WAVES, strict=True):
        k = _waves(spectrum)
        density = spectrum.density(k)
        axes.plot(k, density, color=colour, label=f"{name}: {significant_height(spectrum):.2g} m high")
        top = max(top, float(density.max()))
    _log_axes(axes)
    axes.set(ylim=(top * 1e-14, top * 1e2), title="Waves by height", ylabel="variance of height per wavenumber [m$^3$]")
    axes.legend(loc="upper right")


def slopes(axes: Axes, kinds: dict[str, WaveSpectrum], frequency: float) -> None:
    """Draw the variance of the slope in each e-fold of wavenumber, with the acoustic wavenumber.

    Args:
        axes: Axes to draw on.
        kinds: Spectra by name.
        frequency: Acoustic frequency [Hz].
    """
    sound = 2 * np.pi * frequency / 1500
    for (name, spectrum), colour in zip(kinds.items(), WAVES, strict=True):
        k = _waves(spectrum)
        rms = np.degrees(np.arctan(mean_square_slope(spectrum, sound / 3) ** 0.5))
        axes.plot(k, k**3 * spectrum.density(k), color=colour, label=f"{name}: {rms:.1f}° rms below k/3")
    axes.axvline(sound / 3, color=style.EXPECTED, linestyle="--", label=f"a third of k at {frequency / 1e3:g} kHz")
    _log_axes(axes)
    axes.set(ylim=(1e-5, 1), title="Waves by slope", ylabel="variance of slope per e-fold of wavenumber [1]")
    axes.legend(loc="upper left")


def surface_patch(axes: Axes, drawn: SeaSurface) -> None:
    """Draw a patch of the sea surface from above, with its significant height and rms slope."""
    side = ACROSS * 2 * np.pi / drawn.spectrum.peak
    at = np.linspace(0, side, POINTS)
    motion = drawn.motion(at[:, None], at[None, :], 0.0)
    limit = float(np.abs(motion.elevation).max())
    image = axes.imshow(
        motion.elevation, origin="lower", extent=(0, side, 0, side), cmap="RdBu_r", vmin=-limit, vmax=limit,
        interpolation="bilinear",
    )  # fmt: skip
    axes.grid(False)
    axes.figure.colorbar(image, ax=axes, label="elevation [m]", pad=0.02, shrink=0.85)
    slope = np.sqrt(np.mean(motion.slope_north**2 + motion.slope_east**2))
    high, steep = 4 * motion.elevation.std(), np.degrees(np.arctan(slope))
    axes.set_title(f"A patch {high:.2g} m high,\nslope {steep:.1f}° rms from waves > {drawn.shortest_wavelength:.2g} m")
    axes.set_xlabel("east [m]")
    axes.set_ylabel("north [m]")


def coherence(axes: Axes, kinds: dict[str, WaveSpectrum], frequency: float) -> None:
    """Draw the coherent reflection over the grazing angle.

    Args:
        axes: Axes to draw on.
        kinds: Spectra by name.
        frequency: Acoustic frequency [Hz].
    """
    grazing = np.radians(np.geomspace(0.01, 90, 400))
    for (name, spectrum), colour in zip(kinds.items(), WAVES, strict=True):
        coherent = coherent_reflection(frequency, significant_height(spectrum) / 4, grazing)
        axes.plot(np.degrees(grazing), level_db(coherent**2), color=colour, label=name)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_xlim(0.01, 90)
    axes.set_ylim(-60, 3)
    axes.set_title(f"Coherent reflection at {frequency / 1e3:g} kHz")
    axes.set_xlabel("grazing angle [deg]")
    axes.set_ylabel("coherent reflection, 20 log |R| [dB]")
    axes.legend(loc="upper right")


def echo(axes: Axes, wind_speed: float, frequency: float) -> Caveats:
    """Draw the backscatter of the surface, in total and by mechanism.

    Args:
        axes: Axes to draw on.
        wind_speed: Wind 10 m above the sea [m/s].
        frequency: Acoustic frequency [Hz].

    Returns:
        The caveats of the laws.
    """
    total = evaluate_with_caveats(lambda: apl_surface_strength_db(wind_speed, frequency, GRAZING))
    facets = evaluate_with_caveats(lambda: backscatter_db(SurfaceScattering.at_wind(wind_speed, frequency), GRAZING))
    bubbles = evaluate_with_caveats(lambda: backscatter_db(Bubbles(wind_speed, frequency), GRAZING))
    degrees = np.degrees(GRAZING)
    curve(axes, degrees, total, style.CONTRIBUTION_COLOURS["surface"], "APL-UW TR 9407")
    curve(axes, degrees, facets, style.FAMILIES["B"], "facets and bubbles only")
    curve(axes, degrees, bubbles, style.FAMILIES["BS"], "bubbles only")
    _strength_axes(axes)
    axes.set_title(f"Backscatter at {frequency / 1e3:g} kHz")
    axes.legend(loc="upper left")
    return total.caveats + facets.caveats + bubbles.caveats


def winds(axes: Axes, wind_speed: float, frequency: float) -> Caveats:
    """Draw the backscatter of the surface at this wind speed, beside lower and higher ones.

    Args:
        axes: Axes to draw on.
        wind_speed: Wind 10 m above the sea [m/s].
        frequency: Acoustic frequency [Hz].

    Returns:
        The caveats of the law.
    """
    caveats: Caveats = ()
    colours = {2.0: "#56B4E9", 5.0: "#009E73", 10.0: "#E69F00", 15.0: "#D55E00"}
    for wind, colour in sorted({**colours, wind_speed: style.CONTRIBUTION_COLOURS["surface"]}.items()):
        strength = evaluate_with_caveats(partial(apl_surface_strength_db, wind, frequency, GRAZING))
        curve(axes, np.degrees(GRAZING), strength, colour, f"{wind:g} m/s")
        caveats += strength.caveats
    _strength_axes(axes)
    axes.set_title("Backscatter at other wind speeds")
    axes.legend(loc="upper left", ncols=2)
    return caveats


def _waves(spectrum: WaveSpectrum) -> Floats:
    return np.geomspace(spectrum.peak / 8, 5e3, 600)


def _log_axes(axes: Axes) -> None:
    axes.set(xscale="log", yscale="log", xlabel="wavenumber [rad/m]")


def _strength_axes(axes: Axes) -> None:
    axes.set(xlim=(0, 90), xticks=np.arange(0, 91, 15), ylim=(-70, 20), xlabel="grazing angle [deg]", ylabel=STRENGTH)
