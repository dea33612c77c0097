"""Rays traced arc by arc keep Snell's law, the closed forms of one layer, and the rules of mirrors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation.eigenray import eigenrays
from insonify.propagation.families import image_depth
from insonify.propagation.ray_fan import RayFan, bounce_ranges, trace_fan
from insonify.propagation.sound_speed_layers import SoundSpeedLayers, sound_speed_layers
from oracles.few_of import few_of

THERMO = SoundSpeedProfile([0.0, 8.0, 14.0, 20.0], [1510.0, 1510.0, 1490.0, 1490.0])
DUCT = SoundSpeedProfile([0.0, 11.0, 20.0], [1505.0, 1495.0, 1501.0])


def water(*knots: tuple[float, float]) -> SoundSpeedLayers:
    """A column from knots of depth and speed."""
    depth, speed = zip(*knots, strict=True)
    return sound_speed_layers(SoundSpeedProfile(depth, speed), depth[-1])


def end(rays: RayFan, ray: int = 0) -> tuple[float, float, float]:
    """Range, depth and time of a ray's last vertex."""
    last = rays.rows(ray).stop - 1
    return float(rays.range[last]), float(rays.depth[last]), float(rays.time[last])


columns = st.lists(st.tuples(st.floats(0.3, 5.0), st.floats(1460.0, 1540.0)), min_size=2, max_size=7).map(
    lambda layers: water(*[(sum(d for d, _ in layers[:k]), c) for k, (_, c) in enumerate(layers)])
)


@given(columns, st.floats(0.0, 1.0), st.floats(-1.5, 1.5))
def test_snells_law_is_kept(layers: SoundSpeedLayers, share: float, launch: float) -> None:
    """cos(theta) / c is the same at every vertex of a ray, in any column, through every bounce and turning point."""
    source = share * float(layers.depth[-1])
    rays = trace_fan(layers, source, launch, max_range=300.0, max_bounces=6)
    slowness = np.sqrt((1 - rays.sine) * (1 + rays.sine)) / np.interp(rays.depth, layers.depth, layers.speed)
    np.testing.assert_allclose(slowness * 1500, slowness[0] * 1500, rtol=0, atol=3e-9)
    assert rays.depth.min() >= -1e-9 and rays.depth.max() <= layers.depth[-1] + 1e-9
    assert np.all(np.diff(rays.range) >= 0) and np.all(np.diff(rays.time) >= 0)


@given(st.floats(-1.0, 1.0), st.floats(1.0, 19.0), st.integers(0, 6))
def test_straight_rays_end_where_images_require(launch: float, source: float, most: int) -> None:
    """In water of one speed the folded line from the image source, in slant range / c."""
    rays = trace_fan(water((0.0, 1500.0), (20.0, 1500.0)), source, launch, max_range=120.0, max_bounces=most)
    x, z, t = end(rays)
    family = rays.boundaries[0][: rays.bounces[-1]] or "D"
    rise = z - image_depth(family, source, 20.0)
    assert t == pytest.approx(np.hypot(x, rise) / 1500, abs=1e-13)
    assert abs(rise) == pytest.approx(x * abs(np.tan(launch)), abs=1e-9)


@given(st.floats(-0.5, 0.5), st.floats(-1.5, 1.5), st.floats(1.0, 300.0))
def test_one_gradient_takes_the_closed_time(launch: float, gradient: float, reach: float) -> None:
    """T = (2 / |g|) asinh(|g| d / (2 sqrt(c1 c2))) along a circle, turning point or not, to 1e-14 s."""
    layers = water((0.0, 1500.0 - 60 * gradient), (120.0, 1500.0 + 60 * gradient))
    x, z, t = end(trace_fan(layers, 60.0, launch, max_range=reach, max_bounces=0, step=0.7))
    speeds = 1500.0, 1500.0 + gradient * (z - 60.0)
    d, mean = np.hypot(x, z - 60.0), np.sqrt(speeds[0] * speeds[1])
    u = abs(gradient) * d / (2 * mean)
    assert t == pytest.approx(d / mean * (np.arcsinh(u) / u if u > 1e-6 else 1.0), abs=1e-13)


def test_a_refracted_ray_is_an_arc_of_a_circle() -> None:
    """Radius c / (|g| cos(theta)) about a centre where sound speed would be 0: all vertices, to a micrometre."""
    gradient, launch = -0.5, np.radians(-2.0)
    rays = trace_fan(water((0.0, 1510.0), (40.0, 1490.0)), 20.0, launch, max_range=150.0, max_bounces=0, step=1.0)
    radius = 1500.0 / (abs(gradient) * np.cos(launch))
    middle = 20.0 - 1500.0 / gradient
    along = np.sin(launch) / (np.cos(launch) / 1500.0 * gradient)
    distance = np.hypot(rays.range - along, rays.depth - middle)
    np.testing.assert_allclose(distance, radius, rtol=0, atol=1e-6)
    assert rays.turns[-1] == 1 and rays.sine[0] < 0 < rays.sine[-1]


@pytest.mark.parametrize(
    ("degrees", "milliseconds", "boundary"),
    [(-6.061, 100.466668, ""), (-4.720, 100.666349, "B"), (-12.302, 101.669384, "S"), (-12.838, 101.998208, "SB"),
     (17.775, 105.017329, "BS")],
)  # fmt: skip
def test_rays_of_a_thermocline_pass_the_point_of_their_eigenray(
    degrees: float, milliseconds: float, boundary: str
) -> None:
    """Reference table for thermo20, 150 m and 1 m above the bed: angles to 0.5e-3 deg, so 2 mm and 1 us."""
    rays = trace_fan(sound_speed_layers(THERMO, 20.0), 11.0, np.radians(degrees), max_range=150.0)
    x, z, t = end(rays)
    assert rays.boundaries == (boundary,) and x == 150.0
    assert z == pytest.approx(19.0, abs=2e-3)
    # the point stands off by dz, which costs |sin| dz / c
    assert t * 1e3 == pytest.approx(milliseconds, abs=0.6e-3)


def test_a_ray_goes_back_the_way_it_came() -> None:
    """Traced back from its end, a ray passes its source after the same time: turning points and bounces too."""
    layers = sound_speed_layers(DUCT, 20.0)
    for launch in np.radians([-20.0, -9.0, -2.0, 0.5, 3.0, 25.0]):
        rays = trace_fan(layers, 9.0, launch, max_range=170.0, max_bounces=9)
        _, depth, time = end(rays)
        _, again, back = end(trace_fan(layers, depth, -np.arcsin(rays.sine[-1]), max_range=170.0, max_bounces=9))
        assert again == pytest.approx(9.0, abs=1e-8)
        assert back == pytest.approx(time, abs=1e-13)


def test_a_step_changes_no_ray() -> None:
    """Vertices between are on the same arcs: ends alike to a picometre however many there are."""
    layers, launch = sound_speed_layers(DUCT, 20.0), np.radians(np.linspace(-30, 30, 41))
    fine, coarse = (trace_fan(layers, 9.0, launch, max_range=200.0, max_bounces=4, step=step) for step in (0.1, np.inf))
    for ray in range(len(fine)):
        assert end(fine, ray) == pytest.approx(end(coarse, ray), rel=1e-12)
    assert np.diff(fine.range).max() < 0.1 + 1e-9 or np.any(fine.depth == 0)
    assert fine.boundaries == coarse.boundaries


def test_horizontal_rays_bend_towards_slow_water() -> None:
    """Launched level: down where it is slower below, up where above, straight on in a channel's axis or still water."""
    down, up = water((0.0, 1510.0), (20.0, 1490.0)), water((0.0, 1490.0), (20.0, 1510.0))
    channel, still = water((0.0, 1510.0), (10.0, 1490.0), (20.0, 1505.0)), water((0.0, 1500.0), (20.0, 1500.0))
    ends = [end(trace_fan(layers, 10.0, 0.0, max_range=50.0))[1] for layers in (down, up, channel, still)]
    curved = 1500.0 - np.sqrt(1500.0**2 - 50.0**2)  # circles of c / |g| = 1500 m
    assert ends == [pytest.approx(10 + curved, abs=1e-4), pytest.approx(10 - curved, abs=1e-4), 10.0, 10.0]


def test_a_critical_ray_turns_at_the_knot() -> None:
    """Launched so that it is level just where the fast layer begins, it touches it and comes back."""
    layers = sound_speed_layers(THERMO, 20.0)
    launch = -np.arccos(1500.0 / 1510.0)
    below, above = (trace_fan(layers, 11.0, launch + way * 1e-6, max_range=180.0, max_bounces=0) for way in (1, -1))
    assert below.turns[-1] == 1 and below.depth.min() == pytest.approx(8.0, abs=1e-4)
    assert above.turns[-1] == 0 and above.depth[-1] < 8.0


@pytest.mark.parametrize(("depth", "launch"), [(0.0, -0.1), (20.0, 0.1), (0.0, 0.1), (20.0, -0.1), (8.0, 0.0)])
def test_sources_on_boundaries_and_knots_are_no_special_case(depth: float, launch: float) -> None:
    """A source on the surface or the bottom bounces at once, or leaves."""
    rays = trace_fan(sound_speed_layers(THERMO, 20.0), depth, launch, max_range=100.0, max_bounces=3)
    assert np.all(np.isfinite(rays.depth)) and rays.range[-1] == 100.0
    assert rays.bounces[1] == (1 if depth in (0.0, 20.0) and (launch > 0) == (depth > 0) else 0)


def test_a_vertical_ray_goes_up_and_down() -> None:
    """No range, and the time of the water column: the integral of dz / c, layer by layer."""
    rays = trace_fan(sound_speed_layers(THERMO, 20.0), 11.0, np.pi / 2, max_range=10.0, max_bounces=1)
    x, z, t = end(rays)
    through = 8 / 1510 + 6 * np.log(1510 / 1490) / 20 + 6 / 1490
    down = 3 * np.log(1500 / 1490) / 10 + 6 / 1490
    assert (x, z) == (pytest.approx(0.0, abs=1e-12), 0.0)
    assert t == pytest.approx(down + through, abs=1e-15)
    assert rays.boundaries == ("B",)  # the surface ends it


def test_pieces_have_the_family_of_the_boundaries_reached() -> None:
    """Between bounces: D, then S, then SB, joined end to end; bounce ranges are where they join."""
    rays = trace_fan(sound_speed_layers(THERMO, 20.0), 11.0, np.radians([-15.0, 15.0]), max_range=150.0, max_bounces=5)
    names = [family for family, _, _ in rays.segments()]
    assert names == ["D", "S", "SB", "D", "B", "BS"]
    pieces = [x for _, x, _ in rays.segments()]
    joins = bounce_ranges(sound_speed_layers(THERMO, 20.0), 11.0, np.sin(rays.launch_elevation), 3, max_range=150.0)
    assert [pieces[0][-1], pieces[1][-1]] == list(joins[:2, 0]) and pieces[1][0] == joins[0, 0]
    assert np.isnan(joins[2]).all()


@pytest.mark.parametrize(
    ("settings", "advice"),
    [
        ({"launch_elevation": 2.0}, "launch_elevation is 2 rad; give a finite number .rad., -1.5708 to 1.5708"),
        ({"launch_elevation": np.nan}, "launch_elevation is nan"),
        ({"source_depth": 21.0}, "source_depth is 21 m.* 0 to 20"),
        ({"max_range": np.inf}, "max_range is inf m.*such as 200"),
        ({"max_range": 0.0}, "max_range is 0 m"),
        ({"max_bounces": -1}, "max_bounces is -1; give 0 to"),
        ({"step": 0.0}, "step is 0 m"),
    ],
)
def test_a_fan_that_means_nothing_is_refused(settings: dict[str, float], advice: str) -> None:
    """Value, limits and the fix."""
    given = {"source_depth": 11.0, "launch_elevation": 0.1, "max_range": 100.0, **settings}
    with pytest.raises(ValueError, match=advice):
        trace_fan(sound_speed_layers(THERMO, 20.0), given.pop("source_depth"), given.pop("launch_elevation"), **given)


def test_a_fan_states_what_it_is() -> None:
    """Count, angles, range and what was reached."""
    rays = trace_fan(sound_speed_layers(THERMO, 20.0), 11.0, np.radians([-12.0, 0.0, 12.0]), max_range=100.0)
    assert repr(rays) == "Fan: 3 rays from -12.0 to 12.0 deg, to 100.0 m; paths D, B, S"
    assert len(trace_fan(sound_speed_layers(THERMO, 20.0), 11.0, [], max_range=100.0)) == 0


@given(columns, st.floats(0.02, 0.98), st.floats(0.02, 0.98), st.floats(2.0, 150.0))
def test_eigenrays_followed_from_the_source_arrive(
    layers: SoundSpeedLayers, up: float, share: float, reach: float
) -> None:
    """Launched at the angle of each eigenray, a traced ray passes its point after its delay, having reached its family.

    Two ways that share no code: a root of the distance over slowness, and arcs followed one by one. How far a ray
    misses grows with the spreading: |dz/dtheta| = 1 / (R A^2), times the rounding of the angle, taken as 1e-12 rad.
    """
    bed = layers.water_depth
    source, depth = up * bed, share * bed
    found = eigenrays(
        SoundSpeedProfile(layers.depth, layers.speed), water_depth=bed, source_depth=source, point_depth=depth,
        range=reach, families=("D", "S", "B", "SB", "BS"),
    )  # fmt: skip
    for row in np.flatnonzero(found.status == "ok"):
        name = found.family[row].replace("D", "")
        rays = trace_fan(layers, source, found.launch_angle[row], max_range=reach, max_bounces=len(name), step=np.inf)
        x, z, t = end(rays)
        tube = 1 / (reach * found.amplitude[row] ** 2)
        if abs(np.sin(found.launch_angle[row])) < 1e-6 or tube * 1e-12 > 1e-7 or x < reach:
            continue  # at the edge of a branch a rounding decides which side of a kink a ray takes
        assert (rays.boundaries[0], rays.turns[-1]) == (name, found.turning_points[row])
        assert z == pytest.approx(depth, abs=1e-7)
        assert t == pytest.approx(found.delay[row], abs=1e-10)


@few_of((0, 1, 2), "seed", range(8))
def test_no_eigenray_is_missing_between_two_rays_of_a_fan(seed: int) -> None:
    """Wherever two neighbours of a dense fan pass a point on either side, there is an eigenray between them.

    Neighbours with the same bounces and turns, and no further apart than a quarter of the water: the rest jumps.
    """
    random = np.random.default_rng(seed)
    knots = int(random.integers(2, 7))
    depths = np.concatenate([[0.0], np.cumsum(random.uniform(1, 6, knots - 1))])
    profile = SoundSpeedProfile(depths, random.uniform(1480, 1520, knots))
    bed = float(depths[-1])
    source, depth = random.uniform(0.05, 0.95, 2) * bed
    reach = random.uniform(5, 150)
    found = eigenrays(profile, water_depth=bed, source_depth=source, point_depth=depth, range=reach)
    launch = np.unique(np.concatenate([np.linspace(-1.4, 1.4, 1501), np.linspace(-0.5, 0.5, 6001)]))
    rays = trace_fan(sound_speed_layers(profile, bed), source, launch, max_range=reach, max_bounces=2, step=np.inf)
    last = rays.first_vertex[1:] - 1
    above = np.where(rays.range[last] == reach, rays.depth[last], np.nan) - depth
    kind = np.array([f"{boundary}{turns}" for boundary, turns in zip(rays.boundaries, rays.turns[last], strict=True)])
    between = (kind[1:] == kind[:-1]) & (above[1:] * above[:-1] < 0) & (np.abs(np.diff(above)) < bed / 4)
    for row in np.flatnonzero(between):
        here = (found.launch_angle >= launch[row]) & (found.launch_angle <= launch[row + 1])
        assert (rays.boundaries[row] or "D") in found.family[here], np.degrees(launch[row])
    assert between.sum() >= 3
