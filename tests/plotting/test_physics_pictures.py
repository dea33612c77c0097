"""Pictures of laws, waters and seas show the numbers of their laws, and state where a law is out of its depth."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from insonify import plotting
from insonify.ocean import SoundSpeedProfile, significant_height
from insonify.plotting import style
from insonify.plotting.absorption import WATERS, losses
from insonify.plotting.laws import GRAZING, HANDBOOK, backscatter_curves, hemisphere, reflection_curves, sediment_curves
from insonify.plotting.profile import gradients, probe, speeds
from insonify.plotting.relief_spectrum import ground, ground_spectrum, ring_spectrum
from insonify.plotting.sea_state import coherence, echo, heights, seas, slopes, surface_patch, wind_sea, winds
from insonify.plotting.validity_style import add_caveats, curve, evaluate_with_caveats
from insonify.scattering import Jackson, Lambert, Sediment, apl_bottom_strength_db, reflection_coefficient
from insonify.scene.terrain import PowerLaw, RoughnessCutoff
from insonify.validity import PhysicsWarning, warn_outside

SAND, CLAY, ROCK = (Sediment.named(name) for name in ("medium sand", "clay", "rough rock"))
COLUMN = SoundSpeedProfile([0.0, 10.0, 30.0], [1500.0, 1505.0, 1485.0])
UNIT = re.compile(r"\[[^]]+\]$")


def blank(**how: object) -> Axes:
    """Empty axes."""
    return style.new_figure().add_subplot(**how)


def curves(axes: Axes) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """What was drawn, by label."""
    return {str(line.get_label()): (np.asarray(line.get_xdata()), np.asarray(line.get_ydata())) for line in axes.lines}


def test_surface_and_inside_add_up_to_the_law() -> None:
    """Where no cap is needed the energies of surface and volume are the whole, at azimuth pi: straight back."""
    axes = blank()
    assert backscatter_curves(axes, SAND, 100e3) == ()
    drawn = {name: 10 ** (level / 10) for name, (_, level) in curves(axes).items()}
    whole = drawn["surface (small slope)"] + drawn["volume"]
    np.testing.assert_allclose(drawn["both (Jackson)"], whole, rtol=1e-9)
    back = Jackson(SAND, 100e3).cross_section(GRAZING, GRAZING, np.asarray(np.pi))
    np.testing.assert_allclose(drawn["both (Jackson)"], back, rtol=1e-9)


def test_the_handbook_is_drawn_only_where_it_stands() -> None:
    """TR 9407 reaches to 100 kHz: its level is there at 100 kHz and absent at 300 kHz."""
    near, far = blank(), blank()
    backscatter_curves(near, SAND, 100e3)
    assert backscatter_curves(far, SAND, 300e3)
    np.testing.assert_array_equal(curves(near)[HANDBOOK][1], apl_bottom_strength_db(SAND, 100e3, GRAZING))
    assert HANDBOOK not in curves(far)


def test_lambert_is_beside_every_sediment() -> None:
    """Lambert's -27 dB at vertical incidence, and 6 dB less at 30 degrees: the square of the sine."""
    axes = blank()
    sediment_curves(axes, [SAND, CLAY], 100e3)
    angle, level = curves(axes)["Lambert, -27 dB"]
    assert level[-1] == pytest.approx(-27.0)
    assert np.interp(30.0, angle, level) == pytest.approx(-27 + 20 * np.log10(0.5), abs=0.01)
    assert {"medium sand", "clay"} <= set(curves(axes))


def test_a_law_in_doubt_is_dashed_and_named() -> None:
    """Outside its range a curve is dashed, the small print names the law, and there is no other warning."""
    figure = style.new_figure()
    axes = figure.subplots()

    def law() -> np.ndarray:
        warn_outside("Law of nowhere", "frequency", 300.0, 10.0, 100.0, "kHz")
        return np.zeros(3)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        evaluated = evaluate_with_caveats(law)
    curve(axes, np.arange(3.0), evaluated, "k", "doubtful")
    curve(axes, np.arange(3.0), evaluate_with_caveats(lambda: np.ones(3)), "k", "trusted")
    add_caveats(figure, evaluated.caveats)
    assert [line.get_linestyle() for line in axes.lines] == ["--", "-"]
    assert "Law of nowhere is trusted for frequency 10 to 100 kHz" in figure.get_supxlabel()


def test_other_warnings_are_not_swallowed() -> None:
    """Only what a law states about physics is kept on the picture."""
    with pytest.warns(UserWarning, match="something else"):
        evaluated = evaluate_with_caveats(
            lambda: np.array([warnings.warn("something else", UserWarning, stacklevel=1) is None])
        )
    assert evaluated.caveats == ()


def test_rough_rock_is_too_steep_for_the_law_and_is_warned_of() -> None:
    """The slopes of rough rock are beyond small-slope scattering at every frequency."""
    assert any("rms slope" in doubt for doubt in backscatter_curves(blank(), ROCK, 30e3))


@pytest.mark.parametrize("bed", [SAND, CLAY, ROCK], ids=lambda bed: bed.name)
def test_the_mirror_turns_from_a_reversal_to_nothing(bed: Sediment) -> None:
    """Phase is drawn in one piece: 180 degrees at grazing incidence, about 0 from above, no jump between."""
    size, phase = blank(), blank()
    reflection_curves(size, phase, bed)
    angle, turned = (np.asarray(c) for c in phase.lines[0].get_data())
    assert abs(turned[0]) == pytest.approx(180, abs=0.1) and abs(turned[-1]) < 5
    assert np.abs(np.diff(turned)).max() < 30
    again = np.asarray(size.lines[0].get_ydata()) * np.exp(1j * np.radians(turned))
    np.testing.assert_allclose(again, reflection_coefficient(bed, np.radians(angle)), atol=1e-12)


def test_the_critical_angle_is_where_sand_begins_to_let_sound_in() -> None:
    """Snell: cos = 1 / speed ratio, marked for sand and absent for clay, which is slower than water."""
    marked, bare = blank(), blank()
    reflection_curves(marked, blank(), SAND)
    reflection_curves(bare, blank(), CLAY)
    assert marked.lines[1].get_xdata()[0] == pytest.approx(np.degrees(np.arccos(1 / SAND.speed_ratio)))
    assert len(bare.lines) == 1


def test_a_lobe_is_the_law_and_the_same_on_both_sides() -> None:
    """Each cell holds the strength of its middle; left and right of the plane of incidence are alike."""
    axes, law, grazing = blank(projection="polar"), Jackson(SAND, 50e3), np.radians(30.0)
    assert hemisphere(axes, lambda: law, grazing) == ()
    level = np.asarray(axes.collections[0].get_array())
    np.testing.assert_allclose(level, level[:, ::-1], atol=1e-9)
    zenith, azimuth = np.radians(90 * (40 + 0.5) / 120), np.radians(-180 + 360 * (10 + 0.5) / 241)
    sigma = law.cross_section(np.asarray(grazing), np.asarray(np.pi / 2 - zenith), np.asarray(azimuth))
    assert level[40, 10] == pytest.approx(10 * np.log10(float(sigma)), abs=1e-9)


def test_the_strongest_of_the_lobe_of_sand_is_its_mirror() -> None:
    """The brightest cell lies within a few degrees of the circle that marks the mirror direction."""
    axes, grazing = blank(projection="polar"), np.radians(60.0)
    hemisphere(axes, lambda: Jackson(SAND, 30e3), grazing)
    level = np.asarray(axes.collections[0].get_array())
    row, column = np.unravel_index(np.argmax(level), level.shape)
    azimuth, radius = axes.lines[0].get_data()
    assert (row + 0.5) * 90 / 120 == pytest.approx(radius[0], abs=4)
    assert (column + 0.5) * 360 / 241 - 180 == pytest.approx(np.degrees(azimuth[0]), abs=4)


def test_a_lobe_needs_a_round_sheet() -> None:
    """Straight axes are refused with the fix."""
    with pytest.raises(TypeError, match="polar"):
        hemisphere(blank(), Lambert, 0.5)


def test_rings_hold_the_variance_of_a_known_wave() -> None:
    """Parseval: the ring spectrum of white noise, times the area of wavenumbers, is its variance."""
    height = np.random.default_rng(5).normal(size=(256, 256))
    _, density = ring_spectrum(height, 0.1)
    assert np.mean(density[-8:]) * (2 * np.pi / 0.1) ** 2 == pytest.approx(1.0, rel=0.05)


def test_the_patch_has_the_spectrum_that_was_requested() -> None:
    """Wavelengths of 0.6 m to 8 m of the drawn patch have the resolved spectrum: 1 dB on the mean, 3 dB each ring.

    N = 1 patch with 20 rings; the longest ring holds some 30 waves, 4.34 / sqrt(30) = 0.8 dB.
    """
    axes = blank()
    ground_spectrum(axes, SAND)
    K, measured = curves(axes)["measured on the patch"]
    wavelength = 2 * np.pi / K
    inside = (wavelength > 0.6) & (wavelength < 8)
    law = PowerLaw.of_sediment(SAND)
    resolved = (law.spectrum(K) * law.resolved_fraction(K, RoughnessCutoff()))[inside]
    apart = 10 * np.log10(measured[inside] / resolved)
    assert abs(apart.mean()) < 1 and np.abs(apart).max() < 3


def test_absorption_is_drawn_by_both_laws_and_weak_where_untrusted() -> None:
    """Two curves for each water; brackish water is outside Francois & Garrison, and alone is pale."""
    upper, lower = blank(), blank()
    caveats = losses(upper, lower, WATERS, 0.0)
    lines = [line for line in upper.lines if len(line.get_xdata())]
    assert len(lines) == 2 * len(WATERS)
    pale = [line.get_label() for line in lines if line.get_alpha() == 0.45]
    assert pale == ["Baltic, 8 °C, 8 g/kg"]
    assert caveats and all("Francois" in doubt for doubt in caveats)
    apart = np.concatenate([line.get_ydata() for line in lower.lines if len(line.get_xdata()) > 2])
    assert np.abs(apart).max() < 10  # Ainslie & McColm promise 10 %


def test_a_profile_hangs_down_and_colours_what_it_bends() -> None:
    """Knots as given; layers that slow down with depth bend sound down, layers that speed up bend it up."""
    axes = blank()
    speeds(axes, COLUMN)
    np.testing.assert_array_equal(axes.lines[0].get_xydata(), np.stack([COLUMN.speed, COLUMN.depth], axis=1))
    layers = blank()
    gradients(layers, COLUMN)
    filled = {to_hex(p.get_facecolor()): p.get_data().values for p in layers.patches if p.get_fill()}
    np.testing.assert_allclose(filled[style.CONTRIBUTION_COLOURS["surface"].lower()], [0.5, 0])
    np.testing.assert_allclose(filled[style.CONTRIBUTION_COLOURS["seabed"].lower()], [0, -1.0])


def test_temperature_and_salinity_have_axes_of_their_own() -> None:
    """Two quantities, two scales, each with its unit."""
    axes = blank()
    probe(axes, COLUMN, [18, 12, 9], [34, 34.5, 35])
    assert {a.get_xlabel() for a in axes.figure.axes} == {"temperature [degC]", "salinity [g/kg]"}


def test_the_legend_of_the_waves_is_their_significant_height() -> None:
    """Each spectrum is drawn as it is, with its own height beside it."""
    kinds, axes = seas(10.0), blank()
    heights(axes, kinds)
    for name, (k, density) in curves(axes).items():
        kind, _, words = name.rpartition(":")
        np.testing.assert_array_equal(density, kinds[kind].density(k))
        assert float(words.split()[0]) == pytest.approx(significant_height(kinds[kind]), rel=0.05)


def test_slopes_below_the_mark_add_up_to_the_legend() -> None:
    """The area under the curve up to a third of k is the mean square slope that the legend gives."""
    kinds, axes = seas(10.0), blank()
    slopes(axes, kinds, 30e3)
    mark = 2 * np.pi * 30e3 / 1500 / 3
    for name, (k, share) in curves(axes).items():
        if "rms" in name:
            below = k < mark
            area = np.trapezoid(share[below], np.log(k[below]))
            expected = float(name.rpartition(":")[2].split("°")[0])
            assert np.degrees(np.arctan(np.sqrt(area))) == pytest.approx(expected, abs=0.15)


def test_the_coherent_mirror_is_gone_above_grazing() -> None:
    """20 log |R| = -8.7 (k h sin)^2 2: lost in decibels with the square of the height, nothing at the horizon."""
    kinds, axes = seas(7.0), blank()
    coherence(axes, kinds, 100e3)
    for name, (angle, level) in curves(axes).items():
        h = significant_height(kinds[name]) / 4
        there = level > -60
        expected = -20 * np.log10(np.e) * 2 * (2 * np.pi * 100e3 / 1500 * h * np.sin(np.radians(angle))) ** 2
        np.testing.assert_allclose(level[there], expected[there], atol=1e-6)


def test_more_wind_more_bubbles() -> None:
    """At 20 degrees and 100 kHz the echo grows with the wind until the bubbles have it all."""
    axes = blank()
    assert winds(axes, 7.0, 100e3) == ()
    at_20 = {name: float(np.interp(20, *pair)) for name, pair in curves(axes).items()}
    assert at_20["2 m/s"] < at_20["5 m/s"] < at_20["7 m/s"]
    assert list(at_20) == ["2 m/s", "5 m/s", "7 m/s", "10 m/s", "15 m/s"]


def test_the_title_of_the_patch_is_its_own_height() -> None:
    """Four times the standard deviation of what is drawn; the same seed draws the same sea."""
    first, again = blank(), blank()
    surface_patch(first, wind_sea(5.0, 3))
    surface_patch(again, wind_sea(5.0, 3))
    drawn = np.asarray(first.images[0].get_array())
    assert f"{4 * drawn.std():.2g} m high" in first.get_title(loc="left") + first.get_title()
    np.testing.assert_array_equal(drawn, np.asarray(again.images[0].get_array()))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["sediment", "laws", "lobe", "relief", "absorption", "profile", "sea"])
def test_every_picture_is_written_without_a_word(tmp_path: Path, name: str) -> None:
    """Caveats of laws stand on the picture; stderr stays empty, even for rough rock at 300 kHz in a gale."""
    path = tmp_path / "picture.png"
    draw = {
        "sediment": lambda: plotting.sediment(ROCK, path, frequency=300e3),
        "laws": lambda: plotting.laws([ROCK, SAND], path, frequency=300e3),
        "lobe": lambda: plotting.lobe(Lambert(), path),
        "relief": lambda: plotting.relief(CLAY, path, seed=4),
        "absorption": lambda: plotting.absorption(path),
        "profile": lambda: plotting.profile(COLUMN, path, temperature=[18, 12, 9]),
        "sea": lambda: plotting.sea(path, wind_speed=25.0, frequency=300e3),
    }[name]
    assert draw() == path and path.stat().st_size > 10_000


def axes_of_all() -> list[Axes]:
    """One of each kind of axes."""
    figure: Figure = style.new_figure(20, 20)
    a = figure.subplots(4, 3).ravel()
    backscatter_curves(a[0], SAND, 50e3)
    reflection_curves(a[1], a[2], SAND)
    ground(a[3], SAND)
    ground_spectrum(a[4], SAND)
    losses(a[5], a[6], WATERS, 0.0)
    heights(a[7], seas(7.0))
    slopes(a[8], seas(7.0), 50e3)
    surface_patch(a[9], wind_sea(7.0, 0))
    coherence(a[10], seas(7.0), 50e3)
    echo(a[11], 7.0, 50e3)
    return list(figure.axes)


def test_every_axis_has_a_unit() -> None:
    """Words and a unit in brackets; the upper absorption panel shares its abscissa with the lower."""
    named = [label for axes in axes_of_all() for label in (axes.get_xlabel(), axes.get_ylabel()) if label]
    assert len(named) >= 24
    assert [label for label in named if not UNIT.search(label)] == []


def test_too_many_curves_are_refused(tmp_path: Path) -> None:
    """Nine sediments have not nine colours that every reader distinguishes."""
    with pytest.raises(ValueError, match="1 to 8"):
        plotting.laws([SAND] * 9, tmp_path / "x.png")
    with pytest.raises(ValueError, match="1 to 6"):
        plotting.absorption(tmp_path / "x.png", waters={str(n): WATERS[next(iter(WATERS))] for n in range(7)})


def test_a_doubt_is_a_physics_warning_outside_pictures() -> None:
    """The same law, requested without a picture, warns its caller."""
    with pytest.warns(PhysicsWarning, match="10 to 100 kHz"):
        Jackson(SAND, 301e3)
