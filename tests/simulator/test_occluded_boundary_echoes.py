"""Boundary echoes over relief that stands between both ends, or does not."""

import numpy as np
import pytest

from insonify.simulator import arrivals
from simulator.test_boundary_echoes import CURVED_WAVES, bed_only, by_family


def test_a_ridge_between_two_platforms_hides_the_echo_beyond_it(tmp_path):
    """B from 11 m to 11 m off ground at 20 m, 60 m apart: lost behind a ridge up to 13 m; S stays as over plain bed."""
    north, found = np.arange(-75, 75.1, 0.5), {}
    for name, height in (("ridge", 7.0), ("plain", 1e-3)):
        depth = 20 - height * np.exp(-((north - 12) ** 2))
        np.savez(tmp_path / f"{name}.npz", north=north, east=north, depth=depth[:, None] + 0 * north[None, :])
        relief = {"relief": [{"kind": "grid", "file": str(tmp_path / f"{name}.npz")}], "depth": 20.0}
        found[name] = arrivals(
            bed_only(
                order=1, seabed=relief, paths={"families": ["S", "B"]},
                receiver_track={"kind": "static", "position": (60.0, 0.0, 11.0)},
            )
        )  # fmt: skip
    amplitude = {
        name: [abs(rows.amplitude[np.array(rows.transmit_family) == family]).max(initial=0.0) for family in "SB"]
        for name, rows in found.items()
    }
    assert amplitude["ridge"][0] == pytest.approx(amplitude["plain"][0], rel=1e-3)
    assert amplitude["plain"][1] > 1e-3
    assert amplitude["ridge"][1] == 0


@pytest.mark.parametrize("edges", ["none", "knife-edge"])
def test_two_positions_that_nearly_coincide_receive_the_echoes_of_one(edges):
    """B, S, BS, SB over sand waves below both ends: a receiver 1e-7 m away has the same rows within 1e-4.

    Occlusion by the seabed is evaluated between two positions alone.
    """
    pulse = {"pulse": {"kind": "cw", "frequency": 60e3, "duration": 1e-3}, "receiver": {"bandwidth": 5e3}}
    scene = {
        "order": 2, "seabed": {"relief": [CURVED_WAVES]}, "sonar": pulse, "track": {"position": (2.5, 0.0, 11.0)},
        "paths": {"families": ["S", "B", "SB", "BS"], "edge_diffraction": edges},
    }  # fmt: skip
    one = arrivals(bed_only(**scene))
    two = arrivals(bed_only(**scene, receiver_track={"kind": "static", "position": (2.5 + 1e-7, 0.0, 11.0)}))
    assert set(by_family(one)) == {"S", "B", "SB", "BS"}
    assert len(one) > 4
    assert list(one.transmit_family) == list(two.transmit_family)
    np.testing.assert_allclose(one.delay, two.delay, rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.amplitude, two.amplitude, rtol=1e-4)
