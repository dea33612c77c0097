"""Two cheap simulated scenes whose draws are compared: a sidescan over a level bed, an echosounder below a hull."""

import copy
from typing import Any

import numpy as np
import xarray as xr

import insonify

SIDESCAN: dict[str, Any] = {
    "water": {"noise_level_db": 45},
    "seabed": {"depth": 8.0, "scattering": {"sediment": "medium sand"}},
    "sonar": {
        "source_level_db": 200,
        "pulse": {"kind": "cw", "frequency": 100e3, "duration": 0.2e-3},
        "transmit": {"kind": "planar", "width": 0.1, "height": 0.02},
        "receive": {"kind": "planar", "width": 0.1, "height": 0.02},
        "mounting": {"bearing": np.pi / 2, "tilt": 0.5},
    },
    "track": {"kind": "line", "start": [0.0, 0.0, 3.0], "heading": 0.0, "speed": 2.0, "interval": 2.0, "pings": 16,
              "window": [0.0, 0.04]},
    "paths": {"max_reflections": 2},
}  # fmt: skip
ECHOSOUNDER: dict[str, Any] = {
    "water": {"noise_level_db": 55},
    "seabed": {"depth": 6.0, "scattering": {"sediment": "medium sand"}},
    "surface": {"reflection": "flat"},
    "sonar": {
        "source_level_db": 210,
        "pulse": {"kind": "cw", "frequency": 100e3, "duration": 0.2e-3},
        "transmit": {"kind": "planar", "width": 0.06, "height": 0.06},
        "receive": {"kind": "planar", "width": 0.06, "height": 0.06},
        "receiver": {"bandwidth": 8e3},
        "mounting": {"bearing": 0.0, "tilt": np.pi / 2},
        "hull": {"length": 14.0, "width": 3.0, "reflection": 0.9},
    },
    "track": {"kind": "line", "start": [0.0, 0.0, 1.5], "heading": 0.0, "speed": 4.0, "interval": 1.0, "pings": 12,
              "window": [0.001, 0.022]},
    "paths": {"max_reflections": 3, "scatterers_per_cell": 1},
}  # fmt: skip


def drawn(scene: dict[str, Any], seed: int, changes: dict[str, Any] | None = None) -> xr.Dataset:
    """One draw of a scene; changes are named by their keys with dots."""
    made = copy.deepcopy(scene) | {"seed": seed}
    for key, value in (changes or {}).items():
        *sections, last = key.split(".")
        place = made
        for section in sections:
            place = place.setdefault(section, {})
        place[last] = value
    return insonify.simulate(insonify.Scenario.model_validate(made))
