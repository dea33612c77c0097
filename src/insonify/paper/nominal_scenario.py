"""Nominal scene of the paper, with the changes of a figure.

The surface is flat, shadows are hard, there are no boundary echoes, and the carrier stands for the whole band.
"""

from functools import lru_cache
from typing import Any

from insonify.scenario.scenario import Scenario
from insonify.scenario.template import load_template
from insonify.scene.scatterers import BOUNDARY_ECHO


@lru_cache(maxsize=1)
def _template() -> Scenario:
    scenario = load_template("nominal")
    surface = scenario.surface.model_copy(update={"reflection": "flat", "wind_speed": None})
    contributions = tuple(name for name in scenario.paths.contributions if name != BOUNDARY_ECHO)
    paths = scenario.paths.model_copy(update={"edge_diffraction": "none", "contributions": contributions})
    receiver = scenario.sonar.receiver.model_copy(update={"sub_bands": 1})
    sonar = scenario.sonar.model_copy(update={"receiver": receiver})
    return scenario.model_copy(update={"surface": surface, "paths": paths, "sonar": sonar})


def nominal(changes: dict[str, Any] | None = None) -> Scenario:
    """Nominal scenario with some values changed.

    Args:
        changes: New values by dotted name, such as {"paths.max_reflections": 0}.

    Returns:
        A scenario, validated as if it were read from a file.
    """
    values = _template().model_dump(mode="json")
    for name, value in (changes or {}).items():
        *sections, last = name.split(".")
        parent = values
        for section in sections:
            parent = parent[section]
        if last not in parent:
            raise KeyError(f"{name} is not a value of the nominal scenario")
        parent[last] = value
    return Scenario.model_validate(values)


def box(length: float) -> dict[str, Any]:
    """Box target of the paper, with a given length along the track [m]."""
    return {"shape": "box", "label": "box", "position": [0.0, 150.5], "size": [length, 1.0, 1.0]}
