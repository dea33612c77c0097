"""Ways off the planes of rough ground against images and least squares in double precision, point by point."""

import numpy as np
import pytest

from insonify.propagation.image_path_kernel import ImagePaths, TerrainFrame, paths_off_local_planes
from insonify.propagation.local_planes import _PATTERNS
from insonify.scene.plane_fit_samples import COARSE_PATTERN, FINE_PATTERN
from oracles.few_of import few_of
from oracles.maps import map_of, swell

SONAR, DEPTH, WAVELENGTH, LEAST = np.array([3.0, -2.0, 11.0]), 20.0, 0.015, 0.2
ROUGH = swell(1, rms=0.06, shortest_wavelength=6.0)


def ground_of(height=ROUGH):
    """A map of 96 m square."""
    return map_of(height, 0.25, first=(-3, -3), tiles=(6, 6))


def frame_of(north=0.0, east=0.0, heading=0.0):
    """The lattice's frame."""
    return TerrainFrame(north, east, np.cos(heading), np.sin(heading), DEPTH, WAVELENGTH, LEAST)


def points_about(seed, count):
    """Points above the bed, 10 to 40 m away."""
    rng = np.random.default_rng(seed)
    away, turn = rng.uniform(10, 40, count), rng.uniform(-np.pi, np.pi, count)
    return np.stack([3 + away * np.cos(turn), -2 + away * np.sin(turn), rng.uniform(13, 19, count)], axis=-1)


def followed(family, points, *, ground=None, frame=None, place=SONAR, moved=None, done=None):
    """The ways of one family; those that are done already keep what they have."""
    is_seabed_bounce, count = np.array([letter == "B" for letter in family]), len(points)
    m = len(family)
    made = ImagePaths(
        *(
            np.full(shape, np.nan)
            for shape in ((count,), (count, 3), (count, 3), (m, count, 3), (m, count), (m, count), (m, count))
        ),
        np.zeros(count, bool),
    )
    ground, done = ground or ground_of(), np.zeros(count, bool) if done is None else done
    moved = np.empty((m, 0, 2)) if moved is None else moved
    missing = ground.no_tiles()
    complete = paths_off_local_planes(
        place, points, is_seabed_bounce, moved, frame or frame_of(), _PATTERNS, ground.pages, missing, done, made
    )
    assert complete == done.all()
    return made, done, missing


def unfolded(place, point, planes):
    """Image after image, then the ray back through each plane: length, departure, bounces, parts and sines."""
    images, end, bounces = [place], point, []
    for anchor, normal in planes:
        images.append(images[-1] - 2 * np.dot(images[-1] - anchor, normal) * normal)
    for (anchor, normal), image in zip(planes[::-1], images[:0:-1], strict=True):
        along = image - end
        end = end + along * np.dot(anchor - end, normal) / np.dot(along, normal)
        bounces.insert(0, end)
    stops = np.array([place, *bounces, point])
    legs = np.diff(stops, axis=0)
    lengths = np.linalg.norm(legs, axis=1)
    ways = legs / lengths[:, None]
    sines = [abs(np.dot(way, normal)) for way, (_, normal) in zip(ways, planes, strict=False)]
    return lengths.sum(), ways[0], ways[-1], bounces, np.cumsum(lengths)[:-1] / lengths.sum(), sines


def plane_about(ground, bounce, bearing, length, part, sine, disc):
    """The plane of least squares about one bounce, over its Fresnel zone, and what is left of the ground."""
    width = np.sqrt(WAVELENGTH * length * part * (1 - part))
    long = max(min(width / sine, length * min(part, 1 - part)), width, LEAST)
    c, s = np.cos(bearing), np.sin(bearing)
    along, across = disc[:-1].T * [[long], [max(width, LEAST)]]
    height = ground.read(bounce[0] + along * c - across * s, bounce[1] + along * s + across * c)
    design = np.stack([np.ones(len(along)), along, across], axis=-1)
    level, rise, aside = np.linalg.lstsq(design, height, rcond=None)[0]
    normal = -np.array([rise * c - aside * s, rise * s + aside * c, 1.0])
    anchor = np.array([*bounce[:2], DEPTH - level])
    return (anchor, normal / np.linalg.norm(normal)), np.mean((height - design @ [level, rise, aside]) ** 2)


def closed_form(family, ground, point):
    """A way by the book: level planes, those of few samples about its bounces, those of many about the next."""
    bearing = np.arctan2(*(point - SONAR)[1::-1])
    planes = [(np.array([0, 0, DEPTH]), np.array([0, 0, -1.0])) if letter == "B" else
              (np.zeros(3), np.array([0, 0, 1.0])) for letter in family]  # fmt: skip
    left = [0.0] * len(family)
    for disc in (COARSE_PATTERN, FINE_PATTERN):
        length, _, _, bounces, parts, sines = unfolded(SONAR, point, planes)
        for k in (k for k, letter in enumerate(family) if letter == "B"):
            planes[k], left[k] = plane_about(ground, bounces[k], bearing, length, parts[k], sines[k], disc)
    return (*unfolded(SONAR, point, planes), left)


@few_of((0, 3), "family", ["B", "SB", "BS", "BSB"])
def test_ways_are_those_of_images_in_planes_of_least_squares(family):
    """60 points over ground of 6 cm rms: lengths to 20 um, bounces to a millimetre, directions to 1e-4.

    That is a thirtieth of a turn at 100 kHz: the samples' places are reported to a ten-thousandth of a cell of 25 cm.
    """
    ground, points = ground_of(), points_about(2, 60)
    made, done, missing = followed(family, points, ground=ground)
    assert done.all() and made.is_valid.all() and not missing.any()
    for n, point in enumerate(points):
        length, departure, arrival, bounces, parts, sines, left = closed_form(family, ground, point)
        assert made.length[n] == pytest.approx(length, abs=2e-5)
        np.testing.assert_allclose(made.departure[n], departure, atol=1e-4)
        np.testing.assert_allclose(made.arrival[n], arrival, atol=1e-4)
        np.testing.assert_allclose(made.bounce_position[:, n], bounces, atol=2e-3)
        np.testing.assert_allclose(made.fraction[:, n], parts, atol=1e-4)
        np.testing.assert_allclose(made.grazing_sine[:, n], sines, atol=1e-4)
        np.testing.assert_allclose(made.residual_variance[:, n], left, rtol=1e-2, atol=1e-8)
    level = unfolded(SONAR, points[0], [(np.array([0, 0, DEPTH]), np.array([0, 0, -1.0]))])[0]
    assert family != "B" or abs(made.length[0] - level) > 1e-4  # rough ground does move it


@pytest.mark.parametrize("count", [0, 1, 127, 128, 129, 300])
def test_blocks_and_company_change_no_bit(count):
    """Around the edges of a block: every third point alone, in another order, has its own bits."""
    points = points_about(3, count)
    every, *_ = followed("BS", points)
    some = np.random.default_rng(count).permutation(count)[: count // 3 + 1]
    few, *_ = followed("BS", points[some])
    for name in ("length", "departure", "arrival", "is_valid"):
        np.testing.assert_array_equal(getattr(few, name), getattr(every, name)[some])
    for name in ("bounce_position", "fraction", "grazing_sine", "residual_variance"):
        np.testing.assert_array_equal(getattr(few, name), getattr(every, name)[:, some])


def test_points_that_have_their_ways_are_not_touched():
    """Half of them done: their columns stay as they were, the others have the bits of all requested together."""
    points, done = points_about(4, 140), np.arange(140) % 2 == 0
    every, *_ = followed("B", points)
    made, after, _ = followed("B", points, done=done.copy())
    assert after.all() and np.isnan(made.length[done]).all() and np.isnan(made.bounce_position[:, done]).all()
    np.testing.assert_array_equal(made.length[~done], every.length[~done])
    np.testing.assert_array_equal(made.residual_variance[:, ~done], every.residual_variance[:, ~done])


def test_only_reads_of_a_missing_tile_are_deferred():
    """A hole in the map: those that are done have the bits of the whole map; requested again with it, all have."""
    points = points_about(5, 200)
    whole, *_ = followed("BSB", points)
    holed = map_of(ROUGH, 0.25, first=(-3, -3), tiles=(6, 6), missing=((0, -1),))
    made, done, unread = followed("BSB", points, ground=holed)
    assert 0 < done.sum() < 200
    assert holed.named(unread) == [[0, -1]]
    np.testing.assert_array_equal(made.length[done], whole.length[done])
    again, after, _ = followed("BSB", points, done=done.copy())
    assert after.all()
    np.testing.assert_array_equal(np.where(done, made.length, again.length), whole.length)


def test_a_scene_moved_and_turned_has_the_same_ways():
    """Frame, sonar and points by kilometres and 0.7 rad: lengths to 10 um, directions turned."""
    points, turn, shift = points_about(6, 100), 0.7, np.array([2500.0, -800.0, 0.0])
    c, s = np.cos(turn), np.sin(turn)
    spin = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    here, *_ = followed("BS", points)
    there, *_ = followed("BS", points @ spin.T + shift, frame=frame_of(*shift[:2], turn), place=spin @ SONAR + shift)
    np.testing.assert_allclose(there.length, here.length, atol=1e-5)
    np.testing.assert_allclose(there.departure, here.departure @ spin.T, atol=2e-5)
    np.testing.assert_allclose(there.bounce_position, here.bounce_position @ spin.T + shift, atol=5e-4)
    np.testing.assert_allclose(there.residual_variance, here.residual_variance, rtol=1e-2, atol=1e-8)


def test_port_is_starboard_in_a_mirror():
    """East for west of ground, sonar and points: the same lengths, to 10 um."""
    points, aside = points_about(7, 100), np.array([1.0, -1.0, 1.0])
    here, *_ = followed("BSB", points)
    there, *_ = followed("BSB", points * aside, ground=ground_of(lambda a, b: ROUGH(a, -b)), place=SONAR * aside)
    np.testing.assert_allclose(there.length, here.length, atol=1e-5)
    np.testing.assert_allclose(there.arrival, here.arrival * aside, atol=2e-5)


def test_ends_exchanged_have_one_way():
    """Sonar to point by BS, point to sonar by SB: planes are found twice only, so to 1e-4 of the length at most.

    One bounce is the same zone from either end: to 10 um.
    """
    points, ground = points_about(8, 60), ground_of()
    for family, off in (("B", 1e-5), ("BS", 1e-5), ("BSB", 1e-4 * 40)):
        out, *_ = followed(family, points, ground=ground)
        for n, point in enumerate(points):
            back, *_ = followed(family[::-1], SONAR[None], place=point, ground=ground)
            assert back.length[0] == pytest.approx(out.length[n], abs=off)
            if family != "BSB":
                np.testing.assert_allclose(back.departure[0], -out.arrival[n], atol=2e-5)


def test_ground_requested_elsewhere_is_ground_moved():
    """Zones moved by 4 m to the north: the ways of a world whose ground lies 4 m further south."""
    points = points_about(9, 80)
    moved = np.zeros((1, 80, 2))
    moved[..., 0] = 4.0
    there, *_ = followed("B", points, moved=moved)
    south, *_ = followed("B", points, ground=ground_of(lambda a, b: ROUGH(a + 4.0, b)))
    still, *_ = followed("B", points, moved=np.zeros((1, 80, 2)))
    plain, *_ = followed("B", points)
    np.testing.assert_allclose(there.length, south.length, atol=1e-5)
    np.testing.assert_array_equal(still.length, plain.length)
    assert np.abs(there.length - plain.length).max() > 1e-3


def test_a_point_below_the_plane_of_its_bounce_has_no_way():
    """The bed at 20 m: 0.3 m under it nothing arrives, wherever the ground is; the others are not disturbed."""
    points = points_about(10, 130)
    sunk = points.copy()
    sunk[::3, 2] = 20.3
    every, *_ = followed("B", points)
    made, done, _ = followed("B", sunk)
    assert done.all() and not made.is_valid[::3].any()
    np.testing.assert_array_equal(np.delete(made.is_valid, np.s_[::3]), np.delete(every.is_valid, np.s_[::3]))
    np.testing.assert_array_equal(np.delete(made.length, np.s_[::3]), np.delete(every.length, np.s_[::3]))
