"""Surveyed grids as terrain: through their nodes, smooth between them, no echo where nothing was measured."""

import numpy as np
import pytest

from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.seabed import Seabed
from insonify.scene.terrain import BathymetryGrid, RoughnessCutoff
from insonify.validity import PhysicsWarning


def saved(tmp_path, depth, *, north=None, east=None, name="survey.npz", **more):
    """A numpy file of depths, cells of 1 m about 0, 0 unless given."""
    rows, columns = depth.shape
    north = np.arange(rows) - (rows - 1) / 2 if north is None else north
    east = np.arange(columns) - (columns - 1) / 2 if east is None else east
    np.savez(tmp_path / name, depth=depth, north=north, east=east, **more)
    return {"kind": "grid", "file": str(tmp_path / name), "origin": (0.0, 0.0)}


def hilly(rows=41, columns=51):
    """Depths of about 20 m with waves of 15 m."""
    north, east = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    return 20 + 0.5 * np.sin(2 * np.pi * north / 15) * np.cos(2 * np.pi * east / 15)


def test_the_ground_passes_through_the_nodes(tmp_path):
    """Every node of the file, to 10 um of single precision; the mean plane is the mean depth."""
    seabed = Seabed(relief=saved(tmp_path, hilly()))
    north, east = np.meshgrid(np.arange(41) - 20.0, np.arange(51) - 25.0, indexing="ij")
    np.testing.assert_allclose(seabed.terrain.depth_at(north, east), hilly(), atol=1e-5)
    assert seabed.depth == round(float(hilly().mean()), 2)


def test_a_slope_stays_a_slope_and_a_wave_nearly_a_wave(tmp_path):
    """A plane is reproduced exactly; a wave of 15 cells within 1 % of its height between the nodes."""
    north, east = np.meshgrid(np.arange(41.0), np.arange(51.0), indexing="ij")
    plane = Seabed(relief=saved(tmp_path, 20 + 0.1 * north - 0.05 * east, name="plane.npz")).terrain
    at = np.random.default_rng(1).uniform(-19, 19, (2, 500))
    found = plane.relief.sample(*at)
    np.testing.assert_allclose(found.slope, np.tile([-0.1, 0.05], (500, 1)), atol=1e-5)
    np.testing.assert_allclose(plane.depth_at(*at), 20 + 0.1 * (at[0] + 20) - 0.05 * (at[1] + 25), atol=1e-5)
    waves = Seabed(relief=saved(tmp_path, hilly())).terrain
    expected = 20 + 0.5 * np.sin(2 * np.pi * (at[0] + 20) / 15) * np.cos(2 * np.pi * (at[1] + 25) / 15)
    assert np.max(np.abs(waves.depth_at(*at) - expected)) < 0.005


def test_the_gradient_is_exact_and_does_not_jump_at_cell_edges(tmp_path):
    """Slopes are the derivative of the height, and equal on both sides of rows and columns of nodes."""
    ground = Seabed(relief=saved(tmp_path, hilly())).terrain.relief
    at = np.random.default_rng(2).uniform(-18, 18, (2, 400))
    step = 1e-3
    rise = [(ground.height(at[0] + step, at[1]) - ground.height(at[0] - step, at[1])) / (2 * step),
            (ground.height(at[0], at[1] + step) - ground.height(at[0], at[1] - step)) / (2 * step)]  # fmt: skip
    np.testing.assert_allclose(ground.slope(*at), np.stack(rise, axis=-1), atol=2e-5)
    edge = np.round(at[0])
    for axis in ((1e-9, 0.0), (0.0, 1e-9)):
        place = (edge, at[1]) if axis[0] else (at[1], edge)
        sides = [ground.slope(place[0] + s * axis[0], place[1] + s * axis[1]) for s in (-1, 1)]
        np.testing.assert_allclose(*sides, atol=1e-6)


def test_a_hole_and_the_scene_beyond_stay_unknown(tmp_path):
    """One missing node takes its four cells; outside of the grid nothing is known; all else is."""
    depth = hilly()
    depth[20, 25] = np.nan
    bed = Seabed(relief=saved(tmp_path, depth)).terrain
    at = np.array([[0.5, 0.5], [-0.5, 0.9], [0.0, 0.0], [1.5, 0.5], [0.5, -1.5], [20.1, 0.0], [0.0, -25.1]])
    unknown = np.isnan(bed.depth_at(at[:, 0], at[:, 1]))
    np.testing.assert_array_equal(unknown, [True, True, True, False, False, True, True])
    assert np.isfinite(bed.relief.slope([1.5], [0.5])).all()


def test_a_grid_finer_than_the_split_is_averaged_to_it(tmp_path):
    """Waves below the split leave the ground: checkered cells of 10 cm vanish at 0.5 m, and stay at 0.2 m."""
    rows, columns = np.indices((100, 100))
    rough = 20 + 0.2 * ((rows + columns) % 2) + 0.01 * rows
    axis = 0.1 * np.arange(100)
    grid = BathymetryGrid(**{**saved(tmp_path, rough, north=axis, east=axis), "origin": None})
    assert grid.cell == pytest.approx(0.1)
    at = np.random.default_rng(3).uniform(-4, 4, (2, 300))
    smooth = grid.build_relief(cutoff=RoughnessCutoff(wavelength=0.5), mean_depth=20.0)
    assert np.std(smooth.sample(*at).slope[:, 1]) < 1e-4 and np.allclose(
        smooth.sample(*at).slope[:, 0], -0.1, atol=2e-3
    )
    assert (
        np.std(grid.build_relief(cutoff=RoughnessCutoff(wavelength=0.2), mean_depth=20.0).sample(*at).slope[:, 1]) > 0.5
    )


def test_the_scene_stands_where_its_origin_is_reported(tmp_path):
    """The origin given in the file's coordinates is the scene's north 0, east 0; else the middle of what is known."""
    north, east = 7_000_000 + np.arange(41.0), 600_000 + np.arange(51.0)
    relief = saved(tmp_path, hilly(), north=north, east=east)
    terrain = Seabed(relief={**relief, "origin": (7_000_010.0, 600_005.0)}).terrain
    assert terrain.depth_at(0.0, 0.0) == pytest.approx(hilly()[10, 5], abs=1e-5)
    assert terrain.depth_at(3.0, -2.0) == pytest.approx(hilly()[13, 3], abs=1e-5)
    middle = Seabed(relief={**relief, "origin": None}).terrain
    assert middle.depth_at(0.0, 0.0) == pytest.approx(hilly()[20, 25], abs=1e-5)


def test_the_tide_stands_over_every_sounding(tmp_path):
    """Two metres of tide: 2 m deeper everywhere."""
    relief = saved(tmp_path, hilly())
    low, high = (Seabed(relief={**relief, "tide": tide}).terrain.depth_at(3.3, 4.4) for tide in (0.0, 2.0))
    assert high - low == pytest.approx(2.0, abs=1e-5)


def test_a_survey_moves_with_its_world(tmp_path):
    """The lattice's frame carries the grid: the same bits of height, slopes turned with it."""
    relief = saved(tmp_path, hilly())
    along, across = np.random.default_rng(5).uniform(-15, 15, (2, 200))
    lattice = ScattererGrid(origin=(300.0, -40.0), heading=0.7)
    still, moved = Seabed(relief=relief).terrain, Seabed(relief=relief, scatterer_grid=lattice).terrain
    terrain = moved.relief.resolved
    np.testing.assert_array_equal(
        terrain.sample_in_grid_axes(along, across).height,
        still.relief.resolved.sample_in_grid_axes(along, across).height,
    )
    place = lattice.to_world(along, across)
    np.testing.assert_allclose(moved.depth_at(*place.T), still.depth_at(along, across), atol=1e-5)


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"depth": 5.0}, "depth", "not among the grid's depths"),
        ({"origin": (5000.0, 0.0)}, r"Seabed: relief\.origin", "more than 1 km outside"),
        ({"latitude": 0.1}, r"Seabed: relief\.longitude", "together"),
        ({"latitude": 0.1, "longitude": 0.1}, r"Seabed: relief\.origin", "one origin"),
        ({"sha256": "0" * 64}, r"Seabed: relief\.sha256", "the file has changed"),
        ({"positive": "up"}, r"Seabed: relief\.positive", "all above the sea"),
    ],
)
def test_what_does_not_fit_is_reported(tmp_path, change, field, words):
    """Field, value, what is wrong and the fix."""
    relief, seabed = saved(tmp_path, hilly()), {}
    for name, value in change.items():
        (seabed if name == "depth" else relief)[name] = value
    with pytest.raises(ValueError, match=f"(?s){field}.*{words}"):
        Seabed(relief=relief, **seabed)


def test_two_surveys_are_refused_and_a_power_law_that_repeats_one_is_reported(tmp_path):
    """Depths do not add up; waves longer than a few cells are there already."""
    relief = saved(tmp_path, hilly())
    with pytest.raises(ValueError, match=r"(?s)relief\.1.*merge the files"):
        Seabed(relief=[relief, relief])
    fine = {"kind": "power-law", "hurst": 0.7, "rms": 0.02, "outer_scale": 2.0}
    both = Seabed(relief=[relief, fine]).terrain
    assert 0.005 < np.std(both.depth_at(*np.random.default_rng(1).uniform(-9, 9, (2, 500))) - Seabed(
        relief=relief).terrain.depth_at(*np.random.default_rng(1).uniform(-9, 9, (2, 500)))) < 0.04  # fmt: skip
    with pytest.warns(PhysicsWarning, match="count twice"):
        Seabed(relief=[relief, {**fine, "outer_scale": 20.0}])


def test_a_seabed_with_a_survey_survives_being_written_and_read(tmp_path):
    """Depth and fingerprint are filled in once and stay."""
    seabed = Seabed(relief=saved(tmp_path, hilly()))
    again = Seabed.model_validate(seabed.model_dump(mode="json"))
    assert again == seabed and len(seabed.grid.sha256) == 64
    assert "51 x 41 cells of 1 x 1 m, depths, positive down, 19.5" in seabed.grid.description
