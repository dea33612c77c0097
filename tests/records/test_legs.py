"""Legs and layouts: rows named, products taken, and columns that do not fit refused by name."""

from dataclasses import fields, replace

import numpy as np
import pytest

from insonify.propagation.image_sources import image_legs
from insonify.records.image import LONG_NAMES, image_dataset
from insonify.records.legs import SEABED_OCCLUDER, Legs, LegStatus, have_same_geometry, ray_name
from insonify.records.recording import COLUMNS, RecordingLayout, recording_dataset
from insonify.scene.scene import Scene
from insonify.simulator import build_simulator
from oracles.scenes import nominal, point


def legs(depth=19.5):
    """The five legs of the nominal scene to one point."""
    scenario = nominal(targets=[point(0, 150, depth)], paths={"contributions": ["target"]})
    simulator = build_simulator(scenario)
    return next(iter(simulator.engine.all_pairs(simulator.ping_geometry(0)))).transmit_legs


def layout(pings=3, channels=2, samples=4, **changes):
    """An empty recording's layout."""
    rows = {"position": np.zeros((pings, 3)), "attitude": np.ones((pings, 3))}
    held = {"time": np.arange(samples) * 1.0, "ping_time": np.arange(pings) * 1.0, "steer": np.zeros(channels)}
    return RecordingLayout(field="intensity", **{**held, **rows, **changes})


def test_a_family_is_named_once_and_its_further_rays_are_numbered():
    """D, D2, D3: the first of a family needs no number."""
    assert [ray_name("D", k) for k in range(3)] == ["D", "D2", "D3"]
    one = legs()
    assert one.ray_names == one.families == ("D", "S", "B", "SB", "BS")
    twice = replace(one, families=("D", "D", "S", "BS", "BS"), branch=(0, 1, 0, 0, 1))
    assert twice.ray_names == ("D", "D2", "S", "BS", "BS2")


def test_amplitude_is_the_product_of_its_causes():
    """Spreading, absorption, boundary and visibility, each of which can be read by itself."""
    one = legs()
    np.testing.assert_allclose(
        one.amplitude, one.spreading * one.absorption * one.reflection_coefficient * one.visibility
    )
    dark = replace(one, visibility=np.zeros_like(one.visibility))
    assert np.all(dark.amplitude == 0)


def test_a_caustic_turns_the_phase_and_not_the_level():
    """+90 degrees for each, in the project's time factor."""
    one = legs()
    turned = replace(one, caustic=np.full(one.delay.shape, 1j))
    np.testing.assert_allclose(turned.amplitude, 1j * one.amplitude)
    np.testing.assert_allclose(np.abs(turned.amplitude), np.abs(one.amplitude))


def test_length_is_speed_times_delay_in_water_of_one_speed():
    """And spreading is its inverse."""
    one = legs()
    np.testing.assert_allclose(one.length, 1500 * one.delay, rtol=1e-12)
    np.testing.assert_allclose(one.spreading * one.length, 1.0, rtol=1e-12)


@pytest.mark.parametrize(
    "name", ["delay", "length", "spreading", "reflection_coefficient", "caustics", "status", "occluder"]
)
def test_a_column_of_another_shape_is_refused_by_name(name):
    """The record checks what it is given at the door."""
    one = legs()
    short = "length" if name == "delay" else name  # the others are measured against delay
    with pytest.raises(ValueError, match=f"Legs.{short}"):
        replace(one, **{name: np.concatenate([getattr(one, name)] * 2, axis=-1)})


def test_a_row_without_a_branch_is_refused():
    """Every row states which of its family's rays it holds."""
    with pytest.raises(ValueError, match="branch has 4 rows; there are 5 families"):
        replace(legs(), branch=(0, 0, 0, 0))


def test_reasons_are_numbers_that_no_other_reason_has():
    """A status is stored as a byte; the ground as an occluder is no row of a target, and not nothing either."""
    assert len({int(reason) for reason in LegStatus}) == len(LegStatus) and min(LegStatus) == LegStatus.CLEAR == 0
    assert SEABED_OCCLUDER < -1
    assert {column.name for column in fields(Legs)} >= {"status", "occluder", "branch", "caustics"}


def test_image_legs_have_one_ray_each():
    """Straight rays have no branches and touch no caustic."""
    scenario = nominal(targets=[point(0, 150, 19.5)])
    simulator = build_simulator(scenario)
    points = next(iter(simulator.engine.all_pairs(simulator.ping_geometry(0)))).scatterers
    found = image_legs(Scene(), np.array([0.0, 0.0, 11.0]), points, ("D", "S"), 100e3)
    assert found.branch == (0, 0) and not found.caustics.any() and found.caustic is None


@pytest.mark.parametrize("name", ["position", "attitude", "logged_position", "logged_attitude", "side"])
def test_a_layout_of_unequal_rows_is_refused_by_name(name):
    """Poses have a row per ping and three columns, sides one per channel."""
    with pytest.raises(ValueError, match=f"RecordingLayout.{name} has shape"):
        layout(**{name: np.zeros((2, 2))})


def test_a_log_that_is_left_out_is_the_true_motion():
    """Recordings without a log have the true poses there, and no sides."""
    held = layout(position=np.arange(9.0).reshape(3, 3))
    np.testing.assert_array_equal(held.logged_position, held.position)
    np.testing.assert_array_equal(held.logged_attitude, held.attitude)
    np.testing.assert_array_equal(held.side, [0, 0])


def test_a_recording_of_some_pings_has_their_poses():
    """Columns over pings are cut with the sound; columns over channels are not."""
    held = layout(position=np.arange(9.0).reshape(3, 3), side=np.array([-1.0, 1.0]))
    part = recording_dataset(held, {"title": "x"}, np.ones((2, 2, 4)), np.array([2, 0]))
    np.testing.assert_array_equal(part["position"].values, held.position[[2, 0]])
    np.testing.assert_array_equal(part["ping"].values, [2, 0])
    np.testing.assert_array_equal(part["side"].values, [-1, 1])
    for name in COLUMNS:
        assert {"units", "long_name"} <= part[name].attrs.keys(), name


@pytest.mark.parametrize("column", ["length", "visibility", "arrival", "status", "occluder"])
def test_legs_have_the_same_geometry_as_long_as_they_share_its_columns(column):
    """A copy of any of its columns is another geometry; another reflection coefficient is not."""
    sent = legs()
    received = replace(sent, reflection_coefficient=-sent.reflection_coefficient)
    assert have_same_geometry(sent, received)
    assert not have_same_geometry(sent, replace(received, **{column: getattr(sent, column).copy()}))


@pytest.mark.parametrize("geometry", LONG_NAMES)
def test_an_image_states_what_its_axes_are(geometry):
    """Units and long names everywhere; geometry and gain among the attributes."""
    made = image_dataset(
        np.zeros((2, 5)), np.linspace(-2, 2, 5), np.array([0.0, 1.0]), geometry=geometry, gain="none",
        altitude=np.array([9.0, 9.5]), pings=np.array([0, 1]), attributes={"title": "line 3"},
    )  # fmt: skip
    assert made.attrs == {"geometry": geometry, "gain": "none", "title": "line 3"}
    for name in ("level_db", "across", "along", "altitude", "ping"):
        assert made[name].attrs["units"] and made[name].attrs["long_name"]
    assert "port negative" in made["across"].attrs["long_name"]


@pytest.mark.parametrize(("across", "along"), [(4, 2), (5, 3)])
def test_an_image_of_unequal_axes_is_refused(across, along):
    """The axis that does not fit is named."""
    with pytest.raises(ValueError, match="across has 4" if across == 4 else "along has 3"):
        image_dataset(
            np.zeros((2, 5)), np.zeros(across), np.zeros(along), geometry="slant", gain="none",
            altitude=np.zeros(2), pings=np.arange(2),
        )  # fmt: skip
