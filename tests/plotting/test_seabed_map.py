"""The map of a scenario's seabed shows the part that its echoes come from."""

import numpy as np
import pytest

from insonify.plotting import style
from insonify.plotting.scene_view import scene
from insonify.plotting.seabed_map import draw_seabed_map
from oracles.scenes import nominal, point

FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": 0.05}


def drawn(scenario):
    """The axes of a map."""
    axes = style.new_figure().add_subplot()
    draw_seabed_map(axes, scenario)
    return axes


def test_the_map_shows_the_ground_as_far_as_it_is_received():
    """180 m each way for a window of 240 ms, north up, each pixel the ground's depth at its middle."""
    scenario = nominal(seabed={"relief": FRACTAL}, track={"window": (0.0, 0.24)}, targets=[point(20.0, 50.0, 19.0)])
    axes = drawn(scenario)
    image = axes.images[0]
    np.testing.assert_allclose(image.get_extent(), (-180, 180, -180, 180))
    shown = np.asarray(image.get_array())
    ground = scenario.scene.seabed
    assert shown[400, 100] == pytest.approx(ground.depth_at(-180 + 400.5 * 0.6, -180 + 100.5 * 0.6), abs=1e-9)
    assert [text.get_text() for text in axes.texts] == ["point"]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("east [m]", "north [m]")


def test_a_target_whose_middle_is_outside_is_named_where_it_is_seen():
    """A quay 400 m long whose middle lies 100 m north of the map: named on its outline, inside the frame."""
    quay = {"shape": "box", "label": "quay", "position": (280.0, 60.0), "size": (400.0, 4.0, 3.0)}
    scenario = nominal(targets=[quay], track={"window": (0.0, 0.24)})
    axes = drawn(scenario)
    (name,) = (text for text in axes.texts if text.get_text() == "quay")
    east, north = name.xy
    assert axes.get_ylim()[0] <= north <= axes.get_ylim()[1] and north > 150
    assert east == pytest.approx(60.0, abs=2.01)


def test_a_hollow_target_is_drawn_by_its_own_footprint(tmp_path):
    """Two piers of one mesh, 4 m apart: the water between them is not covered, each pier is."""
    pier = "v {0} 0 0\nv {1} 0 0\nv {1} 2 0\nv {0} 2 0\nv {2} 1 -2\n"
    faces = "".join(f"f {a} {b} {c}\n" for k in (0, 5) for a, b, c in np.array(
        [(1, 3, 2), (1, 4, 3), (1, 2, 5), (2, 3, 5), (3, 4, 5), (4, 1, 5)]) + k)  # fmt: skip
    (tmp_path / "piers.obj").write_text(pier.format(0, 2, 1) + pier.format(6, 8, 7) + faces)
    mesh = {"shape": "mesh", "label": "piers", "file": str(tmp_path / "piers.obj"), "position": (20.0, 30.0)}
    (drawn_faces,) = drawn(nominal(targets=[mesh], track={"window": (0.0, 0.24)})).collections
    paths = drawn_faces.get_paths()
    corners = np.concatenate([path.vertices for path in paths])
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    assert not any(path.contains_point(middle) for path in paths)
    assert any(path.contains_point(corners.min(axis=0) + np.array([1.0, 0.9])) for path in paths)


def test_ground_that_was_not_surveyed_is_left_grey(tmp_path):
    """Holes are NaN on the map, and the title states what the file is."""
    axis = np.arange(-200.0, 201.0, 2.0)
    depth = 20 + 0.005 * axis[:, None] + 0 * axis
    depth[:, axis > 100] = np.nan
    np.savez(tmp_path / "survey.npz", depth=depth, north=axis, east=axis)
    relief = {"kind": "grid", "file": str(tmp_path / "survey.npz"), "origin": (0.0, 0.0)}
    scenario = nominal(seabed={"relief": relief}, track={"window": (0.0, 0.24)})
    shown = np.ma.filled(drawn(scenario).images[0].get_array().astype(float), np.nan)
    assert np.isnan(shown[:, -100:]).all() and np.isfinite(shown[:, :400]).all()
    assert "depths, positive down" in drawn(scenario).get_title()


def test_a_flat_bed_has_one_depth_and_the_picture_is_written(tmp_path):
    """No relief: 20 m everywhere."""
    scenario = nominal()
    assert any("flat bed, 20 m deep" in text.get_text() for text in drawn(scenario).texts)
    assert scene(scenario, tmp_path / "bed.png").stat().st_size > 1000
