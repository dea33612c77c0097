"""What may be made of a recording whose receiver has its own platform, and what a moving pulse's middle is."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from insonify.processing import (
    beam_recording,
    compressed_recording,
    interferometric_bathymetry,
    multibeam_soundings,
    synthetic_aperture_image,
)
from insonify.processing.recorded_geometry import (
    body_to_world,
    is_bistatic,
    recorded_element_positions,
    recorded_poses,
    recorded_transmitter_position,
)
from insonify.sonar.pulse import Pulse

C, F, RATE = 1500.0, 100e3, 40e3
PINGS, ELEMENTS = 9, 2


def held(two=True, speed=0.0, half=0.0, point=(0.0, 20.0, 5.0), rate=0.2):
    """An echo of a point, received by two elements, by a float64 sum.

    The receiver's platform 12 m ahead if there are two.

    Both go north; each ray leaves and arrives where its end is at the middle of its pulse, `half` after its start.
    """
    time = np.arange(0.015, 0.045, 1 / RATE)
    run = speed * rate * np.arange(PINGS)
    sends = np.stack([run - run.mean(), np.zeros(PINGS), np.zeros(PINGS)], axis=1)
    receiver = sends + ([12.0, 0.0, 1.0] if two else [0.0, 0.0, 0.0])
    arm = np.array([[0.3, 0.0, 0.0], [-0.3, 0.0, 0.0]])
    go = np.array([speed, 0.0, 0.0])
    series = np.zeros((PINGS, ELEMENTS, len(time)), complex)
    for ping in range(PINGS):
        out = np.linalg.norm(sends[ping] + half * go - point) / C
        for row in range(ELEMENTS):
            back = out
            for _ in range(20):  # the receiver goes on while the sound travels
                there = receiver[ping] + arm[row] + (out + back + half) * go
                back = np.linalg.norm(there - point) / C
            series[ping, row] = np.exp(-2j * np.pi * F * (out + back)) * np.sinc((time - out - back) * 12e3)
    columns = {"position": sends, "attitude": np.zeros((PINGS, 3))}
    if two:
        columns |= {"receiver_position": receiver, "receiver_attitude": np.zeros((PINGS, 3))}
    variables = {name: (("ping", "axis"), values) for name, values in columns.items()}
    variables["pressure"] = (("ping", "channel", "time"), series)
    place = {
        "element_position": (("channel", "axis"), arm),
        "time": time,
        "ping_time": ("ping", rate * np.arange(PINGS)),
    }
    return xr.Dataset(variables, {**place, "side": ("channel", np.ones(ELEMENTS))}, {"centre_frequency": F})


@pytest.mark.parametrize(("made", "message"), [
    (lambda r: beam_recording(r, [0.0]), "receiver_position"),
    (lambda r: multibeam_soundings(r, [0.0, 0.1]), "synthetic_aperture_image"),
])  # fmt: skip
def test_what_needs_one_platform_is_refused_with_another_way(made, message):
    """Ranges from delays, and focus that follows the range: with what may be done instead."""
    with pytest.raises(ValueError, match=message):
        made(held())


def test_depths_by_phase_are_refused_between_two_platforms():
    """An echo's time gives an ellipse there."""
    upright = held().assign_coords(element_position=(("channel", "axis"), [[0, 0, -0.01], [0, 0, 0.01]]))
    with pytest.raises(ValueError, match="ellipse"):
        interferometric_bathymetry(upright, 10.0)


def test_beams_of_a_fixed_focus_are_made_of_any_recording():
    """Far or at a range from the receiver: the same with one platform as with two, for the elements are the same."""
    two = held()
    one = two.drop_vars(["receiver_position", "receiver_attitude"])
    for focus in ("far", 20.0):
        here, there = (beam_recording(r, [0.5], focus=focus)["pressure"].values for r in (two, one))
        np.testing.assert_array_equal(here, there)


def test_each_end_is_where_its_own_platform_is():
    """Elements hang on the receiver's; the transmitter is at its own reference point unless it is reported."""
    two = held()
    assert is_bistatic(two) and not is_bistatic(held(two=False))
    place, _ = recorded_poses(two, receiver=True)
    np.testing.assert_array_equal(place, two["receiver_position"].values)
    np.testing.assert_array_equal(recorded_poses(two)[0], two["position"].values)
    np.testing.assert_array_equal(recorded_transmitter_position(two), np.zeros(3))
    np.testing.assert_allclose(
        recorded_transmitter_position(held(two=False)), recorded_element_positions(two).mean(axis=0)
    )
    np.testing.assert_array_equal(recorded_transmitter_position(two, [1.0, 2, 3]), [1, 2, 3])


def test_a_log_of_the_receiver_is_taken_before_the_truth():
    """The true poses are available."""
    two = held()
    for name in ("position", "attitude", "receiver_position", "receiver_attitude"):
        two[f"logged_{name}"] = two[name] + 0.25
    for receiver, name in ((True, "receiver_position"), (False, "position")):
        np.testing.assert_allclose(recorded_poses(two, receiver=receiver)[0], two[name].values + 0.25)
        np.testing.assert_array_equal(recorded_poses(two, "true", receiver=receiver)[0], two[name].values)


@given(st.floats(-3, 3), st.floats(-1, 1), st.floats(-1, 1))
def test_a_platform_that_turns_keeps_the_shape_of_its_array(heading, pitch, roll):
    """Distances between elements and to the reference point are those of the body, wherever it is."""
    turned = held().copy()
    turned["receiver_attitude"] = ("ping", "axis"), np.tile([heading, pitch, roll], (PINGS, 1))
    place, rotation = recorded_poses(turned, receiver=True)
    world = body_to_world(place, rotation, recorded_element_positions(turned))
    np.testing.assert_allclose(np.linalg.norm(world - place[:, None], axis=-1), 0.3, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(world[:, 0] - world[:, 1], axis=-1), 0.6, atol=1e-9)


@pytest.mark.parametrize("two", [True, False])
@pytest.mark.parametrize("half", [0.0, 0.1])
def test_a_point_is_focused_wherever_pulses_have_their_middle(two, half):
    """Ends at 1 m/s, a pulse of 0.2 s or none: the point stands in its place, not 10 cm off, at its own level."""
    moving = held(two, speed=1.0, half=half).assign_attrs(pulse_duration=2 * half)
    axes = np.arange(-3, 4) * 0.05, 20 + np.arange(-3, 4) * 0.02
    image = synthetic_aperture_image(moving, *axes, 5.0, sound_speed=C, threads=1, transmitter_position=np.zeros(3))
    level = np.abs(image["pressure"].values)
    assert np.unravel_index(np.argmax(level), level.shape) == (3, 3)
    assert level[3, 3] == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("duration", [0.5e-3, 2e-3])
def test_a_compressed_recording_holds_the_length_of_its_pulse(duration):
    """By a pulse, or by its samples at the recording's rate."""
    pulse = Pulse(kind="lfm", frequency=F, bandwidth=8e3, duration=duration)
    assert compressed_recording(held(), pulse).attrs["pulse_duration"] == duration
    samples = np.ones(round(duration * RATE), complex)
    assert compressed_recording(held(), samples).attrs["pulse_duration"] == pytest.approx(duration)
