"""Pictures of legs, spikes and levels state what their records state."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import rgb_to_hsv, to_rgb

from insonify import arrivals, levels, plotting
from insonify.paper.nominal_scenario import nominal
from insonify.plotting import style
from insonify.plotting.leg_diagram import leg
from insonify.plotting.levels import curves
from insonify.plotting.spikes import pair_colour, spike_array
from insonify.propagation.families import families_up_to, image_depth

QUICK = {"paths.geometry": "slice", "track.window": [0.2, 0.206]}


@pytest.mark.parametrize("family", families_up_to(4))
def test_a_drawn_leg_is_as_long_as_its_image_is_far(family: str) -> None:
    """The corners of a folded leg add up to the straight line from the image of the sonar."""
    x, z = leg(family, 11.0, 19.0, 150.0, 20.0)
    drawn = np.sum(np.hypot(np.diff(x), np.diff(z)))
    assert drawn == pytest.approx(np.hypot(150.0, 19.0 - image_depth(family, 11.0, 20.0)), rel=1e-12)
    assert set(z[1:-1]) <= {0.0, 20.0}


@pytest.mark.parametrize("family", families_up_to(4))
def test_a_drawn_leg_is_reflected_like_light(family: str) -> None:
    """The slope turns its sign at each boundary and keeps its size."""
    x, z = leg(family, 11.0, 19.0, 150.0, 20.0)
    slope = np.diff(z) / np.diff(x)
    np.testing.assert_allclose(slope[1:], -slope[:-1], rtol=1e-12)


def test_levels_are_drawn_as_they_are(tmp_path: Path) -> None:
    """One curve for each contribution that is received, in its own colour."""
    data = levels(nominal(QUICK))
    with style.plot_style():
        axes = style.new_figure().subplots()
        curves(axes, data)
    drawn = {line.get_label(): line for line in axes.lines}
    assert set(drawn) == {"seabed", "target", "total"}
    assert drawn["seabed"].get_color() == style.CONTRIBUTION_COLOURS["seabed"]
    total = data["level_db"].sel(contribution="total", pair="all").values
    np.testing.assert_array_equal(drawn["total"].get_ydata(), total)
    assert plotting.levels(data, tmp_path / "levels.png").exists()


def test_every_spike_has_the_colour_of_its_pair(tmp_path: Path) -> None:
    """Out and back or back and out, and with or without a last bounce beside the target: one colour."""
    paths = arrivals(nominal(QUICK))
    colour = pair_colour(paths)
    mixed = ((paths.transmit_family == "D") & (paths.receive_family == "S")) | (
        (paths.transmit_family == "SB") & (paths.receive_family == "B")
    )
    assert set(colour[mixed]) == {style.PAIRS["D-S"]}
    assert set(colour) <= set(style.PAIRS.values())
    assert plotting.spikes(paths, tmp_path / "spikes.png").exists()


def test_nothing_received_is_an_empty_picture() -> None:
    """A list without paths can be drawn."""
    paths = arrivals(nominal({**QUICK, "targets": [], "paths.contributions": ["target"]}))
    axes = style.new_figure().subplots()
    spike_array(axes, paths, np.zeros(0), "level")
    assert axes.get_xlabel() == "delay [ms]"


def test_the_five_legs_are_drawn(tmp_path: Path) -> None:
    """The paper's legs a-e make a picture."""
    assert plotting.geometry(tmp_path / "legs.png").exists()


def test_causes_and_pairs_do_not_share_colours_among_themselves() -> None:
    """Each contribution, family and pair is distinguished from its like."""
    for colours in (style.CONTRIBUTION_COLOURS, style.FAMILIES, style.PAIRS):
        assert len(set(colours.values())) == len(colours)


def test_sonar_colours_grow_lighter_all_the_way() -> None:
    """Relative luminance of the copper scale rises with the level, so that it reads in grey as well."""
    luminance = style.COPPER(np.linspace(0, 1, 256))[:, :3] @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(luminance) >= 0)


def test_pairs_have_the_hue_of_their_longer_leg() -> None:
    """By way of the surface: blue like S; by way of both boundaries: pink like BS; no other leg's colour is used."""
    hue = {name: rgb_to_hsv(to_rgb(colour))[0] for name, colour in (style.PAIRS | style.FAMILIES).items()}
    assert hue["D-S"] == pytest.approx(hue["S"], abs=0.03) and hue["S-S"] == pytest.approx(hue["S"], abs=0.03)
    for pair in ("D-BS", "S-BS", "BS-BS"):
        assert hue[pair] == pytest.approx(hue["BS"], abs=0.03)
    assert not {style.FAMILIES["B"], style.FAMILIES["SB"]} & set(style.PAIRS.values())
    assert not set(style.CONTRIBUTION_COLOURS.values()) & {style.FAMILIES[name] for name in ("S", "B", "SB", "BS")}
