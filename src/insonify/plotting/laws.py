"""Scattering and reflection of a seabed: backscatter and reflection coefficient over grazing angle, bistatic lobes.

In backscatter the surface and the volume of the sediment are drawn separately, beside the strength of the handbook
and Lambert's law. The lobe is the bistatic strength of one incidence over the hemisphere above the patch.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MultipleLocator

from insonify.plotting import style
from insonify.plotting.relief_spectrum import ground, ground_spectrum
from insonify.plotting.validity_style import Caveats, Floats, add_caveats, curve, evaluate_with_caveats
from insonify.scattering.apl_bottom import apl_bottom_strength_db
from insonify.scattering.jackson import Jackson
from insonify.scattering.lambert import Lambert
from insonify.scattering.law import ScatteringLaw
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.sediment_volume import SedimentVolume
from insonify.scattering.sediments import Sediment
from insonify.scattering.small_slope import SmallSlope
from insonify.units import level_db

FREQUENCIES = (30e3, 100e3, 300e3)
"""Frequencies at which a sediment is shown [Hz]."""
INCIDENCE = np.radians(20.0)
"""Grazing angle of incidence of the lobe [rad]."""
WEAKEST = 45.0
"""Range of strengths of a lobe below its maximum [dB]."""
COLOURS = ("#1A1A1A", "#D55E00", "#E69F00", "#009E73", "#56B4E9", "#0072B2", "#CC79A7", "#8A8A8A")
"""Colours of several sediments on one axis, Okabe & Ito (2008)."""
GRAZING = np.radians(np.concatenate([np.linspace(0.5, 10, 39), np.linspace(10.5, 90, 319)]))
HANDBOOK = "APL-UW TR 9407"
STRENGTH = "scattering strength [dB re 1 m$^2$/m$^2$]"


def sediment(bed: Sediment, path: str | Path, *, frequency: float = 100e3, seed: int = 0) -> Path:
    """Draw the acoustic properties of a sediment: backscatter, reflection coefficient, lobe and relief.

    Args:
        bed: Sediment to draw.
        path: File of the figure.
        frequency: Frequency of the lobe [Hz]; the backscatter is drawn at `FREQUENCIES`.
        seed: Random seed of the patch of relief [1].

    Returns:
        The path.

    Example:
        >>> sand = insonify.scattering.Sediment.named("medium sand")
        >>> picture = sediment(sand, "sand.png", frequency=300e3)
        >>> picture.name, picture.stat().st_size > 0
        ('sand.png', True)
    """
    with style.plot_style():
        figure = style.new_figure(13, 13)
        grid = figure.add_gridspec(3, 1)
        upper, middle, lower = (figure.add_subfigure(grid[row]) for row in range(3))
        caveats: list[str] = []
        echoes = upper.subplots(1, len(FREQUENCIES), sharey=True)
        for axes, tone in zip(echoes, FREQUENCIES, strict=True):
            caveats += backscatter_curves(axes, bed, tone)
            axes.label_outer()
            axes.set_xlabel("grazing angle [deg]")
        echoes[0].legend(loc="upper left", ncols=2, fontsize=8)
        panels = middle.subplot_mosaic("ABC", per_subplot_kw={"C": {"projection": "polar"}})
        reflection_curves(panels["A"], panels["B"], bed)
        caveats += hemisphere(
            panels["C"], lambda: Jackson(bed, frequency), INCIDENCE, title=f"Lobe at {frequency / 1e3:g} kHz"
        )
        left, right = lower.subplots(1, 2)
        ground(left, bed, seed=seed)
        ground_spectrum(right, bed, seed=seed, frequency=frequency)
        figure.suptitle(_facts(bed), ha="left", x=0.01, fontsize=11)
        add_caveats(figure, caveats)
        return style.save_figure(figure, path)


def laws(beds: Sequence[Sediment], path: str | Path, *, frequency: float = 100e3) -> Path:
    """Draw the backscatter of several sediments, on one axis.

    Args:
        beds: Sediments, at most eight.
        path: File of the figure.
        frequency: Frequency [Hz].

    Returns:
        The path.

    Example:
        >>> beds = [insonify.scattering.Sediment.named(name) for name in ("coarse sand", "medium sand", "coarse silt")]
        >>> picture = laws(beds, "backscatter.png", frequency=100e3)
        >>> picture.name, picture.stat().st_size > 0
        ('backscatter.png', True)
    """
    if not 1 <= len(beds) <= len(COLOURS):
        raise ValueError(f"{len(beds)} sediments were given; a figure distinguishes 1 to {len(COLOURS)} by colour.")
    with style.plot_style():
        figure = style.new_figure(9, 5.5)
        add_caveats(figure, sediment_curves(figure.subplots(), beds, frequency))
        return style.save_figure(figure, path)


def lobe(law: ScatteringLaw, path: str | Path, *, grazing_in: float = INCIDENCE, title: str = "") -> Path:
    """Draw the bistatic scattering strength of a patch of interface for one direction of incidence.

    Args:
        law: Scattering law of the patch.
        path: File of the figure.
        grazing_in: Grazing angle of the incident sound [rad].
        title: Title of the figure; the law's name by default.

    Returns:
        The path.

    Example:
        >>> law = insonify.scattering.Lambert(strength_db=-27)
        >>> picture = lobe(law, "lobe.png", grazing_in=np.radians(20))
        >>> picture.name, picture.stat().st_size > 0
        ('lobe.png', True)
    """
    with style.plot_style():
        figure = style.new_figure(6.5, 5.8)
        axes = figure.add_subplot(projection="polar")
        add_caveats(figure, hemisphere(axes, lambda: law, grazing_in, title=title or type(law).__name__), "")
        return style.save_figure(figure, path)


def backscatter_curves(axes: Axes, bed: Sediment, frequency: float) -> Caveats:
    """Draw the backscatter over the grazing angle: surface, volume, their sum, and other laws.

    Args:
        axes: Axes to draw on.
        bed: Sediment to draw.
        frequency: Frequency [Hz].

    Returns:
        The caveats of the laws of the sediment.
    """
    parts: tuple[tuple[str, str, type[SmallSlope | SedimentVolume | Jackson]], ...] = (
        ("surface (small slope)", style.CONTRIBUTION_COLOURS["seabed"], SmallSlope),
        ("volume", style.FAMILIES["BS"], SedimentVolume),
        ("both (Jackson)", style.INK, Jackson),
    )
    strengths = [evaluate_with_caveats(partial(_backscatter_of, partial(law, bed, frequency))) for _, _, law in parts]
    degrees = np.degrees(GRAZING)
    for (label, colour, _), strength in zip(parts, strengths, strict=True):
        curve(axes, degrees, strength, colour, label)
    handbook = evaluate_with_caveats(lambda: apl_bottom_strength_db(bed, frequency, GRAZING))
    if not handbook.caveats:  # the handbook's model is drawn within its validity only
        # broad and pale, so that Jackson's law stays visible on top
        axes.plot(degrees, handbook.values, color=style.EXPECTED, linewidth=4, alpha=0.45, zorder=1.5, label=HANDBOOK)
    lambert = backscatter_db(Lambert(), GRAZING)
    axes.plot(degrees, lambert, color=style.QUIET, linestyle=":", label="Lambert, -27 dB")
    axes.set_title(f"Backscatter at {frequency / 1e3:g} kHz")
    _grazing_axis(axes)
    _strength_axis(axes)
    return tuple(caveat for strength in strengths for caveat in strength.caveats)


def sediment_curves(axes: Axes, beds: Sequence[Sediment], frequency: float) -> Caveats:
    """Draw the backscatter of several sediments by Jackson's law.

    Args:
        axes: Axes to draw on.
        beds: Sediments to draw.
        frequency: Frequency [Hz].

    Returns:
        The caveats of the law.
    """
    caveats: Caveats = ()
    for bed, colour in zip(beds, COLOURS, strict=False):
        strength = evaluate_with_caveats(partial(_backscatter_of, partial(Jackson, bed, frequency)))
        curve(axes, np.degrees(GRAZING), strength, colour, bed.name or "sediment")
        caveats += strength.caveats
    axes.plot(
        np.degrees(GRAZING), backscatter_db(Lambert(), GRAZING), color=style.QUIET, linestyle=":",
        label="Lambert, -27 dB",
    )  # fmt: skip
    axes.set_title(f"Backscatter at {frequency / 1e3:g} kHz, Jackson's law")
    _grazing_axis(axes)
    _strength_axis(axes)
    axes.legend(loc="upper left", ncols=3)
    return caveats


def reflection_curves(magnitude: Axes, phase: Axes, bed: Sediment) -> None:
    """Draw magnitude and phase of the reflection coefficient of the flat sediment.

    Args:
        magnitude: Axes for the magnitude of the coefficient.
        phase: Axes for its phase.
        bed: Sediment to draw.
    """
    angle = np.radians(np.linspace(0, 90, 721))
    coefficient = reflection_coefficient(bed, angle)
    magnitude.plot(np.degrees(angle), np.abs(coefficient), color=style.CONTRIBUTION_COLOURS["seabed"], linewidth=1.6)
    magnitude.set(ylim=(0, 1.05), title="Reflection by a flat bed", ylabel="pressure reflected, |R| [1]")
    unwrapped = np.degrees(np.unwrap(np.angle(coefficient)))
    unwrapped -= 360 * np.round(unwrapped[-1] / 360)  # unwrapped from grazing 0, where -180 and 180 are equal
    phase.plot(np.degrees(angle), unwrapped, color=style.CONTRIBUTION_COLOURS["seabed"], linewidth=1.6)
    phase.set(title="Phase of reflection, exp(+j$\\omega$t)", ylabel="phase of R [deg]")
    phase.yaxis.set_major_locator(MultipleLocator(45))
    for axes in (magnitude, phase):
        if bed.speed_ratio > 1:
            critical = float(np.degrees(np.arccos(1 / bed.speed_ratio)))
            axes.axvline(critical, color=style.QUIET, linestyle=":", label=f"critical angle, {critical:.1f}°")
            axes.legend(loc="best")
        _grazing_axis(axes)


def hemisphere(axes: Axes, make: Callable[[], ScatteringLaw], grazing_in: float, *, title: str = "") -> Caveats:
    """Draw the lobe of one incidence over the hemisphere: the vertical in the centre, the horizon at the rim.

    Args:
        axes: Polar axes.
        make: Function that returns the scattering law of the patch.
        grazing_in: Grazing angle of the incident sound [rad].
        title: Title of the figure.

    Returns:
        The caveats of the law.
    """
    if not isinstance(axes, PolarAxes):
        raise TypeError("a lobe needs polar axes: figure.add_subplot(projection='polar').")
    # the centres of the cells avoid the specular direction, where a law may be infinite
    azimuth, zenith = np.radians(np.linspace(-180, 180, 242)), np.radians(np.linspace(0, 90, 121))
    out, around = np.meshgrid(np.pi / 2 - _middles(zenith), _middles(azimuth), indexing="ij")
    strength = evaluate_with_caveats(lambda: level_db(make().cross_section(np.asarray(grazing_in), out, around)))
    mesh = _lobe_mesh(axes, azimuth, zenith, strength.values)
    axes.figure.colorbar(mesh, ax=axes, label=STRENGTH, shrink=0.8, pad=0.12)
    for where, mark, name in ((0.0, "o", "specular direction"), (np.pi, "x", "backscatter")):
        axes.plot([where], [90 - np.degrees(grazing_in)], mark, fillstyle="none", color=style.PAIRS["S-S"], label=name)
    axes.legend(loc="upper left", bbox_to_anchor=(-0.25, 0.02), fontsize=8)
    axes.set_title(f"{title}, incidence at {np.degrees(grazing_in):.3g}°".removeprefix(", "))
    return strength.caveats


def backscatter_db(law: ScatteringLaw, grazing: Floats) -> Floats:
    """Scattering strength straight back [dB] of a law at grazing angles [rad], shape of grazing."""
    return level_db(law.cross_section(grazing, grazing, np.full_like(grazing, np.pi)))


def _lobe_mesh(axes: PolarAxes, azimuth: Floats, zenith: Floats, strength: Floats) -> QuadMesh:
    top = float(5 * np.ceil(np.quantile(strength, 0.9995) / 5))
    axes.set(theta_zero_location="N", theta_direction=-1)
    axes.grid(False)
    mesh = axes.pcolormesh(
        azimuth, np.degrees(zenith), strength, cmap=style.COPPER, vmin=top - WEAKEST, vmax=top, rasterized=True
    )
    axes.set_axisbelow(False)
    axes.set_rlim(0, 90)
    plate = {"facecolor": "white", "alpha": 0.6, "linewidth": 0, "pad": 1}
    axes.set_rgrids([30, 60], ["60° grazing", "30°"], angle=68, fontsize=8, bbox=plate)
    ticks = ("forward", "45°", "90°", "135°", "back", "-135°", "-90°", "-45°")
    axes.set_thetagrids(np.arange(0, 360, 45), list(ticks), fontsize=9)
    axes.grid(True, color="white", alpha=0.25, linewidth=0.5)
    return mesh


def _middles(edges: Floats) -> Floats:
    return np.asarray((edges[1:] + edges[:-1]) / 2)


def _backscatter_of(make: Callable[[], ScatteringLaw]) -> Floats:
    """Backscattering strength of a law [dB], constructed here so that its caveats are collected."""
    return backscatter_db(make(), GRAZING)


def _grazing_axis(axes: Axes) -> None:
    axes.set_xlim(0, 90)
    axes.xaxis.set_major_locator(MultipleLocator(15))
    axes.set_xlabel("grazing angle [deg]")


def _strength_axis(axes: Axes) -> None:
    axes.set(ylim=(-70, 25), ylabel=STRENGTH)


def _facts(bed: Sediment) -> str:
    facts = (
        f"{bed.density_ratio:.3f} x the density of water, {bed.speed_ratio:.3f} x its sound speed, loss {bed.loss:.4f}"
    )
    rough = f"relief exponent {bed.spectral_exponent:g}, strength {bed.spectral_strength:.3g} m$^{{4-\\gamma}}$"
    volume = f"volume parameter {bed.volume_parameter:g}"
    return f"{bed.name[:1].upper() + bed.name[1:] or 'Sediment'}: {facts},\n{rough}, {volume}"
