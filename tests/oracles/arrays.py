"""Scenes of a few point targets in clear water, received element by element, as `oracles.underway` can sum them."""

import numpy as np

from insonify.scenario.scenario import Scenario

START, HEADING = np.array([0.0, 0.0, 6.0]), np.radians(30)
WINDOW = (0.0, 0.064)


def some_targets(count: int = 6, seed: int = 1) -> np.ndarray:
    """North, east, depth of targets all round [m], shape (count, 3)."""
    random = np.random.default_rng(seed)
    bearing, away = random.uniform(0, 2 * np.pi, count), random.uniform(15, 44, count)
    return np.stack([away * np.cos(bearing), away * np.sin(bearing), random.uniform(3, 18, count)], axis=1)


def line_of(count: int = 4, length: float = 0.24) -> dict[str, object]:
    """A line of omnidirectional elements."""
    return {"kind": "line", "length": length, "elements": count, "element": "omni"}


def elements_scenario(
    targets, *, pulse=None, receive=None, track=None, receiver=None, transmit=None, **top
) -> Scenario:
    """A sonar that looks to starboard and records its elements, in silent water that takes nothing."""
    described = {
        "water": {"sound_speed": 1500.0, "absorption_db_per_m": 0.0, "noise_level_db": None},
        "seabed": {"depth": 20.0},
        "field": "coherent",
        "targets": [
            {"shape": "point", "label": f"t{row}", "target_strength_db": 0.0, "position": tuple(map(float, place))}
            for row, place in enumerate(targets)
        ],
        "sonar": {
            "source_level_db": 200,
            "pulse": pulse or {"kind": "lfm", "frequency": 100e3, "bandwidth": 8e3, "duration": 0.5e-3},
            "transmit": transmit or {"kind": "point", "element": "omni"},
            "receive": receive or line_of(),
            "receiver": {"bandwidth": 20e3, "record": "elements", **(receiver or {})},
            "mounting": {"bearing": np.pi / 2},
        },
        "track": {"kind": "line", "start": tuple(START), "heading": HEADING, "speed": 3.0, "window": WINDOW,
                  **(track or {})},
        "paths": {"max_reflections": 1, "families": ["D", "S"], "contributions": ["target"]},
        "seed": 3,
        **top,
    }  # fmt: skip
    return Scenario(**described)
