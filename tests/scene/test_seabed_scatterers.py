"""Facets of the seabed: where they lie, how they face, what they add up to, and the beds they are drawn on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from insonify.scattering.lambert import Lambert
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.boundary_law import infer_law_kind
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.scatterers import Scatterers
from insonify.scene.seabed import Seabed
from insonify.scene.seabed_law import SedimentLaw, sediment
from insonify.scene.seabed_scatterers import seabed_scatterers
from insonify.scene.terrain.relief import TerrainSample

FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": 0.3, "outer_scale": 20.0}
RIPPLES = {"kind": "ripples", "wavelength": 2.0, "height": 0.1}


def square(height, slope, side=40, cell=0.5):
    """Facets on an even grid of a surface given by its height and its gradient, both of north and east."""
    row = (np.arange(side) + 0.5) * cell
    place = np.stack(np.meshgrid(row, row, indexing="ij"), axis=-1).reshape(-1, 2)
    n = len(place)
    survey = TerrainSample(
        height(*place.T) + np.zeros(n), np.stack(np.broadcast_arrays(*slope(*place.T)), -1) * np.ones((n, 2))
    )
    ones = np.ones(n, complex)
    return seabed_scatterers(20.0, survey, Lambert(), place, np.full(n, cell**2), ones, np.arange(n, dtype=np.uint64))


@given(st.floats(-2, 2), st.floats(-2, 2))
@settings(max_examples=25, deadline=None)
def test_an_inclined_plane_has_the_area_and_the_normal_of_the_textbook(north, east):
    """A tilted by b: area A / cos b, normal at b from the vertical and square to the plane."""
    found = square(lambda n, e: north * (n - 10) / 20 + east * (e - 10) / 20, lambda n, e: (north / 20, east / 20))
    tilt = np.arctan(np.hypot(north, east) / 20)
    assert found.area.sum() == pytest.approx(400 / np.cos(tilt))
    np.testing.assert_allclose(np.arccos(np.minimum(-found.normal[:, 2], 1)), tilt, atol=1e-7)
    along = found.position - found.position[0]
    np.testing.assert_allclose(along @ found.normal[0], 0, atol=1e-9)


@given(st.integers(0, 2**31))
@settings(max_examples=15, deadline=None)
def test_facets_stand_for_their_ground_however_steep(seed):
    """Area times the normal's vertical part is that of the mean plane; normals have length one and look up."""
    a, b = np.random.default_rng(seed).uniform(0.2, 3, 2)
    found = square(lambda n, e: a * np.sin(n) * np.cos(b * e),
                   lambda n, e: (a * np.cos(n) * np.cos(b * e), -a * b * np.sin(n) * np.sin(b * e)))  # fmt: skip
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1)
    np.testing.assert_allclose(-found.area * found.normal[:, 2], 0.25)
    assert found.area.sum() > 400


def test_a_dome_of_facets_has_the_surface_of_its_cap():
    """A paraboloid h = 1 - r^2/4 over a disc of radius 2: 8 pi / 3 (2^1.5 - 1); within 0.5 %."""
    found = square(lambda n, e: 1 - ((n - 2) ** 2 + (e - 2) ** 2) / 4, lambda n, e: (-(n - 2) / 2, -(e - 2) / 2),
                   side=200, cell=0.02)  # fmt: skip
    over = np.hypot(*(found.position[:, :2] - 2).T) < 2
    # The surface of z = r^2 / 4 out to r: 8 pi / 3 ((1 + r^2 / 4)^1.5 - 1).
    assert found.area[over].sum() == pytest.approx(8 * np.pi / 3 * (2**1.5 - 1), rel=5e-3)
    assert found.position[over, 2].min() == pytest.approx(19, abs=1e-3)
    outwards = np.sum((found.position[:, :2] - 2) * found.normal[:, :2], axis=1)
    assert np.all(outwards[over] >= 0)


def test_land_and_holes_do_not_scatter():
    """Ground at or above the mean sea surface is no seabed; where the survey is silent there is none either."""
    found = square(lambda n, e: np.where(n < 5, np.nan, np.where(n > 15, 20.0, 0.0)), lambda n, e: (0 * n, 0 * e))
    assert len(found) == 800
    assert found.position[:, 0].min() > 5 and found.position[:, 0].max() < 15
    np.testing.assert_allclose(found.position[:, 2], 20)
    assert len(found.scatterer_id) == len(found.phase) == len(found.area) == 800


def test_columns_are_taken_together():
    """Rows of scatterers keep their columns side by side, by a slice or by a mask."""
    whole = square(lambda n, e: 0 * n, lambda n, e: (0 * n, 0 * e), side=10)
    mask = whole.position[:, 0] > 2
    part = whole.take(mask)
    np.testing.assert_array_equal(part.scatterer_id, whole.scatterer_id[mask])
    np.testing.assert_array_equal(part.position, whole.position[part.scatterer_id.astype(int)])
    np.testing.assert_array_equal(whole.take(slice(3, 7)).scatterer_id, [3, 4, 5, 6])
    assert part.object == "seabed" and part.law is whole.law


@pytest.mark.parametrize("column", ["normal", "area", "phase", "scatterer_id"])
def test_a_short_column_is_refused_by_its_name(column):
    """Each column in turn, with both lengths."""
    columns = {"position": np.zeros((4, 3)), "normal": np.zeros((4, 3)), "area": np.ones(4),
               "phase": np.ones(4, complex), "scatterer_id": np.arange(4, dtype=np.uint64)}  # fmt: skip
    columns[column] = columns[column][:3]
    with pytest.raises(ValueError, match=rf"Scatterers\.{column} has 3 rows; position has 4"):
        Scatterers("seabed", "seabed", PointTargetLaw(), **columns)


def bed(relief, **more):
    """The ground of a seabed."""
    return Seabed(depth=20.0, relief=relief, **more).completed(1, 100e3, 1500.0).terrain


@pytest.mark.parametrize("kinds", [[FRACTAL], [RIPPLES], [FRACTAL, RIPPLES]])
def test_the_ground_moves_with_its_lattice(kinds):
    """A lattice shifted and turned carries its ground along; ripples, given by the compass, are reported anew."""
    lattice = ScattererGrid(origin=(300.0, -80.0), heading=0.9)
    own = np.random.default_rng(4).uniform(-60, 60, (200, 2))
    there = lattice.to_world(*own.T)
    turned = [{**kind, "direction": 0.9} if kind is RIPPLES else kind for kind in kinds]
    here, moved = bed(kinds), bed(turned, scatterer_grid=lattice)
    np.testing.assert_allclose(moved.depth_at(*there.T), here.depth_at(*own.T), atol=1e-8)
    assert here.span == moved.span and here.heightmap_cell_size == moved.heightmap_cell_size


@given(st.floats(-6.28, 6.28), st.floats(-6.28, 6.28))
@settings(max_examples=20, deadline=None)
def test_regular_ripples_are_two_cosines_along_their_compass_direction(direction, heading):
    """(h/2) (cos psi + s cos 2 psi) with psi = 2 pi x / wavelength, whatever the heading of the lattice."""
    regular = {**RIPPLES, "irregularity": 0.0, "sharpness": 0.2, "direction": direction}
    ground = bed(regular, scatterer_grid=ScattererGrid(heading=heading))
    north, east = np.random.default_rng(6).uniform(-50, 50, (2, 60))
    psi = 2 * np.pi * (north * np.cos(direction) + east * np.sin(direction)) / 2.0
    np.testing.assert_allclose(
        ground.depth_at(north, east), 20 - 0.05 * (np.cos(psi) + 0.2 * np.cos(2 * psi)), atol=1e-9
    )


@pytest.mark.parametrize(("wavelength", "expected"), [(0.6, 0.6 / 2 / 8), (2.0, 0.125), (30.0, 0.5)])
def test_the_map_has_eight_cells_to_the_shortest_wave(wavelength, expected):
    """Ripples have a second harmonic of half their length; cells are no wider than half a metre."""
    cell = bed({**RIPPLES, "wavelength": wavelength}, cutoff_wavelength=0.1).heightmap_cell_size
    assert cell == pytest.approx(expected)


def test_a_bounce_off_many_roughnesses_loses_the_product():
    """Mean squares add up, so what is left multiplies: fractal and ripples together against each alone."""
    sine, zone = np.linspace(0.05, 0.6, 12), np.full(12, 5.0)
    fine, low = {**FRACTAL, "rms": 0.01}, {**RIPPLES, "height": 0.01}
    one, other, both = (bed(relief).roughness_reflection_factor(sine, 0.1, zone) for relief in (fine, low, [fine, low]))
    np.testing.assert_allclose(both, one * other, rtol=1e-9)
    assert other[-1] < 0.99 and one[-1] < 0.99


def test_the_mirror_of_a_bed_is_its_number_or_its_sediments():
    """A number for all angles; a sediment mirrors at most all, and all of it at grazing."""
    grazing = np.linspace(1e-4, np.pi / 2, 60)
    np.testing.assert_array_equal(Seabed(reflection=-0.4).reflection_coefficient(grazing), -0.4)
    hard = Seabed(reflection="medium sand").reflection_coefficient(grazing)
    assert hard.shape == (60,) and np.abs(hard).max() <= 1 + 1e-9
    assert abs(hard[0]) == pytest.approx(1, abs=1e-2) and abs(hard[-1]) < 0.6
    assert abs(Seabed(reflection="medium silt").reflection_coefficient(grazing)[-1]) < abs(hard[-1])


def test_a_law_is_known_by_its_numbers():
    """A strength is Lambert's, a sediment Jackson's, a wind the surface's; a law by name stays itself."""
    assert infer_law_kind({"strength_db": -27})["law"] == "lambert"
    assert infer_law_kind({"sediment": "medium silt"})["law"] == "jackson"
    assert infer_law_kind({"wind_speed": 5})["law"] == "apl-surface"
    named = {"law": "small-slope", "sediment": "medium silt"}
    assert infer_law_kind(named) is named
    assert infer_law_kind(None) is None
    assert Seabed(scattering=None).law(100e3, 1500.0) is None
    assert isinstance(Seabed(scattering={"strength_db": -27}).scattering, Lambert)


def test_a_law_is_made_once_for_all_pings():
    """The same sediment, frequency and water give the very same law; another water another one."""
    silt = SedimentLaw(sediment="medium silt")
    assert silt.at(1e5, 1500.0) is SedimentLaw(sediment="medium silt").at(1e5, 1500.0)
    assert silt.at(1e5, 1500.0) is not silt.at(1e5, 1490.0)


def test_a_sediment_may_be_a_grain_size_and_what_is_none_gets_the_nearest():
    """A number is a grain size between -1 and 9 phi; a misspelt name is reported with names."""
    assert sediment(1.5).name
    with pytest.raises(ValidationError, match="medium sand"):
        Seabed(reflection="medium sandd")
    with pytest.raises(ValidationError):
        SedimentLaw(sediment=9.5)
