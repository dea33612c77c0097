"""Attributes of a recording as a whole."""

from functools import cache
from importlib.metadata import version
from typing import Any

from insonify.scenario.citations import citations
from insonify.scenario.georeference import georeference
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml


def attributes(scenario: Scenario) -> dict[str, Any]:
    """Attributes of a recording: the scenario itself, and the sources of what runs in it."""
    return {
        "title": scenario.title,
        "scenario": to_yaml(scenario),
        "seed": scenario.seed,
        "version": _version("insonify"),
        "centre_frequency": scenario.sonar.pulse.frequency,
        "centre_frequency_units": "Hz",
        "citations": citations(scenario),
        **georeference(scenario),
    }


_version = cache(version)  # 1 ms: it reads a file
