"""Expected intensity in shadows of targets: the fast seabed path, the general one and the tracer agree, row by row."""

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from engines.test_fast_reverberation import quickly, thoroughly
from insonify.engines.fast_reverberation.radial_window import radials_crossing_targets
from insonify.engines.fast_reverberation.shadow_radials import (
    STRIPS,
    ShadowRun,
    _parts_of_strips,
    _probe_distances,
    _split_radials,
    shadow_radials,
)
from insonify.engines.target_shadows import shadow_sector
from insonify.paper import figure2, sidescan_model
from insonify.paper.nominal_scenario import box
from insonify.propagation.bounding_cylinders import bounding_cylinders
from insonify.simulator import build_simulator, simulate

Floats = NDArray[np.float64]

WINDOW = (0.1995, 0.2275)
STEP = 2e-3
DARK = np.arange(0.2020, 0.2259, STEP)
"""Starts of stretches of time that lie in the box's shadow by direct paths [s]."""


@lru_cache(maxsize=32)
def scene(relief: float = 0.02, off: float = 0.0, families: tuple[str, ...] = ("D",), water: Any = "one speed",
          cutoff: float | None = 0.5, **paths: Any) -> Any:  # fmt: skip
    """The paper's box, a distance to the north of the sonar's boresight [m], over a seabed of some rms relief [m]."""
    changes = {
        "paths.max_reflections": max(len(name) for name in families) if families != ("D",) else 0,
        "paths.families": list(families), "track.window": WINDOW, "targets": [{**box(2.0), "position": [off, 150.5]}],
        "seabed.cutoff_wavelength": cutoff, **{f"paths.{key}": value for key, value in paths.items()},
    }  # fmt: skip
    return sidescan_model.scene(water, changes, relief=relief)


def means(scenario: Any, run: Any = None, starts: Floats = DARK) -> Floats:
    """Level of each 2 ms [dB]."""
    intensity = simulate(scenario).intensity.values[0, 0] if run is None else run(build_simulator(scenario))[0]
    time = build_simulator(scenario).grid.time
    return np.array([10 * np.log10(intensity[(time >= t) & (time < t + STEP)].mean()) for t in starts])


@pytest.mark.parametrize(("relief", "most", "off"), [
    (0.02, 0.25, 0.0), (0.05, 0.45, -0.6), pytest.param(0.02, 0.25, -0.6, marks=pytest.mark.validate),
    pytest.param(0.05, 0.45, 0.0, marks=pytest.mark.validate),
])  # fmt: skip
@pytest.mark.parametrize("families", [("D",), ("D", "S"), ("D", "S", "BS"), ("S", "BS")])
def test_shadows_over_relief_are_those_of_the_general_path(
    relief: float, most: float, off: float, families: tuple[str, ...]
) -> None:
    """Any 2 ms of the shadow within 0.25 dB over 2 cm of relief, 0.45 dB over 5 cm, on its axis and 0.6 m beside it.

    With bottom bounces within 0.4 dB: 0.28 dB in one case, 0.09 with four times the points.
    Twenty points a cell in the general path are within 0.1 dB of eighty.
    """
    quick = means(scene(relief, off, families), quickly)
    general = means(scene(relief, off, families, scatterers_per_cell=20.0), thoroughly)
    assert np.abs(quick - general).max() < (0.4 if "BS" in families else most)


def test_shadows_over_the_relief_of_the_sediment_are_those_of_the_general_path() -> None:
    """Terrain down to the sediment's own cutoff, 8 cm: any 2 ms within 0.25 dB over 2 cm of relief."""
    quick = means(scene(0.02, cutoff=None), quickly)
    assert np.abs(quick - means(scene(0.02, cutoff=None, scatterers_per_cell=20.0), thoroughly)).max() < 0.25


def test_bottom_reflections_alone_are_those_of_many_points() -> None:
    """BS-BS over 3 cm of relief: any 2 ms of a run within 0.5 dB of 80 points a cell; the fast path was 11.8 dB off."""
    open_ground = scene(0.03, 0.0, ("BS",)).with_("targets", [])
    assert build_simulator(open_ground).fast_reverberation(build_simulator(open_ground).ping_geometry(0)) is None
    many = means(open_ground.with_("paths.scatterers_per_cell", 80.0), thoroughly)
    assert np.abs(means(open_ground) - many).max() < 0.5


@pytest.mark.parametrize(("relief", "most", "off"), [
    (0.02, 0.3, 0.6), pytest.param(0.02, 0.3, 0.0, marks=pytest.mark.validate),
    pytest.param(0.05, 0.6, 0.0, marks=pytest.mark.validate), pytest.param(0.05, 0.6, 0.6, marks=pytest.mark.validate),
])  # fmt: skip
def test_shadows_over_relief_are_those_of_the_tracer(relief: float, most: float, off: float) -> None:
    """Fast path at its defaults against 400 000 rays, which are within 0.2 dB of ten times as many at 2 cm."""
    traced = means(scene(relief, off, engine="tracer", rays=400_000))
    assert np.abs(means(scene(relief, off)) - traced).max() < most


@pytest.mark.validate
@pytest.mark.parametrize("relief", [0.01, 0.02, 0.03, 0.05])
@pytest.mark.parametrize("off", [0.0, 0.35, 0.6, -0.9, 1.5])
def test_shadows_of_many_rows_are_those_of_the_tracer(relief: float, off: float) -> None:
    """What a run gives, and the general path, against four million rays: within 0.4 dB any 2 ms, 0.15 dB rms.

    A run takes the fast path up to 3 cm of relief; 5 cm hides a tenth of the seabed, and it takes the general one.
    """
    traced = means(scene(relief, off, engine="tracer", rays=4_000_000))
    for way in (None, thoroughly):
        error = means(scene(relief, off), way) - traced
        assert np.abs(error).max() < 0.4
        assert np.sqrt(np.mean(error**2)) < 0.15


def test_the_darkest_row_is_the_middle_one() -> None:
    """Rows 0.6 m beside the axis lie within 0.4 dB of converged levels, and the middle one 5 dB and more below them."""
    rows = {off: means(scene(0.03, off)) for off in (-1.2, -0.6, 0.0, 0.6, 1.2)}
    level = {off: 10 * np.log10(np.mean(10 ** (row / 10))) for off, row in rows.items()}
    assert level[0.0] < min(level[-0.6], level[0.6]) - 5
    assert max(level[-0.6], level[0.6]) < min(level[-1.2], level[1.2])
    for off in (-0.6, 0.6):
        fine = means(scene(0.03, off, scatterers_per_cell=40.0), thoroughly)
        assert np.abs(rows[off] - fine).max() < 0.4


def test_more_points_a_cell_bring_the_fast_path_nearer() -> None:
    """Rms error of 2 ms over 5 cm of relief: below 0.1 dB at 40 points a cell, less than half of that at 5."""
    general = means(scene(0.05, scatterers_per_cell=80.0), thoroughly)
    some, many = (means(scene(0.05, scatterers_per_cell=n), quickly) - general for n in (5.0, 40.0))
    assert np.std(many) < min(0.1, np.std(some) / 1.5)


def test_soft_edges_of_targets_converge_too() -> None:
    """Edges by Fresnel on the axis: default and eight times as many points within 0.35 dB any 2 ms."""
    few, many = (means(scene(0.03, edge_diffraction="knife-edge", scatterers_per_cell=n), quickly) for n in (5.0, 40.0))
    assert np.abs(few - many).max() < 0.35


@pytest.mark.parametrize(("water", "off"), zip(sidescan_model.WATERS, (0.0, 0.6), strict=True))
def test_shadows_on_a_flat_bed_are_smooth(water: Any, off: float) -> None:
    """Sample for sample within 0.7 dB of sixteen times the points, 0.3 dB rms: coarse cells rippled by 2.8 dB."""
    first, last = figure2.dark(water)
    few, many = (simulate(scene(0.0, off, water=water, scatterers_per_cell=n)) for n in (5.0, 80.0))
    inside = (few.time.values >= first) & (few.time.values < last)
    ripple = 10 * np.log10((few.intensity / many.intensity).values[0, 0, inside])
    assert np.abs(ripple).max() < 0.7 and ripple.std() < 0.3


def test_a_shadow_that_the_beam_hardly_reaches_takes_no_more_lines() -> None:
    """A box in the side lobes: the plan's own lines; one on boresight: narrower lines in their position."""
    counts = []
    for off in (0.0, 30.0):
        simulator = build_simulator(scene(0.02, off))
        ground = simulator.fast_reverberation(simulator.ping_geometry(0))
        assert ground is not None
        counts.append([len(radial_set.radials) for radial_set in ground.radial_sets])
    assert len(counts[0]) == 2 and counts[0][1] > 3 * counts[1][0]
    assert counts[1] == [len(ground.plan.radials)]


def test_overlapping_shadows_are_looked_at_once() -> None:
    """The box, and three more in a row with it: no more looks at any range bin than for the box alone."""
    requested = []
    for many in (1, 4):
        row = [{**box(2.0), "label": f"box {k}", "position": [0.1 * k, 150.5]} for k in range(many)]
        simulator = build_simulator(scene(0.02).with_("targets", row))
        here = simulator.ping_geometry(0)
        ground = simulator.fast_reverberation(here)
        assert ground is not None
        passing = radials_crossing_targets(ground.plan, here, ground.prepared.heading, "none")
        stretch, distance, _ = _probe_distances(ground.plan, ground.rays, here, ground.path_settings, passing)
        assert passing.any(axis=1).sum() == many and len(np.unique(distance)) == len(distance)
        requested.append(np.bincount(stretch).max())
    assert requested[1] == requested[0]


def test_a_line_that_ends_before_a_target_does_not_pass_it() -> None:
    """Of all lines towards a box those whose last point is nearer than the box's cylinder cast no shadow."""
    simulator = build_simulator(scene(0.02))
    here = simulator.ping_geometry(0)
    ground = simulator.fast_reverberation(here)
    assert ground is not None
    plan = ground.plan
    north, east, radius = plan.bounding_cylinders[0, :3]
    nearest = np.hypot(north - here.transmit_position[0], east - here.transmit_position[1]) - radius
    passing = radials_crossing_targets(plan, here, ground.prepared.heading, "none")[0]
    assert passing.any() and (plan.radials[passing, 5] > nearest).all()


def test_narrow_lines_cover_the_ground_of_those_they_replace() -> None:
    """Kept lines and new ones: the areas of all add up to those of the plan's lines, line by line to a millionth."""
    simulator = build_simulator(scene(0.02))
    here = simulator.ping_geometry(0)
    ground = simulator.fast_reverberation(here)
    assert ground is not None
    plan = ground.plan
    passing = radials_crossing_targets(plan, here, ground.prepared.heading, "none")
    made = shadow_radials(plan, ground.rays, here, ground.path_settings, ground.prepared.heading, passing)
    assert made is not None

    def area(radials: Floats) -> float:
        return float(np.sum((radials[:, 5] ** 2 - radials[:, 4] ** 2) / 2 * radials[:, 2]))

    assert made.replaced.any() and len(made.radials) > 2 * len(plan.radials)
    assert area(made.radials) == pytest.approx(area(plan.radials[made.replaced]), rel=1e-6)
    np.testing.assert_allclose(np.hypot(made.radials[:, 0], made.radials[:, 1]), 1.0, rtol=1e-12)
    new = made.radials[made.radials[:, 7] >= len(plan.radials), 7]
    assert len(new) > 50 and len(np.unique(new)) == len(new)


def test_a_line_is_cut_evenly_in_each_of_its_strips() -> None:
    """Two lines, one in 2 strips of 1 and 3 parts: borders coincide, and widths are those of the strips."""
    radials = np.zeros((2, 9))
    radials[:, 0], radials[:, 2], radials[:, 4], radials[:, 5] = 1.0, (0.08, 0.02), 5.0, 50.0
    parts = np.zeros((5, STRIPS), np.int64)
    parts[3, :2] = 1, 3
    row, made = _split_radials(np.array([3, 4]), radials, parts, 100)
    np.testing.assert_array_equal(row, [3, 3, 3, 3, 4])
    np.testing.assert_allclose(made[:, 2], [0.04, 0.04 / 3, 0.04 / 3, 0.04 / 3, 0.02])
    middle = np.arctan2(made[:, 1], made[:, 0])
    np.testing.assert_allclose(middle[:4] + made[:4, 2] / 2, [0.0, 0.04 / 3, 0.08 / 3, 0.04], atol=1e-12)
    np.testing.assert_array_equal(made[:, 7], [100, 101, 102, 103, 104])
    assert (made[:, 3] == made[:, 2]).all() and (made[:, 8] == 1).all()


def test_strips_follow_what_a_line_would_send_back_and_parts_what_it_does() -> None:
    """A dark line of 20 units has 8 strips of one part, a lit one of 3 has 4 strips; next to nothing stays as it is."""
    free = np.array([20.0, 3.0, 0.5, 0.001])
    left = np.repeat(free[:, None] / STRIPS, STRIPS, axis=1) * np.array([[0.0], [1.0], [1.0], [1.0]])
    parts = _parts_of_strips(free, left)
    np.testing.assert_array_equal((parts > 0).sum(axis=1), [8, 4, 1, 0])
    np.testing.assert_array_equal(parts.sum(axis=1), [8, 4, 1, 0])
    assert ShadowRun(1.0, 2.0, parts).far == 2.0


@pytest.mark.parametrize("water", sidescan_model.WATERS)
def test_a_zone_holds_the_shadow_that_exact_rays_give(water: Any) -> None:
    """From the box's face to where the ray over its far edge comes down, and not half as far again behind that."""
    simulator = build_simulator(scene(0.0, water=water))
    engine, here = simulator.engine, simulator.ping_geometry(0)
    zone = shadow_sector(engine.scene, engine.rays, here, ("D",), 0, 200.0, soft=False)
    end = sidescan_model.shadow_end(water)
    radius = bounding_cylinders(engine.scene)[0, 2]
    assert zone.near == pytest.approx(150.5 - radius) and zone.bearing == pytest.approx(np.pi / 2)
    assert np.sin(zone.half_width) == pytest.approx(radius / 150.5)
    assert end <= zone.far < end + (end - sidescan_model.BACK) / 2
    soft = shadow_sector(engine.scene, engine.rays, here, ("D",), 0, 200.0, soft=True)
    assert soft.far > zone.far
