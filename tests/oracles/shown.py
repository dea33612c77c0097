"""The scenarios that show what the simulator does, brought down to what a test has time for."""

from functools import lru_cache
from typing import Any

import xarray as xr

from insonify.scenario.scenario import Scenario
from insonify.scenario.template import load_template
from insonify.simulator import simulate

SMALL: dict[str, dict[str, Any]] = {
    "coherent-sidescan": {"track.pings": 5, "track.speed": 12.0, "track.start": [9.0, 0.0, 11.0],
                          "track.window": [0.198, 0.228]},
    "forward-looking": {"track.window": [0.012, 0.025], "paths.max_reflections": 0, "seabed.relief": [],
                        "paths.contributions": ["target"]},
    "multibeam": {"targets": [], "track.pings": 1, "sonar.receive.elements": 64, "sonar.receive.length": 0.16,
                  "track.window": [0.015, 0.07]},
    "interferometric": {"targets": [], "track.pings": 3, "track.start": [20.0, 0.0, 8.0],
                        "track.window": [0.012, 0.045]},
    "synthetic-aperture": {"track.pings": 10, "track.start": [4.2, 0.0, 10.0], "track.window": [0.0325, 0.0375],
                           "paths.contributions": ["target"]},
}  # fmt: skip
"""What is changed in each, by dotted name."""


def small(name: str, changes: dict[str, Any] | None = None) -> Scenario:
    """A scenario with less of everything.

    Args:
        name: Name of its template.
        changes: Further values by dotted name.
    """
    values = load_template(name).model_dump(mode="json")
    for key, value in {**SMALL[name], **(changes or {})}.items():
        *way, last = key.split(".")
        place = values
        for step in way:
            place = place[step]
        assert last in place, key
        place[last] = value
    if name == "forward-looking":  # long bodies take long to be drawn
        values["targets"] = [target for target in values["targets"] if target["label"] in ("mine", "sphere")]
    return Scenario.model_validate(values)


@lru_cache(maxsize=8)
def simulated(name: str) -> tuple[Scenario, xr.Dataset]:
    """A small scenario, and its recording.

    Args:
        name: Name of its template.
    """
    scenario = small(name)
    return scenario, simulate(scenario)
