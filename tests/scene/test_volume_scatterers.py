"""Claims about the lattice of scatterers in the water, its layers and its patches."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean.scattering_layers import ScatteringPatch
from insonify.ocean.water import Water
from insonify.scene.seabed import Seabed
from insonify.scene.volume_scatterers import CELLS, WaterBlocks, patch_scatterers, water_scatterers

BED = Seabed(depth=20.0)
MURKY = Water(volume_strength_db=-60)


def block(level, along, across, down):
    """One block of cells."""
    return WaterBlocks(*(np.array([number]) for number in (level, along, across, down)))


def sides(cubes):
    """Lowest and highest corner of each block, (2, 3, n)."""
    low = np.array(cubes[1:]) * cubes.pitch * CELLS
    return np.array([low, low + cubes.pitch * CELLS])


@given(st.integers(1, 20), st.integers(-99, 99), st.integers(-99, 99), st.integers(0, 9))
def test_two_halves_fill_a_block(level, along, across, down):
    """The halves touch along one side and have the block's corners; their cells have half the volume."""
    whole = block(level, along, across, down)
    halves = whole.split()
    (low, high), (lows, highs) = sides(whole), sides(halves)
    np.testing.assert_allclose(lows.min(axis=1), low[:, 0])
    np.testing.assert_allclose(highs.max(axis=1), high[:, 0])
    np.testing.assert_allclose(halves.cell, np.repeat(whole.cell / 2, 2))
    assert np.prod(highs - lows, axis=0).sum() == pytest.approx(np.prod(high - low))


def test_each_cell_holds_one_point_and_the_block_its_volume():
    """64 points, one in each cell, that stand for s_v times its volume; keys all different."""
    cubes = block(16, 3, -5, 0)
    points = water_scatterers(MURKY, BED, cubes, 1)
    low = sides(cubes)[0]
    cell = np.floor((points.position - low[:, 0]) / cubes.pitch[:, 0]).astype(int)
    assert {tuple(row) for row in cell} == {tuple(row) for row in np.indices((CELLS,) * 3).reshape(3, -1).T}
    assert points.area.sum() == pytest.approx(1e-6 * np.prod(cubes.pitch * CELLS))
    assert len(np.unique(points.scatterer_id)) == CELLS**3


def test_layers_hold_what_is_between_their_depths():
    """Rows from 2 to 5 m and from 5 m to the bed: no point above 2 m, nor below the bed, and each its layer's s_v."""
    rows = Water(volume_strength_db=((2.0, -70.0), (5.0, -60.0)))
    np.testing.assert_allclose(rows.layers(20.0), [[2, 5, 1e-7], [5, 20, 1e-6]])
    cubes = block(24, 0, 0, 0)
    points = water_scatterers(rows, BED, cubes, 1)
    depth, per_volume = points.position[:, 2], points.area / cubes.cell[0]
    assert depth.min() > 2 and depth.max() < 20 and (depth < 5).any() and (depth > 5).any()
    np.testing.assert_allclose(per_volume, np.where(depth <= 5, 1e-7, 1e-6))


@pytest.mark.parametrize(("form", "share"), [("box", 1.0), ("ellipsoid", np.pi / 6)])
@pytest.mark.parametrize("even", [False, True])
def test_a_patch_holds_its_volume(form, share, even):
    """S_v times the volume of box or ellipsoid: within 1 % for some 10 000 points, and none outside it."""
    patch = ScatteringPatch(
        position=(5.0, 60.0, 12.0), size=(4.0, 2.0, 1.0), heading=0.5, form=form, volume_strength_db=-40
    )
    points = patch_scatterers(patch, BED, 1, 0.08, quadrature=even)
    assert points.area.sum() == pytest.approx(8 * share * 1e-4, rel=0.01)
    off = points.position - patch.position
    along = np.cos(0.5) * off[:, 0] + np.sin(0.5) * off[:, 1]
    assert np.abs(along).max() < 2 and np.abs(off[:, 2]).max() < 0.5
