"""Whether one mean plane would do for the multiples of a ping: told from how far its legs are off."""

import numpy as np
import pytest

from insonify.engines.mean_plane import beam_height, mean_plane_error, mean_plane_serves
from insonify.simulation import prepare
from oracles.scenes import nominal


def asked(seabed, *, reflections=2, heading=0.0, **sonar):
    """The error over a bed, and whether it is small."""
    scenario = nominal(seabed=seabed, track={"window": (0.02, 0.2), "heading": heading},
                       paths={"reflections": reflections}, sonar=sonar)  # fmt: skip
    listening = prepare(scenario)
    engine, here = listening.engine, listening.stance(0)
    found = mean_plane_error(engine.scene, engine.choice, here, engine.rays)
    assert mean_plane_serves(engine.scene, engine.choice, here, engine.rays) == found.small
    return found


def slope(tmp_path, tilt):
    """A bed that falls to the east."""
    nodes = np.arange(-200.0, 201.0, 2.0)
    np.savez(tmp_path / "slope.npz", depth=20 + tilt * nodes[None, :] + 0 * nodes[:, None], north=nodes, east=nodes)
    return {"relief": {"kind": "grid", "file": str(tmp_path / "slope.npz"), "origin": (0.0, 0.0)}, "depth": 20.0}


def test_a_flat_bed_and_direct_paths_are_served():
    """No relief, relief without height, and relief under families that bounce off the surface only: no error at all."""
    rough = {"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.5}}
    for seabed, order in (({}, 2), ({"relief": {"kind": "ripples", "height": 0.0}}, 2), (rough, 1)):
        found = asked(seabed, reflections=order)
        assert found.small and found.delay == found.azimuth == found.elevation == 0


@pytest.mark.parametrize("tilt", [0.0004, 0.02])
def test_the_error_of_a_slope_is_that_of_its_image(tmp_path, tilt):
    """BS to a bed that falls to the east, seen to the east: images in that plane and in a level one.

    At 2 % the worst legs are 2 m off; at 0.04 % a twentieth of a quarter.
    """
    found = asked(slope(tmp_path, tilt))
    up = np.array([0.0, tilt, -1.0]) / np.hypot(tilt, 1)
    place, on = np.array([0.0, 0.0, 11.0]), np.array([0.0, 0.0, 20.0])
    east = np.linspace(20.0, 149.0, 200)
    points = np.stack([0 * east, east, 20 + tilt * east], axis=-1)
    images = [place - 2 * ((place - on) @ facing) * facing for facing in (up, np.array([0.0, 0.0, -1.0]))]
    ways = [np.linalg.norm(points - image * (1, 1, -1), axis=1) for image in images]
    assert found.delay == pytest.approx(np.quantile(abs(ways[0] - ways[1]), 0.95) / 0.1276, rel=0.1)
    assert found.azimuth < 0.05
    assert found.small == (tilt < 0.01)


def test_a_slope_to_the_side_turns_multiples_out_of_a_narrow_beam(tmp_path):
    """Seen to the north, a bed that falls to the east by 2 % turns BS aside: much of 9 mrad, little of a wide beam."""
    for length, aside in ((1.5, True), (0.015, False)):
        found = asked(slope(tmp_path, 0.02), heading=-np.pi / 2, transmit={"kind": "line", "length": length},
                      receive={"kind": "line", "length": length})  # fmt: skip
        assert (found.azimuth > 0.25) == aside
        assert found.elevation < 0.01


def test_a_beam_is_as_high_as_its_half_power_points():
    """A line array has no height of its own; a face 10 wavelengths high has 0.886 / 10 rad one way, 0.64 both ways."""
    assert beam_height(prepare(nominal()).stance(0)) > 3
    face = {"kind": "planar", "width": 0.15, "height": 0.15}
    here = prepare(nominal(sonar={"transmit": face, "receive": face})).stance(0)
    assert beam_height(here) == pytest.approx(0.064, abs=np.radians(1.0))
