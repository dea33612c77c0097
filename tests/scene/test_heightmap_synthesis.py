"""Claims about heightmap tiles: near the exact terrain, joined, gaps kept, and the same in any order."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scene.heightmap_synthesis import MIN_NODES_PER_PITCH, HeightmapSynthesizer
from insonify.scene.seabed import Seabed
from insonify.scene.seabed_terrain import TILE_CELLS
from oracles.heightmap_tile import heightmap_tile
from scene.test_grid import hilly, saved

FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": 0.05}
RIPPLES = {"kind": "ripples", "wavelength": 2.0, "height": 0.1}
FAR = [(0, 0), (-1, 3), (7, -12), (400, -350)]


def bed(relief=FRACTAL, seed=1, **more):
    """Ground of a seabed at 20 m, split for 100 kHz."""
    return Seabed(depth=20.0, relief=relief, **more).completed(seed, 100e3, 1500.0).terrain


def drawn(ground, *numbers):
    """Some tiles as the pen draws them together, heights and slopes, shape (n, 65, 65, 3)."""
    tiles = np.full((len(numbers), TILE_CELLS + 1, TILE_CELLS + 1, 3), np.nan, np.float32)
    ground.heightmap_synthesizer.synthesize(np.arange(len(numbers)), np.array(numbers, np.int64), tiles)
    return tiles


@pytest.fixture(scope="module")
def fractal():
    """Fractal ground of 5 cm rms."""
    return bed()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_heights_are_the_exact_ones_to_a_tenth_of_a_millimetre(seed):
    """Relief of 5 cm rms, four tiles near and far: 0.1 mm rms against node by node, 0.5 mm at most anywhere."""
    ground = bed(seed=seed)
    off = np.array([ground.heightmap_synthesizer.heights(*tile) - heightmap_tile(ground, *tile) for tile in FAR])
    assert np.sqrt(np.mean(off**2)) < 1e-4 and np.abs(off).max() < 5e-4


def test_what_is_off_is_as_high_as_the_relief_is():
    """Filling in is linear: relief four times as high is drawn four times as far off, to single precision."""
    low, high = (bed({**FRACTAL, "rms": rms}) for rms in (0.05, 0.2))
    one, four = (ground.heightmap_synthesizer.heights(2, 3) - heightmap_tile(ground, 2, 3) for ground in (low, high))
    np.testing.assert_allclose(four, 4 * one, atol=2e-6)


def test_finer_cells_are_drawn_closer():
    """A map for twice the frequency has cells no larger, and its pen strays no farther from the exact ground."""
    coarse, fine = (
        Seabed(depth=20.0, relief=FRACTAL).completed(1, frequency, 1500.0).terrain for frequency in (50e3, 200e3)
    )
    assert fine.heightmap_cell_size <= coarse.heightmap_cell_size
    rms = [
        np.sqrt(np.mean((b.heightmap_synthesizer.heights(1, 1) - heightmap_tile(b, 1, 1)) ** 2)) for b in (coarse, fine)
    ]
    assert rms[1] < 1.5 * rms[0] < 2e-4


def test_octaves_on_every_node_are_exact(fractal):
    """Were every octave drawn on every node, heights would be exact to 2 um: cubics between are all that is off."""
    numbers, names = fractal.heightmap_synthesizer._octaves
    thin = HeightmapSynthesizer(fractal.heightmap_synthesizer.terrain, fractal.heightmap_synthesizer.cell)
    names = names.copy()
    names[:, 0] = 1
    thin.__dict__["_octaves"] = (numbers, names)
    np.testing.assert_allclose(thin.heights(-1, 3), heightmap_tile(fractal, -1, 3), atol=2e-6)
    assert np.abs(fractal.heightmap_synthesizer.heights(-1, 3) - heightmap_tile(fractal, -1, 3)).max() > 2e-5


def test_no_octave_is_drawn_on_nodes_too_few_for_it(fractal):
    """Four nodes to the pitch at least wherever nodes are left out; a step less would be twice as many as needed."""
    numbers, names = fractal.heightmap_synthesizer._octaves
    step, pitch = names[:, 0], numbers[:, 0]
    skipped = step > 1
    assert (
        skipped.any()
        and (pitch[skipped] / (step[skipped] * fractal.heightmap_cell_size) >= MIN_NODES_PER_PITCH * (1 - 1e-6)).all()
    )
    assert (np.diff(step) <= 0).all() and set(step.tolist()) <= {1, 2, 4, 8, 16}
    short = (step < 16) & (pitch / fractal.heightmap_cell_size >= MIN_NODES_PER_PITCH)
    assert (pitch[short] / (step[short] * fractal.heightmap_cell_size) < 2 * MIN_NODES_PER_PITCH * (1 + 1e-6)).all()


@given(st.permutations(range(6)), st.integers(1, 6))
@settings(max_examples=15, deadline=None)
def test_bits_of_a_tile_do_not_depend_on_the_others(order, together):
    """Drawn alone or with others, first or last, in any row: the same bits."""
    ground, numbers = bed(), [(0, 0), (0, 1), (-5, 2), (300, -7), (1, 0), (64, 64)]
    alone = {number: drawn(ground, number)[0] for number in numbers}
    requested = [numbers[k] for k in order][:together]
    for number, tile in zip(requested, drawn(ground, *requested), strict=True):
        np.testing.assert_array_equal(tile, alone[number])


def test_two_pens_of_one_ground_draw_the_same(fractal):
    """A bed settled anew, whose pen drew other tiles before, gives the same bits."""
    other = bed()
    other.heightmap_synthesizer.heights(9, 9)
    np.testing.assert_array_equal(
        other.heightmap_synthesizer.heights(1, -2), fractal.heightmap_synthesizer.heights(1, -2)
    )
    assert not np.array_equal(
        bed(seed=2).heightmap_synthesizer.heights(1, -2), fractal.heightmap_synthesizer.heights(1, -2)
    )


def test_only_the_rows_that_are_requested_are_written(fractal):
    """Other tiles in the same memory keep every bit: readers may be at them."""
    tiles = np.full((3, TILE_CELLS + 1, TILE_CELLS + 1, 3), 7.0, np.float32)
    fractal.heightmap_synthesizer.synthesize(np.array([1]), np.array([[0, 0], [4, 5], [0, 0]]), tiles)
    assert (tiles[[0, 2]] == 7).all()
    np.testing.assert_array_equal(tiles[1], drawn(fractal, (4, 5))[0])


@pytest.mark.parametrize("relief", [FRACTAL, RIPPLES, [FRACTAL, RIPPLES]], ids=["fractal", "ripples", "both"])
def test_neighbours_meet_in_height_and_slope(relief):
    """Common nodes of tiles side by side agree to 3 um and 1e-4: no cliff where a walk leaves one tile."""
    ground = bed(relief)
    here, north, east = drawn(ground, (2, 5), (3, 5), (2, 6))
    for mine, theirs in ((here[-1], north[0]), (here[:, -1], east[:, 0])):
        np.testing.assert_allclose(mine[:, 0], theirs[:, 0], atol=3e-6)
        np.testing.assert_allclose(mine[:, 1:], theirs[:, 1:], atol=1e-4)


def test_what_is_no_octave_is_drawn_node_by_node():
    """Ripples keep the height of their own law to single precision, alone and on top of fractal ground."""
    ripples, fractal, both = bed(RIPPLES), bed(), bed([FRACTAL, RIPPLES])
    np.testing.assert_allclose(ripples.heightmap_synthesizer.heights(2, 3), heightmap_tile(ripples, 2, 3), atol=1e-6)
    if both.heightmap_cell_size == fractal.heightmap_cell_size == ripples.heightmap_cell_size:
        added = both.heightmap_synthesizer.heights(2, 3) - heightmap_tile(both, 2, 3)
        assert np.sqrt(np.mean(added**2)) < 1e-4


def test_flat_ground_is_drawn_flat():
    """Relief of no height: zeros in height and slope on all nodes."""
    grounds = bed({**RIPPLES, "height": 0.0})
    if grounds is not None:
        assert not drawn(grounds, (0, 0), (3, -4)).any()


def test_surveyed_ground_is_drawn_through_its_soundings(tmp_path):
    """A grid of depths: the pen's heights are the survey's own to single precision, inside and beyond its edge."""
    ground = Seabed(relief=saved(tmp_path, hilly())).completed(1, 100e3, 1500.0).terrain
    side = TILE_CELLS * ground.heightmap_cell_size
    for along in (-1, 0, int(20 // side), int(30 // side)):
        np.testing.assert_allclose(
            ground.heightmap_synthesizer.heights(along, 0), heightmap_tile(ground, along, 0), atol=2e-6
        )


def test_gaps_of_a_survey_stay_gaps(tmp_path):
    """Nodes without a measurement have no height in the map either, and no others lose theirs."""
    holed = hilly()
    holed[15:26, 20:31] = np.nan
    ground = Seabed(relief=saved(tmp_path, holed)).completed(1, 100e3, 1500.0).terrain
    side = TILE_CELLS * ground.heightmap_cell_size
    gaps = 0
    for along in range(int(-8 // side), int(8 // side) + 1):
        exact, made = heightmap_tile(ground, along, 0), ground.heightmap_synthesizer.heights(along, 0)
        np.testing.assert_array_equal(np.isnan(made), np.isnan(exact))
        np.testing.assert_allclose(made, exact, atol=2e-6)
        gaps += int(np.isnan(exact).sum())
    assert gaps > 0


def test_slopes_are_what_heights_rise_by(fractal):
    """Trapezoid over slopes gives the rise of each row and column to 3 % of its range: one drawing, not two."""
    tile = drawn(fractal, (3, -2))[0].astype(float)
    for axis in (0, 1):
        height, slope = (np.moveaxis(tile[..., k], axis, 0) for k in (0, 1 + axis))
        rise = np.cumsum((slope[1:] + slope[:-1]) / 2 * fractal.heightmap_cell_size, axis=0)
        assert np.abs(rise - (height[1:] - height[0])).max() < 0.03 * np.ptp(height)
