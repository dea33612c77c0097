"""Pieces of a sediment map and averaged soundings: what theorems of plane geometry and of means state of them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.terrain import SedimentMap, SedimentPatches, SedimentRegion, SedimentStrip
from insonify.scene.terrain.bathymetry_file import GridError, metres_per_degree, projected_position, read_grid
from insonify.scene.terrain.bathymetry_grid import PlacedGrid

SANDS = ("fine sand", "medium sand", "coarse sand")
RNG = np.random.default_rng(4)
PLACES = RNG.uniform(-12, 12, (2, 4000))


def region(corners):
    """A polygon."""
    return SedimentRegion(sediment="fine sand", corners=corners)


def rows_of(fractions, sediments=SANDS, seed=1, size=5.0, places=PLACES):
    """Number of the patch at some places."""
    return (
        SedimentMap(base=SedimentPatches(sediments=sediments, fractions=fractions, size=size))
        .build_cover(seed=seed)
        .lookup(*places)
    )


def lies(height, corner=(0.0, 0.0), step=(1.0, 1.0)):
    """Soundings as they lie."""
    return PlacedGrid(np.asarray(height, np.float32), corner, step, "elevations")


@given(st.integers(0, 2**32 - 1), st.integers(3, 9))
@settings(max_examples=30, deadline=None)
def test_triangles_of_a_fan_tile_their_polygon(seed, count):
    """Cut from one corner, a convex polygon is its triangles: each place in exactly one of them, none left out."""
    angle = np.sort(np.random.default_rng(seed).uniform(0, 2 * np.pi, count))
    corners = [(float(n), float(e)) for n, e in zip(10 * np.cos(angle), 10 * np.sin(angle), strict=True)]
    whole = region(corners).covers(*PLACES)
    fan = [region((corners[0], *corners[i : i + 2])).covers(*PLACES) for i in range(1, count - 1)]
    np.testing.assert_array_equal(np.sum(fan, axis=0), whole.astype(int))


def test_squares_side_by_side_share_no_place_and_leave_none():
    """Places on their common edges and corners belong to one of them: a lattice of 9 squares covers each place once."""
    squares = [
        region(((n, e), (n + 1, e), (n + 1, e + 1), (n, e + 1)))
        for n in (0.0, 1.0, 2.0) for e in (0.0, 1.0, 2.0)
    ]  # fmt: skip
    north, east = (axis.ravel() for axis in np.meshgrid(np.arange(0.25, 3, 0.25), np.arange(0.25, 3, 0.25)))
    np.testing.assert_array_equal(np.sum([square.covers(north, east) for square in squares], axis=0), 1)


@given(st.floats(-np.pi, np.pi), st.floats(-500, 500), st.floats(-500, 500))
@settings(max_examples=30, deadline=None)
def test_pieces_move_with_their_corners(turn, north, east):
    """Polygon, strip and places turned and shifted together: the same places are covered, but for their very edge."""
    c, s = np.cos(turn), np.sin(turn)

    def moved(n, e):
        return c * n - s * e + north, s * n + c * e + east

    corners = ((-8.0, -6.0), (9.0, -7.0), (1.0, 0.5), (7.0, 8.0), (-5.0, 6.0))
    ends = ((-7.0, -9.0), (6.0, 8.0))
    here = [region(corners), SedimentStrip(sediment="fine sand", start=ends[0], end=ends[1], width=3)]
    there = [
        region(tuple(moved(*corner) for corner in corners)),
        SedimentStrip(sediment="fine sand", start=moved(*ends[0]), end=moved(*ends[1]), width=3),
    ]
    for one, other in zip(here, there, strict=True):
        assert np.mean(one.covers(*PLACES) != other.covers(*moved(*PLACES))) <= 1 / 4000


def test_a_star_that_crosses_itself_has_a_hole():
    """Parity of edges: the pentagon in the middle of a pentagram lies outside, its points lie inside."""
    turn = 2 * np.pi * 2 * np.arange(5) / 5
    star = region([(float(10 * np.cos(a)), float(10 * np.sin(a))) for a in turn])
    assert not star.covers(np.array([0.0]), np.array([0.0]))[0]
    tip = 2 * np.pi * np.arange(5) / 5
    assert star.covers(8 * np.cos(tip), 8 * np.sin(tip)).all()


@pytest.mark.parametrize("fractions", [(2, 5, 3), (1, 1, 1), (0.01, 0.9, 0.3)])
def test_a_border_does_not_depend_on_what_lies_beyond_its_neighbours(fractions):
    """Two sediments taken together as one: the border to the third stays where it was, place by place."""
    a, b, c = fractions
    three = rows_of(fractions)
    np.testing.assert_array_equal(three >= 1, rows_of((a, b + c), SANDS[:2]) == 1)
    np.testing.assert_array_equal(three >= 2, rows_of((a + b, c), SANDS[:2]) == 1)


def test_a_larger_share_takes_from_its_neighbour_and_gives_nothing_away():
    """Shares of 10 to 90 per cent: ground that is the first sediment stays so."""
    before = np.zeros(PLACES.shape[1], bool)
    for share in (0.1, 0.3, 0.5, 0.7, 0.9):
        now = rows_of((share, 1 - share), SANDS[:2]) == 0
        assert np.all(now[before])
        before = now
    assert 0.8 < before.mean() < 1


def test_sediments_listed_backwards_are_the_same_mixture():
    """The order decides what borders on what; names change sides with their shares, and the middle stays as large."""
    far = np.random.default_rng(2).uniform(-3000, 3000, (2, 20_000))
    ahead, back = rows_of((2, 5, 3), places=far), rows_of((3, 5, 2), SANDS[::-1], places=far)
    for row in range(3):
        assert np.mean(ahead == row) == pytest.approx(np.mean(back == 2 - row), abs=0.03)


def test_patches_need_a_seed_to_be_themselves():
    """Another seed is another bed of the same shares: agreement is that of chance, 0.2^2 + 0.5^2 + 0.3^2."""
    far = np.random.default_rng(3).uniform(-3000, 3000, (2, 20_000))
    one, other = (rows_of((2, 5, 3), seed=seed, places=far) for seed in (1, 2))
    assert np.mean(one == other) == pytest.approx(0.38, abs=0.02)


def test_a_bed_of_one_sediment_is_that_everywhere():
    """No patches, nothing on top: row 0, whatever the seed and the lattice; shapes broadcast."""
    cover = SedimentMap(base="fine sand").build_cover(seed=3, scatterer_grid=ScattererGrid(heading=1.0))
    found = cover.lookup(np.zeros((3, 1)), np.arange(4.0))
    assert found.shape == (3, 4) and not found.any()
    assert [sediment.name for sediment in cover.sediments] == ["fine sand"]
    with pytest.raises(ValueError, match="north"):
        cover.lookup(np.nan, 0.0)


def test_a_strip_without_length_is_reported():
    """Both ends at one place: field and way out."""
    with pytest.raises(ValidationError, match="Give another position"):
        SedimentStrip(sediment="fine sand", start=(1, 2), end=(1, 2), width=3)


@pytest.mark.parametrize(("rows", "columns"), [(2, 2), (3, 1), (4, 5)])
def test_averaged_soundings_keep_a_plane_where_it_lies(rows, columns):
    """The mean of a plane over a square is its value in the middle, where the new node stands."""
    north, east = np.meshgrid(5 + 0.5 * np.arange(60), -3 + 2.0 * np.arange(40), indexing="ij")
    here = lies(-20 + 0.03 * north - 0.02 * east, (5.0, -3.0), (0.5, 2.0)).averaged(rows, columns)
    n, m = here.height.shape
    assert (n, m) == (60 // rows, 40 // columns) and here.step == (0.5 * rows, 2.0 * columns)
    at = np.meshgrid(here.corner[0] + here.step[0] * np.arange(n), here.corner[1] + here.step[1] * np.arange(m),
                     indexing="ij")  # fmt: skip
    np.testing.assert_allclose(here.height, -20 + 0.03 * at[0] - 0.02 * at[1], atol=1e-5)


def test_averaging_twice_is_averaging_at_once():
    """Pairs of pairs are fours: heights, corner and step."""
    full = lies(RNG.normal(-20, 1, (48, 32)), (1.0, 2.0))
    twice, once = full.averaged(2, 2).averaged(2, 2), full.averaged(4, 4)
    np.testing.assert_allclose(twice.height, once.height, atol=1e-5)
    assert twice.corner == once.corner and twice.step == once.step
    assert once.height.mean() == pytest.approx(full.height.mean(), abs=1e-4)
    assert full.averaged(1, 1) is full


def test_half_of_a_square_is_enough_and_less_is_a_hole():
    """Two of four soundings give their own mean; one of four gives none; a rest of rows is left out."""
    holes = np.full((5, 6), np.nan)
    holes[:2, :2] = [[1, np.nan], [np.nan, 3]]
    holes[:2, 2:4] = [[7, np.nan], [np.nan, np.nan]]
    holes[:2, 4:] = [[1, 2], [3, np.nan]]
    found = lies(holes).averaged(2, 2).height
    assert found.shape == (2, 3)
    np.testing.assert_allclose(found[0], [2, np.nan, 2])
    assert np.isnan(found[1]).all()


def test_degrees_of_latitude_add_up_to_the_quarter_meridian():
    """WGS 84: 10 001 965.7 m from the equator to the pole; south is as north, and no longitude is left at the pole."""
    latitude, half = np.linspace(0, 90, 9001), 0.005
    length = sum(metres_per_degree(float(at))[0] for at in latitude[:-1] + half) * 0.01
    assert length == pytest.approx(10_001_965.7, abs=1.0)
    assert metres_per_degree(-33.0) == metres_per_degree(33.0)
    assert metres_per_degree(90.0)[1] == pytest.approx(0, abs=1e-6)
    # A circle of latitude, by the reduced latitude: a cos(beta), tan(beta) = (1 - f) tan(latitude).
    beta = np.arctan((1 - 1 / 298.257223563) * np.tan(np.radians(50)))
    assert metres_per_degree(50.0)[1] == pytest.approx(np.radians(6378137.0 * np.cos(beta)), rel=1e-12)


def test_a_grid_without_a_place_on_earth_has_no_latitude(tmp_path):
    """A plain numpy grid: the message offers the origin instead, and names the field."""
    np.savez(tmp_path / "bed.npz", depth=np.full((3, 4), 20.0), north=np.arange(3.0), east=np.arange(4.0))
    found = read_grid(str(tmp_path / "bed.npz"))
    with pytest.raises(GridError, match="Give origin") as caught:
        projected_position(50.0, 8.0, found)
    assert caught.value.field == "latitude"


def test_rows_may_come_in_any_order_of_north_and_east(tmp_path):
    """Four ways to save one bed, from the south or the north and from the west or the east: one grid."""
    north, east = 10 + 2.0 * np.arange(5), -4 + 0.5 * np.arange(7)
    depth = RNG.uniform(18, 22, (5, 7))
    found = []
    for name, down, left in (("a", 1, 1), ("b", -1, 1), ("c", 1, -1), ("d", -1, -1)):
        path = tmp_path / f"{name}.npz"
        np.savez(path, depth=depth[::down, ::left], north=north[::down], east=east[::left])
        found.append(read_grid(str(path)))
    for grid in found:
        np.testing.assert_array_equal(grid.elevation, -depth.astype(np.float32))
        assert (grid.north, grid.east, grid.north_step, grid.east_step) == (10.0, -4.0, 2.0, 0.5)
