"""Tests of lattices of terrain: tiles that fit together, whatever is read first."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, spline_filter

from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain.composite_relief import build_terrain
from insonify.scene.terrain.power_law import PowerLaw
from insonify.scene.terrain.relief import Relief, TerrainSample
from insonify.scene.terrain_lattice import HALF_RESPONSE, NODES_PER_WAVE, TerrainLattice, window

SHAPE = 150, 90
FIRST = -70, 40
CUTOFF = 0.5


def _terrain(depth: float = 20.0) -> SeabedTerrain:
    """A seabed of fractal relief, of waves of half a metre and more."""
    relief = build_terrain([PowerLaw(hurst=0.8, rms=0.05)], seed=1)
    assert relief.shortest_wavelength == CUTOFF
    return SeabedTerrain(depth, relief)


class _Halfplane(Relief):
    """A slope that is known to the north of 3 m only."""

    def sample(self, north: object, east: object) -> TerrainSample:
        """Height and gradient; NaN to the south."""
        x, y = np.broadcast_arrays(north, east)
        slope = np.stack([np.full(x.shape, 0.1), np.full(x.shape, 0.05)], axis=-1)
        unknown = np.asarray(x < 3.0)
        return TerrainSample(np.where(unknown, np.nan, 0.1 * x + 0.05 * y), np.where(unknown[..., None], np.nan, slope))


def _nodes(wavelength: float, margin: int = 0) -> tuple[np.ndarray, np.ndarray]:
    step = wavelength / NODES_PER_WAVE
    return tuple(
        (np.arange(first - margin, first + count + margin)) * step for first, count in zip(FIRST, SHAPE, strict=True)
    )


def test_depth_is_that_of_the_terrain_at_each_node_across_tiles() -> None:
    """Several tiles, of negative and positive numbers, to the bit; again when they are kept."""
    terrain = _terrain()
    wavelength = terrain.lattice.resolved_wavelength(0.7)
    north, east = _nodes(wavelength)
    for _ in range(2):
        depth = terrain.lattice.depth(wavelength, FIRST, SHAPE)
        np.testing.assert_array_equal(depth, terrain.depth_at(north[:, None], east[None, :]))


def test_filters_of_tiles_are_those_of_one_large_square() -> None:
    """Long waves and spline coefficients within a nanometre of those of the terrain far around, filtered at once."""
    terrain, margin = _terrain(), 80
    wavelength = terrain.lattice.resolved_wavelength(0.7)
    north, east = _nodes(wavelength, margin)
    inner = (slice(margin, -margin),) * 2
    depth, deviation = terrain.depth_at(north[:, None], east[None, :]), HALF_RESPONSE * NODES_PER_WAVE
    short = depth - gaussian_filter(depth, deviation, mode="nearest")
    smooth = depth - short + gaussian_filter(short, deviation, mode="nearest")
    found = terrain.lattice.long_waves(wavelength, FIRST, SHAPE)
    nodes = window(found.first, SHAPE)
    assert np.abs(found.depth[nodes] - smooth[inner]).max() < 1e-9
    assert np.abs(found.coefficients[nodes] - spline_filter(smooth, mode="mirror")[inner]).max() < 1e-9
    assert np.abs(found.depth[nodes] - terrain.lattice.depth(wavelength, FIRST, SHAPE)).max() > 1e-4


def test_a_lattice_that_resolves_all_waves_keeps_all() -> None:
    """Its long waves are its depths, to the bit."""
    terrain = _terrain()
    assert terrain.lattice.resolved_wavelength(0.3) == CUTOFF
    nodes = CUTOFF, FIRST, SHAPE
    found = terrain.lattice.long_waves(*nodes)
    np.testing.assert_array_equal(found.depth[window(found.first, SHAPE)], terrain.lattice.depth(*nodes))


def test_wavelengths_are_few_and_near_those_needed() -> None:
    """Sixteen an octave, from the terrain's shortest wave on."""
    lattice = _terrain().lattice
    needed = np.linspace(0.1, 4.0, 2000)
    found = np.array([lattice.resolved_wavelength(float(wave)) for wave in needed])
    assert np.abs(np.log2(found / np.maximum(needed, CUTOFF))).max() < 0.5 / 16 + 1e-9
    assert len(set(found.tolist())) == 3 * 16 + 1


def test_unknown_terrain_spoils_no_tile_next_to_it() -> None:
    """Nodes a few steps inside the known part have the slope's own filters."""
    lattice = TerrainLattice(20.0, _Halfplane(), 0.5)
    nodes = 1.0, (24, 0), (40, 40)  # from 3 m on: their tile begins in the unknown part
    depth, smooth = lattice.depth(*nodes), lattice.long_waves(*nodes)
    assert np.all(np.isfinite(depth)) and np.all(np.isfinite(smooth.coefficients))
    assert np.abs(smooth.depth[window(smooth.first, (40, 40))] - depth)[20:].max() < 0.01
    assert np.isnan(lattice.depth(1.0, (0, 0), (40, 40))[:24]).all()
    assert np.isnan(lattice.rms_slope(np.array([-50.0, 0.0]), 8.0))


def test_rms_slope_is_that_of_the_relief() -> None:
    """Within a tenth, on a square of many waves; the same for positions close together."""
    lattice, relief = _terrain().lattice, PowerLaw(hurst=0.8, rms=0.05)
    expected = np.sqrt(relief.slope_variance(2 * np.pi / CUTOFF) / 2)
    assert lattice.rms_slope(np.array([3.0, 5.0]), 64.0) == pytest.approx(expected, rel=0.1)
    assert lattice.rms_slope(np.array([3.1, 5.2]), 64.5) == lattice.rms_slope(np.array([3.0, 5.0]), 64.0)


def test_order_of_reading_changes_no_bit() -> None:
    """Windows are the same after others that share some of their tiles."""
    one, other = _terrain().lattice, _terrain().lattice
    wavelength = one.resolved_wavelength(0.7)
    other.long_waves(wavelength, (500, 500), (10, 10))
    other.depth(wavelength, (0, 0), (64, 64))
    for first, second in zip(
        one.long_waves(wavelength, FIRST, SHAPE), other.long_waves(wavelength, FIRST, SHAPE), strict=True
    ):
        np.testing.assert_array_equal(first, second)
