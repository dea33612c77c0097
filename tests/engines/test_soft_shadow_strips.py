"""Strips across cells in soft shadows: as many as a converged expected intensity needs."""

import numpy as np
import pytest

import insonify
from insonify.engines import quadrature_points
from insonify.scenario.scenario import Scenario

TYRE = {
    "field": "incoherent",
    "water": {"noise_level_db": -100.0},
    "seabed": {"depth": 10.0, "scattering": {"law": "lambert"}},
    "targets": [{"shape": "library", "name": "tyre", "position": [8.0, 6.0]}],
    "sonar": {
        "source_level_db": 200.0,
        "pulse": {"kind": "cw", "frequency": "750 kHz", "duration": "0.05 ms"},
        "transmit": {"kind": "planar", "width": 0.05, "height": 0.004},
        "receive": {"kind": "planar", "width": 0.05, "height": 0.004},
        "mounting": {"bearing": 0.0, "tilt": 0.0},
    },
    "track": {"kind": "static", "position": [0.0, 0.0, 6.0], "heading": 0.64, "window": ["12 ms", "24 ms"]},
    "paths": {"max_reflections": 0},
}  # fmt: skip


def test_eight_strips_in_the_soft_shadow_of_a_tyre_have_converged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every sample from the tyre to the end of its shadow, re 32 strips: 0.01 dB rms; two strips are off by 0.05."""

    def level(strips: int) -> np.ndarray:
        monkeypatch.setattr(quadrature_points, "SOFT_EDGE_STRIPS", strips)
        return 10 * np.log10(insonify.simulate(Scenario.model_validate(TYRE))["intensity"].values[0, 0])

    usual, converged = level(quadrature_points.SOFT_EDGE_STRIPS), level(32)
    error, coarse = (float(np.sqrt(np.mean((one - converged) ** 2))) for one in (usual, level(2)))
    assert 0 < error < 0.02 < 0.04 < coarse
