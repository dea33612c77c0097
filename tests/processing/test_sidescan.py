"""Claims about the sidescan image: port left, starboard right, and what it stands on is reported."""

import numpy as np
import pytest

from insonify.processing import sidescan
from insonify.simulator import simulate
from oracles.scenes import nominal, point

TARGETS = [point(0, 60, 15, label="east"), point(0, -40, 15, label="west")]
SETTINGS = {"paths": {"contributions": ["target"], "max_reflections": 0}, "targets": TARGETS}


def recording(**changes):
    """A point 60 m to starboard, another 40 m to port."""
    return simulate(
        nominal(**{"sonar": {"sides": ["starboard", "port"]}, "track": {"window": (0, 0.1)}, **SETTINGS} | changes)
    )


@pytest.mark.parametrize(
    ("geometry", "west", "east"),
    [("slant", np.hypot(40, 4), np.hypot(60, 4)), ("ground", np.sqrt(40**2 + 16 - 81), np.sqrt(60**2 + 16 - 81))],
)
def test_targets_appear_on_their_side_at_their_range(geometry, west, east):
    """Port is negative; on the ground a raised target comes to lie as its slant range on the bed would."""
    image = sidescan(recording(), geometry=geometry, gain="none", altitude=9.0)
    level, across = np.nan_to_num(image.level_db.values[0], nan=-999, neginf=-999), image.across.values
    assert np.all(np.diff(across) >= 0)
    assert across[np.argmax(np.where(across > 0, level, -999))] == pytest.approx(east, abs=0.15)
    assert across[np.argmax(np.where(across < 0, level, -999))] == pytest.approx(-west, abs=0.15)
    assert image.attrs["geometry"] == geometry and image.level_db.attrs["units"] == "dB"


def test_one_side_alone_makes_half_an_image():
    """A sonar without sides looks to the right."""
    image = sidescan(recording(sonar={}), gain="tvg30", altitude=9.0)
    assert image.across.min() >= 0 and image.sizes["across"] == 2500


def test_the_distance_run_is_that_of_the_log():
    """2 m/s, every 0.5 s."""
    track = {"kind": "line", "start": (0, 0, 11), "speed": 2, "pings": 3, "interval": 0.5, "window": (0, 0.01)}
    planned = nominal(**SETTINGS)
    scenario = type(planned)(**planned.model_dump(mode="json", exclude={"track"}), track=track)
    np.testing.assert_allclose(sidescan(simulate(scenario), altitude=9.0).along, [0, 1, 2])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"gain": "tvg"}, "gain is 'tvg'; choose one of none, tvg20"),
     ({"geometry": "flat"}, "choose one of slant, ground"),
     ({"beam": 1}, "beam is 1; each side has beams 0 to 0")],
)  # fmt: skip
def test_an_image_that_cannot_be_is_refused_with_the_choices(wrong, message):
    """What there is."""
    with pytest.raises(ValueError, match=message):
        sidescan(recording(track={"window": (0.05, 0.051)}), altitude=9.0, **wrong)
