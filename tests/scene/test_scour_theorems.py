"""Moats of any size: Steiner's volume, no edge anywhere, the same from every frame; the map of the bed among them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.scene import Scene
from insonify.scene.terrain.scour import Scour
from insonify.scene.terrain_map import TerrainMap

SIDE = st.floats(0.4, 3.0)


def moat(size, width, *, depth=0.1, corner=0.0, position=(0.0, 0.0), heading=0.0, lattice=None):
    """A scour as ground, evaluated at positions."""
    made = Scour(depth=depth, width=width, position=position, size=size, corner=corner, heading=heading)
    return made.build_relief(lattice or ScattererGrid())


def grid(reach, cell):
    """Middles of cells of a square about the origin."""
    axis = np.arange(-reach + cell / 2, reach, cell)
    return axis[:, None], axis[None, :]


@settings(max_examples=12)
@given(SIDE, SIDE, st.floats(0.3, 1.0), st.floats(0, 1))
def test_a_moat_outside_of_any_footprint_has_steiners_volume(length, breadth, width, round_part):
    """Perimeter w / 2 + 2 pi w^2 (1/4 - 1/pi^2), times the depth: what Steiner states of any convex outline; to 1 %."""
    corner = round_part * min(length, breadth) / 2
    ground = moat((length, breadth), width, corner=corner)
    reach = max(length, breadth) / 2 + width + 0.05
    north, east = grid(reach, cell := 0.01)
    dug = -ground.sample(north, east).height
    out_n = np.maximum(np.abs(north) - length / 2 + corner, 0)
    out_e = np.maximum(np.abs(east) - breadth / 2 + corner, 0)
    outside = np.hypot(out_n, out_e) > corner
    perimeter = 2 * (length + breadth) - (8 - 2 * np.pi) * corner
    expected = 0.1 * (perimeter * width / 2 + 2 * np.pi * width**2 * (0.25 - 1 / np.pi**2))
    assert dug[outside].sum() * cell**2 == pytest.approx(expected, rel=0.01)
    assert dug.max() <= 0.1 + 1e-9 and dug.min() >= 0


@settings(max_examples=25)
@given(SIDE, SIDE, st.floats(0.3, 1.0), st.floats(-3, 3), st.floats(-np.pi, np.pi), st.floats(-np.pi, np.pi))
def test_a_moat_is_where_it_is_whatever_the_frame(length, breadth, width, away, heading, turn):
    """Turned and moved with its places, and requested through a turned lattice: the same heights to a nanometre."""
    rng = np.random.default_rng(1)
    north, east = rng.uniform(-3, 3, (2, 200))
    plain = moat((length, breadth), width).sample(north, east).height
    c, s = np.cos(heading), np.sin(heading)
    n, e = away + c * north - s * east, 2 * away + s * north + c * east
    put = {"position": (away, 2 * away), "heading": heading}
    np.testing.assert_allclose(moat((length, breadth), width, **put).sample(n, e).height, plain, atol=1e-9)
    frame = ScattererGrid(origin=(5.0, -2.0), heading=turn)
    inside = frame.from_world(np.column_stack([n, e]))
    expected = moat((length, breadth), width, lattice=frame, **put).sample(inside[:, 0], inside[:, 1]).height
    np.testing.assert_allclose(expected, plain, atol=1e-9)


@settings(max_examples=15)
@given(SIDE, SIDE, st.floats(0.3, 1.0))
def test_no_wall_of_a_moat_is_steeper_than_a_cosine(length, breadth, width):
    """Slopes stay below pi depth / (2 width), of what is narrower below half of the body; heights rise by them."""
    ground = moat((length, breadth), width)
    rng = np.random.default_rng(2)
    north, east = rng.uniform(-4, 4, (2, 2000))
    found = ground.sample(north, east)
    narrow = min(width, length / 2, breadth / 2)
    steep = np.linalg.norm(found.slope, axis=-1)
    assert steep.max() <= np.pi / 2 * 0.1 / narrow * (1 + 1e-6)
    outside = (np.abs(north) > length / 2) | (np.abs(east) > breadth / 2)
    assert steep[outside].max() <= np.pi / 2 * 0.1 / width * (1 + 1e-6)
    step = 1e-4
    run = ground.sample(north + step, east).height - ground.sample(north - step, east).height
    off = np.abs(run / (2 * step) - found.slope[..., 0])
    assert np.quantile(off, 0.98) < 1e-4 and off.max() < np.pi * 0.1 / narrow


def test_moats_and_a_fractal_add_up():
    """Depths of a bed with relief and two scoured bodies: the relief's less what each moat alone digs."""
    fractal = {"kind": "power-law", "hurst": 0.8, "rms": 0.03}
    drums = [
        {"shape": "cylinder", "label": f"drum {k}", "position": (3.0 * k, 20.0), "length": 1.0, "diameter": 0.6,
         "scour": {"depth": 0.1, "width": 0.5}}
        for k in (0, 1)
    ]  # fmt: skip
    rng = np.random.default_rng(3)
    north, east = rng.uniform(-2, 5, 500), rng.uniform(18, 22, 500)

    def height(relief, targets):
        bed = Scene(seabed={"depth": 20.0, "relief": relief, "seed": 1}, targets=targets).seabed.terrain
        return bed.relief.height(north, east) if bed is not None else np.zeros(500)

    whole, bare = height([fractal], drums), height([fractal], [])
    np.testing.assert_allclose(whole, bare + sum(height([], [drum]) for drum in drums), atol=1e-9)
    assert np.ptp(whole - bare) > 0.08


@pytest.mark.parametrize(("north", "east", "heading"), [(0.0, 0.0, 0.0), (137.0, -52.0, 0.4), (-900.0, 640.0, 2.0)])
def test_the_quick_map_is_the_ground_wherever_it_lies(north, east, heading):
    """Ripples, a fractal and a moat in a lattice of any origin and axis: heights to 1 % of their rms, slopes to 3 %."""
    relief = [
        {"kind": "power-law", "hurst": 0.7, "rms": 0.04},
        {"kind": "ripples", "height": 0.05, "wavelength": 1.2},
        {"kind": "scour", "position": (north + 2.0, east + 3.0), "size": (1.5, 0.8), "depth": 0.15, "width": 0.6},
    ]
    frame = {"origin": (north, east), "heading": heading}
    bed = Scene(seabed={"depth": 20.0, "relief": relief, "scatterer_grid": frame, "seed": 4}).seabed.terrain
    kept = TerrainMap(bed)
    away = np.array([2.0, 3.0])
    c, s = np.cos(heading), np.sin(heading)
    there = np.array([c * away[0] + s * away[1], -s * away[0] + c * away[1]])  # of the moat, along the lattice
    tile = np.floor(there / (kept.cell * 64)).astype(int)
    (row,) = rows = kept.claim(tile[None])
    kept.synthesize(rows)
    node = np.arange(65)
    along, across = ((number * 64 + node) * kept.cell for number in tile)
    expected = bed.relief.resolved.sample_in_grid_axes(along[:, None], across[None, :])
    off = kept.nodes[row] - np.concatenate([expected.height[..., None], expected.slope], axis=-1)
    assert off[..., 0].std() < 0.01 * expected.height.std()
    assert off[..., 1:].std() < 0.03 * expected.slope.std()
