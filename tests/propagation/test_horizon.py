"""Shadows told by the order of launch angles are those that rays meet when they are traced over the ground."""

import numpy as np
import pytest
from numpy.typing import NDArray

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation.families import image_depth
from insonify.propagation.fan import fan
from insonify.propagation.horizon import Horizon, horizon
from insonify.propagation.layers import column
from insonify.propagation.sight import ground_in_sight

Floats = NDArray[np.float64]

BED, SOURCE = 20.0, 9.0
RANGES = np.arange(2.0, 180.0, 0.45)


def rough(seed: int, height: float = 0.5) -> Floats:
    """Depth of a bed with hills of some metres' length [m], over RANGES."""
    random = np.random.default_rng(seed)
    waves = [
        height * length / 20 * np.cos(2 * np.pi * (RANGES / length + random.random())) for length in (31.0, 13.0, 5.0)
    ]
    return BED - 0.3 - np.sum(waves, axis=0) + random.normal(0, 0.02, RANGES.size)


def straight(family: str, reach: Floats, depth: Floats, water_depth: float = BED) -> Floats:
    """Launch angles from image sources [rad], + down."""
    rise = depth - image_depth(family, SOURCE, water_depth)
    return np.arctan2(rise, reach) * (-1) ** len(family.replace("D", ""))


def circle(gradient: float, reach: Floats, depth: Floats) -> Floats:
    """Launch angles in water of one gradient, 1500 m/s at the source: circles about the depth where c would be 0."""
    centre = SOURCE - 1500.0 / gradient
    along = (reach**2 + (depth - centre) ** 2 - (SOURCE - centre) ** 2) / (2 * reach)
    return np.arctan(along * gradient / 1500.0)


def traced_over(ground: Floats, launch: float, cell: int, gradient: float) -> bool:
    """Whether a traced ray stays above the ground of all cells before its own."""
    speeds = [1500.0 - gradient * SOURCE, 1500.0 + gradient * (25.0 - SOURCE)]
    layers = column(SoundSpeedProfile([0.0, 25.0], speeds), 25.0)
    ray = fan(layers, SOURCE, launch, farthest=float(RANGES[cell]), bounces=0, step=0.05)
    return bool(np.all(np.interp(RANGES[:cell], ray.range, ray.depth) <= ground[:cell] + 1e-6))


@pytest.mark.parametrize("gradient", [0.0, -0.5, 0.4, -1.2])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_sweep_sees_what_traced_rays_see(gradient: float, seed: int) -> None:
    """Direct rays, straight and bent down or up, over a rough bed: the same cells are hidden, ray by ray."""
    ground = rough(seed)
    launch = circle(gradient, RANGES, ground) if gradient else straight("D", RANGES, ground)
    seen = horizon(RANGES, launch)
    traced = [traced_over(ground, launch[cell], cell, gradient) for cell in range(RANGES.size)]
    np.testing.assert_array_equal(seen.visible, traced)
    assert 0.1 < seen.visible.mean() < 0.9


def test_straight_rays_make_the_classical_horizon() -> None:
    """A cell is seen iff no nearer cell stands at a higher elevation; the cutter is the highest of them."""
    ground = rough(3)
    elevation = np.arctan2(SOURCE - ground, RANGES)
    seen = horizon(RANGES, -elevation)
    nearer = np.concatenate([[-np.inf], np.maximum.accumulate(elevation)[:-1]])
    np.testing.assert_array_equal(seen.visible, elevation >= nearer)
    highest = [int(np.argmax(elevation[:cell])) for cell in range(1, RANGES.size)]
    hidden = ~seen.visible[1:]
    np.testing.assert_array_equal(seen.cutter[1:][hidden], np.array(highest)[hidden])
    assert (seen.cutter[seen.visible] == -1).all()


@pytest.mark.parametrize("family", ["D", "S", "BS", "SBS", "B", "SB", "BSB"])
@pytest.mark.parametrize("seed", [4, 5])
def test_the_last_segment_is_cut_by_what_stands_in_it(family: str, seed: int) -> None:
    """Every family over a rough bed, against the folded line from its image, cell by cell after its last bounce.

    Bottom bounces stand on the plane of the deepest ground, so that every cell has a ray of the family.
    """
    ground = rough(seed, height=1.5)
    plane = float(ground.max()) + 0.01
    image = image_depth(family, SOURCE, plane)
    launch = straight(family, RANGES, ground, plane)
    boundary = plane if family.endswith("B") else 0.0  # of the last bounce, where the line to the point is not folded
    share = (boundary - image) / (ground - image) if family != "D" else np.zeros(RANGES.size)
    bounce = np.full((len(family.replace("D", "")), RANGES.size), np.nan)
    bounce[-1:] = share * RANGES
    seen = horizon(RANGES, launch, family=family, bounce=None if family == "D" else bounce)
    for cell in range(RANGES.size):
        before = RANGES[:cell]
        line = image + before / RANGES[cell] * (ground[cell] - image)
        after = before > share[cell] * RANGES[cell]
        assert seen.visible[cell] == bool(np.all(line[after] <= ground[:cell][after] + 1e-12)), cell
    assert 0 < seen.visible.mean() < 1


def test_ground_before_the_bounce_does_not_cut_what_comes_after() -> None:
    """A wall between sonar and bounce point hides the bounce, not the last segment: told by `before` alone."""
    ranges = np.arange(1.0, 101.0)
    ground = np.full(100, 20.0)
    ground[29] = 12.0  # a wall at 30 m
    ground[89] = 18.0  # and the point that is looked at, at 90 m
    launch = straight("B", ranges, ground)
    share = (BED - image_depth("B", SOURCE, BED)) / (ground - image_depth("B", SOURCE, BED))
    bounce = (share * ranges)[None]
    last = horizon(ranges, launch, family="B", bounce=bounce)
    assert last.visible[89] and last.cutter[89] == -1
    direct = horizon(ranges, straight("D", ranges, ground))
    whole = horizon(ranges, launch, family="B", bounce=bounce, before=(direct,))
    assert not direct.visible[int(bounce[0, 89]) - 1]
    assert not whole.visible[89] and whole.cutter[89] == 29
    near = horizon(ranges[:29], launch[:29], family="B", bounce=bounce[:, :29], before=(_cut_to(direct, 29),))
    np.testing.assert_array_equal(near.visible, whole.visible[:29])


def _cut_to(seen: Horizon, cells: int) -> Horizon:
    return Horizon(seen.visible[:cells], seen.cutter[:cells])


def test_points_above_the_ground_have_horizons_of_their_own() -> None:
    """Places on the sea surface are hidden only by ground that stands above the sonar."""
    ranges, ground = np.arange(1.0, 101.0), np.full(100, 20.0)
    ground[49] = 6.0
    below = straight("D", ranges, ground)
    seen = horizon(ranges, below, points=straight("D", ranges, np.zeros(100)))
    assert seen.visible.all()
    ground[49] = 1.0
    seen = horizon(ranges, straight("D", ranges, ground), points=straight("D", ranges, np.zeros(100)))
    # above a wall top at (50, 1): the line from 9 m reaches the surface beyond 50 * 9 / 8 = 56.25 m
    np.testing.assert_array_equal(seen.visible, (ranges <= 50) | (ranges < 56.25))
    assert (seen.cutter[~seen.visible] == 49).all()


def test_where_no_ray_goes_nothing_is_seen_and_nothing_cut() -> None:
    """NaN hides its own cell and no other."""
    launch = straight("D", RANGES, np.full(RANGES.size, 20.0))
    launch[100:110] = np.nan
    seen = horizon(RANGES, launch)
    np.testing.assert_array_equal(~seen.visible, np.isnan(launch))
    assert (seen.cutter == -1).all()


def test_azimuths_are_swept_on_their_own() -> None:
    """A block of azimuths gives what each gives alone, and the sine of the angle what the angle gives."""
    launch = np.array([straight("D", RANGES, rough(seed)) for seed in range(6)]).reshape(2, 3, -1)
    together = horizon(RANGES, np.sin(launch))
    for place in np.ndindex(2, 3):
        alone = horizon(RANGES, launch[place])
        np.testing.assert_array_equal(together.visible[place], alone.visible)
        np.testing.assert_array_equal(together.cutter[place], alone.cutter)


def test_a_deeper_source_in_the_same_water_sees_less() -> None:
    """Nearer to the bed shadows are longer: over 20 rough beds the mean share of visible cells falls."""
    shares = []
    for source in (3.0, 12.0, 18.0):
        beds = (rough(seed) for seed in range(20))
        shares.append(np.mean([horizon(RANGES, np.arctan2(z - source, RANGES)).visible.mean() for z in beds]))
    assert shares[0] > shares[1] > shares[2]


@pytest.mark.parametrize(
    ("told", "advice"),
    [
        ({"ranges": [1.0, 1.0, 2.0]}, "ranges must be one list of increasing distances"),
        ({"launch": [0.1, 0.2]}, r"launch has shape \(2,\); give \(..., 3\)"),
        ({"points": [0.1, 0.2]}, r"points has shape \(2,\); give \(3,\)"),
        ({"family": "BB"}, "'BB' is not a path family"),
        ({"family": "B"}, "bounce is missing; paths B need"),
        ({"family": "BS", "bounce": np.ones((1, 3))}, r"bounce has shape \(1, 3\); give \(2, 3\)"),
        ({"before": (Horizon(np.ones(3, bool), np.full(3, -1)),)}, "bounce is missing"),
        ({"family": "S", "bounce": np.ones((1, 3)), "before": (Horizon(np.ones(3, bool), np.full(3, -1)),) * 2},
         "before tells of 2 bounces; paths S have 1"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(told: dict[str, object], advice: str) -> None:
    """What, and what to give instead."""
    given = {"ranges": [1.0, 2.0, 3.0], "launch": [0.3, 0.2, 0.1], **told}
    with pytest.raises(ValueError, match=advice):
        horizon(given.pop("ranges"), given.pop("launch"), **given)


def test_a_horizon_says_how_much_is_seen() -> None:
    """Cells and the share of them that is visible."""
    assert repr(horizon([1.0, 2.0, 3.0, 4.0], [0.4, 0.3, 0.5, 0.2])) == (
        "Horizon: 4 cells along each azimuth, 75% visible"
    )


THERMO = SoundSpeedProfile([0.0, 8.0, 14.0, 25.0], [1510.0, 1510.0, 1490.0, 1490.0])
CELLS = np.arange(3.0, 165.0, 1.5)
HILLS = 20.0 - 0.5 * np.cos(2 * np.pi * CELLS / 29.0) - 0.15 * np.cos(2 * np.pi * CELLS / 11.0)


def aimed(family: str, reach: float, depth: float, water_depth: float) -> float:
    """Launch angle of a path from 11 m to a point: bisection between traced rays, NaN where none gets there."""
    layers = column(THERMO, water_depth)
    down = family.startswith("B") or (family == "D" and depth > 11.0)
    angles = np.radians(np.geomspace(1.0, 88.0, 2500)) * (1 if down else -1)
    if family == "D":
        angles = np.radians(np.linspace(-12.0, 80.0, 900))
    count = len(family.replace("D", ""))

    def miss(launch: Floats) -> Floats:
        rays = fan(layers, 11.0, launch, farthest=reach, bounces=count, step=np.inf)
        last = rays.first[1:] - 1
        lands = (rays.range[last] >= reach) & (rays.bounces[last] == count)
        # a family that ends on the boundary itself meets it with its next bounce
        return np.where(lands, rays.depth[last], np.nan) - depth

    found = miss(angles)
    step = np.flatnonzero((found[:-1] * found[1:] <= 0) & (np.abs(np.diff(found)) < 5))
    if not step.size:
        return float("nan")
    low, high = angles[step[0]], angles[step[0] + 1]
    for _ in range(40):
        middle = (low + high) / 2
        here = miss(np.array([low, middle]))
        low, high = (low, middle) if here[0] * here[1] <= 0 else (middle, high)
    return float((low + high) / 2)


def clear(launch: float, bounces: int, reach: float, water_depth: float) -> tuple[bool, Floats]:
    """Whether a traced ray is above the hills after its last bounce, and where it bounced."""
    ray = fan(column(THERMO, water_depth), 11.0, launch, farthest=reach, bounces=bounces, step=0.02)
    hops = ray.range[np.flatnonzero(np.diff(ray.bounces)) + 1]
    between = (reach > CELLS) & ((hops[-1] if bounces else 0.0) < CELLS)
    return bool(np.all(np.interp(CELLS[between], ray.range, ray.depth) <= HILLS[between] + 1e-6)), hops


@pytest.mark.parametrize("family", ["D", "S"])
def test_a_thermocline_bends_the_shadows(family: str) -> None:
    """The last segment over hills, under a thermocline: what traced and aimed rays see, cell by cell."""
    seen = ground_in_sight(THERMO, source_depth=11.0, ranges=CELLS, ground=HILLS, families=(family,))[family]
    bounces = 0 if family == "D" else 1
    for cell in range(0, CELLS.size, 4):
        launch = aimed(family, CELLS[cell], HILLS[cell], 25.0)
        expected = np.isfinite(launch) and clear(launch, bounces, CELLS[cell], 25.0)[0]
        assert seen.visible[cell] == expected, cell


def test_bent_rays_look_over_hills_that_hide_from_straight_ones() -> None:
    """Under a thermocline direct rays come down more steeply, and end: more is seen near by, nothing beyond 162 m."""
    iso = SoundSpeedProfile([0.0, 25.0], [1500.0, 1500.0])
    bent, plain = (
        ground_in_sight(water, source_depth=11.0, ranges=CELLS, ground=HILLS, families=("D",))["D"].visible
        for water in (THERMO, iso)
    )
    assert bent[CELLS < 140].sum() > plain[CELLS < 140].sum() + 5
    flat = ground_in_sight(THERMO, source_depth=11.0, ranges=CELLS, ground=np.full(CELLS.size, 20.0), families=("D",))
    assert CELLS[flat["D"].visible].max() == pytest.approx(162.0, abs=1.5)


def test_a_bounce_is_seen_or_not_with_its_cell() -> None:
    """BS: uncut after the surface, and the cell of its bottom bounce seen by a direct ray."""
    plane = 21.5
    seen = ground_in_sight(
        THERMO, source_depth=11.0, ranges=CELLS, ground=HILLS, plane=plane, families=("D", "BS"),
    )  # fmt: skip
    differ = 0
    for cell in range(10, CELLS.size, 6):
        launch = aimed("BS", CELLS[cell], HILLS[cell], plane)
        last, hops = clear(launch, 2, CELLS[cell], plane)
        bounce_cell = int(np.argmin(np.abs(CELLS - hops[0])))
        up = clear(launch, 1, hops[1], plane)[0]
        differ += seen["BS"].visible[cell] != (last and up and bool(seen["D"].visible[bounce_cell]))
    assert differ <= 1  # a bounce between two cells may be given to either


def test_ground_in_sight_of_straight_rays_is_that_of_images() -> None:
    """In water of one speed the solver's angles give the horizon of the images, D, S and BS."""
    iso, plane = SoundSpeedProfile([0.0, 25.0], [1500.0, 1500.0]), 20.0
    seen = ground_in_sight(iso, source_depth=SOURCE, ranges=CELLS, ground=HILLS, plane=plane, families=("D", "S"))
    for family in ("D", "S"):
        expected = horizon(CELLS, straight(family, CELLS, HILLS), family=family)
        np.testing.assert_array_equal(seen[family].visible, expected.visible)
        np.testing.assert_array_equal(seen[family].cutter, expected.cutter)


def test_ground_below_the_water_that_is_known_is_refused() -> None:
    """The profile must reach the deepest hollow, and the sonar must swim above the plane."""
    for told, advice in (
        ({"ground": HILLS + 10}, "ends at 25 m; the water is 30"),
        ({"source_depth": 21.0}, "source_depth is 21 m"),
        ({"ground": HILLS[:5]}, r"ground has shape \(5,\)"),
        ({"families": ("D", "X")}, "'X' is not a path family"),
    ):
        given = {"source_depth": 11.0, "ranges": CELLS, "ground": HILLS, **told}
        with pytest.raises(ValueError, match=advice):
            ground_in_sight(THERMO, **given)
