"""A picture of rays shows rays where rays are, and silence where the exact solver finds no direct path."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import to_hex

from insonify import arrivals, plotting
from insonify.ocean.profile import SoundSpeedProfile
from insonify.paper.nominal_scenario import nominal
from insonify.plotting import style
from insonify.plotting.rays import section, shadow_zone, speed
from insonify.plotting.spikes_by_source import spikes_by_source
from insonify.propagation.ray_fan import trace_fan
from insonify.propagation.sound_speed_layers import sound_speed_layers
from insonify.units import level_db
from oracles.few_of import few_of

THERMO = SoundSpeedProfile([0.0, 8.0, 14.0, 20.0], [1510.0, 1510.0, 1490.0, 1490.0])
STILL = SoundSpeedProfile([0.0, 20.0], [1500.0, 1500.0])
UNIT = re.compile(r"\[[^]]+\]$")


def blank() -> Axes:
    """Empty axes."""
    return style.new_figure().subplots()


def drawn(profile: SoundSpeedProfile, bounces: int = 2) -> Axes:
    """A section with a fan of 41 rays from 11 m."""
    axes = blank()
    rays = trace_fan(
        sound_speed_layers(profile, 20.0),
        11.0,
        np.radians(np.linspace(-20, 20, 41)),
        max_range=150.0,
        max_bounces=bounces,
    )
    section(axes, rays, 20.0, 11.0)
    return axes


def test_each_family_has_the_colour_that_it_has_everywhere() -> None:
    """D, S, B, SB and BS lines in the colours of the style, named in the legend."""
    axes = drawn(THERMO)
    colours = {to_hex(lines.get_color()[0]) for lines in axes.collections if isinstance(lines, LineCollection)}
    assert colours == {value.lower() for value in style.FAMILIES.values()}
    assert {text.get_text() for text in axes.get_legend().get_texts()} == set(style.FAMILIES)


def test_all_rays_of_a_fan_are_drawn_to_the_end() -> None:
    """One line for each piece between bounces; together they span the range of the fan, in the water."""
    axes = drawn(STILL)
    lines = [line for lot in axes.collections if isinstance(lot, LineCollection) for line in lot.get_segments()]
    points = np.concatenate(lines)
    assert points[:, 0].min() == 0 and points[:, 0].max() == 150
    assert points[:, 1].min() >= 0 and points[:, 1].max() <= 20
    assert sum(line[0, 0] == 0 for line in lines) == 41


def test_silent_water_is_where_no_direct_ray_goes() -> None:
    """Under a thermocline no traced direct ray of 2000 crosses a cell that is drawn silent; still water has none."""
    axes = blank()
    assert shadow_zone(axes, THERMO, 20.0, 11.0, 200.0)
    mesh = axes.collections[0]
    dark = ~np.ma.getmaskarray(np.ma.masked_invalid(mesh.get_array()))
    rows, columns = dark.shape
    rays = trace_fan(
        sound_speed_layers(THERMO, 20.0),
        11.0,
        np.radians(np.linspace(-60, 60, 2001)),
        max_range=200.0,
        max_bounces=0,
        step=0.3,
    )
    x = np.clip((rays.range / 200 * columns).astype(int), 0, columns - 1)
    z = np.clip((rays.depth / 20 * rows).astype(int), 0, rows - 1)
    hit = np.zeros_like(dark)
    hit[z, x] = True
    inner = dark.copy()  # cells at the edge are half lit
    for axis in (0, 1):
        for step in (-1, 1):
            inner &= np.roll(dark, step, axis)
    assert 0.05 < dark.mean() < 0.5
    assert not (hit & inner).any()
    assert not shadow_zone(blank(), STILL, 20.0, 11.0, 200.0)


def test_the_source_is_marked_on_the_profile() -> None:
    """At its depth, with the speed of the water there."""
    axes = blank()
    speed(axes, THERMO.depth, THERMO.speed, 11.0)
    mark = axes.lines[-1]
    assert list(mark.get_xdata()) == [1500.0] and list(mark.get_ydata()) == [11.0]
    assert all(UNIT.search(label) for label in (axes.get_xlabel(), axes.get_ylabel()))


@pytest.mark.filterwarnings("error")
@few_of(
    (0, 1, 5),
    "how",
    [{}, {"launch": [0.0]}, {"max_range": 60.0, "bounces": 0}, {"water_depth": 17.0, "launch": np.radians([-3, 3])},
     {"source_depth": 0.0}, {"source_depth": 20.0, "bounces": 8}],
)  # fmt: skip
def test_every_picture_of_rays_is_written(tmp_path: Path, how: dict[str, object]) -> None:
    """From a fan to one ray, from surface to bed, without a warning."""
    path = tmp_path / "rays.png"
    assert plotting.rays(THERMO, path, **{"source_depth": 11.0, **how}) == path
    assert path.stat().st_size > 10_000


def test_water_deeper_than_the_profile_is_refused(tmp_path: Path) -> None:
    """The sound speed there is unknown."""
    with pytest.raises(ValueError, match="ends at 20 m; the water is 30 m deep"):
        plotting.rays(THERMO, tmp_path / "x.png", source_depth=11.0, water_depth=30.0)


@pytest.mark.parametrize("span", [None, (20.0, 110.0)])
def test_spikes_by_source_stand_where_their_paths_are(span: tuple[float, float] | None) -> None:
    """One mark for each path of each source, in the source's colour, at its delay and level."""
    paths = arrivals(nominal({"paths.geometry": "slice", "paths.max_reflections": 0, "track.window": [0.199, 0.203],
                              "surface.scattering": {"strength_db": -30.0}}))  # fmt: skip
    level = level_db(np.abs(paths.amplitude) ** 2) + 220
    axes = blank()
    spikes_by_source(axes, paths, level, "level [dB re 1 uPa]", span=span)
    for label, contribution in (("seabed", "seabed"), ("surface", "surface"), ("box", "target")):
        own = paths.object == label
        (marks,) = (
            lot for lot in axes.collections
            if isinstance(lot, PathCollection)
            and to_hex(lot.get_facecolor()[0]) == style.CONTRIBUTION_COLOURS[contribution].lower()
        )  # fmt: skip
        np.testing.assert_allclose(marks.get_offsets(), np.stack([1e3 * paths.delay[own], level[own]], axis=-1))
    assert axes.get_ylim() == (span or pytest.approx((axes.get_ylim()[1] - 60, axes.get_ylim()[1])))
    assert axes.get_ylim()[1] > level.max()
