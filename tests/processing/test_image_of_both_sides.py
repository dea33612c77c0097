"""Images made from recordings: invariances that hold for any sound, none of it simulated."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.processing.sidescan import GAINS, sidescan

PINGS, SAMPLES, STEP = 40, 600, 1e-4
TIME = np.arange(SAMPLES) * STEP
SLANT = TIME * 1500 / 2
ALTITUDE = 9.0


def recording(seed=1, sides=(-1, 1), beams=1, depth=11.0, gain=1.0, pings=PINGS):
    """Speckle over a level bed that fades with range, silent in the water column."""
    rng = np.random.default_rng(seed)
    channels = len(sides) * beams
    fade = np.where(SLANT > ALTITUDE, 1e6 * np.maximum(SLANT, 1) ** -4.0, 1e-9)
    intensity = rng.exponential(size=(pings, channels, SAMPLES)) * fade * gain
    position = np.column_stack([np.arange(pings) * 0.6, np.zeros(pings), np.full(pings, depth)])
    return xr.Dataset(
        {
            "intensity": (("ping", "channel", "time"), intensity),
            "position": (("ping", "axis"), position),
        },
        coords={
            "ping": np.arange(pings), "time": TIME, "side": ("channel", np.repeat(np.array(sides, float), beams)),
        },
    )  # fmt: skip


@pytest.mark.parametrize("gain", GAINS)
@pytest.mark.parametrize("geometry", ["slant", "ground"])
def test_exchanging_the_sides_mirrors_the_image(gain, geometry):
    """Port and starboard swapped: the same image, left to right."""
    sound = recording()
    swapped = sound.assign(intensity=sound["intensity"][:, ::-1])
    one, other = (sidescan(s, gain=gain, geometry=geometry, altitude=ALTITUDE) for s in (sound, swapped))
    np.testing.assert_allclose(other["level_db"].values, one["level_db"].values[:, ::-1], rtol=1e-12)
    np.testing.assert_allclose(one["across"].values, -one["across"].values[::-1])


@pytest.mark.parametrize("gain", [name for name in GAINS if name != "empirical"])
def test_a_stronger_recording_is_a_brighter_image(gain):
    """Ten decibels more are ten decibels more under every law."""
    one, other = (sidescan(recording(gain=g), gain=gain, altitude=ALTITUDE) for g in (1.0, 10.0))
    np.testing.assert_allclose(other["level_db"].values - one["level_db"].values, 10.0, atol=1e-9)


def test_an_empirical_gain_does_not_depend_on_the_level_of_the_sonar():
    """It learns the level with everything else."""
    one, other = (sidescan(recording(gain=g), gain="empirical", altitude=ALTITUDE) for g in (1.0, 1e5))
    np.testing.assert_allclose(other["level_db"].values, one["level_db"].values, atol=1e-6)


def test_under_an_empirical_gain_the_bed_has_no_trend():
    """The median over the pings is about zero at every range where the bed is received."""
    image = sidescan(recording(pings=200), gain="empirical", altitude=ALTITUDE)
    level, across = image["level_db"].values, image["across"].values
    middle = np.median(level[:, np.abs(across) > ALTITUDE + 2], axis=0)
    # A median of 200 exponentials has a standard error of 4.34 / ln 2 / sqrt(200) = 0.44 dB.
    assert np.abs(middle).mean() < 0.5 and np.abs(middle).max() < 2.5


@given(st.sampled_from(["none", "tvg20", "tvg40", "lambert"]), st.floats(1400, 1600))
@settings(max_examples=12, deadline=None)
def test_ranges_follow_the_sound_speed(gain, speed):
    """Half of time times speed, to port and to starboard."""
    image = sidescan(recording(pings=3), gain=gain, sound_speed=speed, altitude=ALTITUDE)
    np.testing.assert_allclose(image["across"].values, np.concatenate([-TIME[::-1], TIME]) * speed / 2)
    assert image.attrs["sound_speed"] == speed


def test_on_the_ground_an_echo_lies_at_the_root_of_the_squares():
    """One bright sample at a slant range of 30 m over 9 m of height: 28.6 m across."""
    sound = recording(sides=(1,), pings=2)
    row = int(np.argmin(np.abs(SLANT - 30)))
    sound["intensity"].values[:, 0, row] = 1e9
    image = sidescan(sound, gain="none", geometry="ground", altitude=ALTITUDE)
    found = image["across"].values[np.argmax(image["level_db"].values[0])]
    assert found == pytest.approx(np.sqrt(SLANT[row] ** 2 - ALTITUDE**2), abs=0.15)


def test_the_altitude_is_that_of_the_first_return_if_none_is_given():
    """Silence until 9 m, then the bed."""
    image = sidescan(recording(), gain="none")
    np.testing.assert_allclose(image["altitude"].values, ALTITUDE, atol=0.5)


@pytest.mark.parametrize("beam", [0, 1, 2])
def test_each_side_shows_the_requested_beam(beam):
    """Of three beams a side the one requested, on both."""
    sound = recording(beams=3)
    image = sidescan(sound, gain="none", beam=beam)
    level = 10 * np.log10(sound["intensity"].values)
    half = SAMPLES
    np.testing.assert_allclose(image["level_db"].values[:, :half], level[:, beam, ::-1])
    np.testing.assert_allclose(image["level_db"].values[:, half:], level[:, 3 + beam])


def test_one_side_alone_has_no_negative_ranges():
    """A recording of starboard alone, and of port alone."""
    starboard, port = (sidescan(recording(sides=(s,)), gain="none")["across"].values for s in (1, -1))
    assert starboard.min() >= 0 and port.max() <= 0


def test_pings_that_are_weak_as_a_whole_are_evened_out():
    """A ping 12 dB down comes back to its neighbours; the others stay."""
    sound = recording()
    sound["intensity"].values[20] *= 10**-1.2
    plain, even = (sidescan(sound, gain="tvg40", altitude=ALTITUDE, normalise_along_track=e) for e in (False, True))
    dark = np.abs(plain["across"].values) > ALTITUDE + 1
    down = np.median(plain["level_db"].values[20, dark]) - np.median(plain["level_db"].values[10, dark])
    left = np.median(even["level_db"].values[20, dark]) - np.median(even["level_db"].values[10, dark])
    assert down == pytest.approx(-12, abs=0.5) and abs(left) < 0.7


def test_the_distance_run_is_that_of_the_log_where_there_is_one():
    """Logged 1 % long: the image's axis is 1 % longer."""
    sound = recording()
    logged = sound.assign(logged_position=sound["position"] * 1.01)
    true, logged_run = (sidescan(s, gain="none")["along"].values for s in (sound, logged))
    np.testing.assert_allclose(logged_run, 1.01 * true)
    assert true[-1] == pytest.approx(0.6 * (PINGS - 1))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"gain": "agc"}, "gain is 'agc'; choose one of none"), ({"geometry": "polar"}, "geometry is 'polar'"),
     ({"beam": 1}, "beam is 1; each side has beams 0 to 0"), ({"beam": -1}, "beam is -1")],
)  # fmt: skip
def test_what_there_is_not_is_refused_with_the_choices(wrong, message):
    """Names and numbers, with what could be requested instead."""
    with pytest.raises(ValueError, match=message):
        sidescan(recording(), **wrong)
