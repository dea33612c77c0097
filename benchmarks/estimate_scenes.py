"""Scenes on which the estimate of `insonify check` is compared with the run: templates with changes."""

from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

TEMPLATES = files("insonify.scenario") / "templates"
EXAMPLES = Path(__file__).parents[1] / "examples"

ROUGH = {"kind": "power-law", "hurst": 0.8, "rms": "8 cm", "outer_scale": "25 m"}
CALM = {"reflection": "flat", "wind_speed": None}
LABELS = {"output": {"labels": True}}
THERMOCLINE = [[0, 1510], [8, 1510], [14, 1490], [20, 1490]]
NEAR = {"track": {"window": ["0 ms", "60 ms"], "pings": 4}}
"""A short window, for what would take minutes over the template's."""
STEADY = {"kind": "line", "start": [0, 0, 12], "speed": "2 m/s", "pings": 40, "interval": "0.15 s",
          "window": ["0 ms", "70 ms"]}  # fmt: skip
SMOOTH = {"shape": "box", "position": [0, 30], "size": ["2 m", "1 m", "1 m"], "face_reflection_coefficient": 0.9}
SPHERE = {"shape": "sphere", "position": [0, 30], "diameter": "1.5 m", "face_reflection_coefficient": 0.9}
PLAIN = {"texture": None, "relief": None}

SCENES: dict[str, tuple[str, dict[str, Any]]] = {
    "one ping": ("nominal", {}),
    "calm sea": ("nominal", {"surface": CALM, "track": {"pings": 10}}),
    "statistical sea, order 4": ("nominal", {"paths": {"max_reflections": 4}, "track": {"pings": 6}}),
    "explicit waves": ("nominal", {"surface": {"reflection": "explicit"}, **NEAR}),
    "own echoes of the surface": (
        "nominal", {"surface": {"scattering": {"law": "apl-surface", "wind_speed": "5 m/s"}}, "track": {"pings": 4}}
    ),
    "layered water": ("nominal", {"water": {"profile": THERMOCLINE, "sound_speed": None}, "track": {"pings": 6}}),
    "uneven water": ("nominal", {"water": {"inhomogeneity": {"rms_index": 1e-4, "correlation_length": "2 m"}}, **NEAR}),
    "expected, general": ("nominal", {"field": "incoherent", "surface": CALM, "track": {"pings": 2}}),
    "labels of one beam": ("nominal", {**LABELS, "surface": CALM, **NEAR}),
    "slice": ("nominal", {"paths": {"geometry": "slice"}, "targets": [], "track": {"pings": 100}}),
    "tracer": ("nominal", {"paths": {"engine": "tracer"}, "field": "incoherent", "surface": CALM,
                           "track": {"pings": 2}}),
    "smooth box": ("nominal", {"targets": [SMOOTH], "surface": CALM, **NEAR}),
    "smooth sphere": ("nominal", {"targets": [SPHERE], "surface": CALM, **NEAR}),
    "suspended matter": ("nominal", {"water": {"volume_strength_db": -70}, "surface": CALM,
                                     "track": {"window": ["0 ms", "25 ms"], "pings": 1}}),
    "suspended matter, expected": ("nominal", {"water": {"volume_strength_db": -70}, "field": "incoherent",
                                               "surface": CALM, "track": {"window": ["0 ms", "25 ms"], "pings": 1}}),
    "two platforms": ("nominal", {"receiver_track": {"kind": "static", "position": [5, 3, 9]}, "surface": CALM,
                                  "track": {"pings": 3, "window": ["0 ms", "100 ms"]}}),
    "sub-bands": ("nominal", {"sonar": {"receiver": {"sub_bands": 4}}, "track": {"pings": 6}, "surface": CALM}),
    "sidescan": ("sidescan", {}),
    "sidescan, labels": ("sidescan", {**LABELS, "track": STEADY | {"pings": 10}}),
    "sidescan, expected": ("sidescan", {"field": "incoherent", "track": STEADY | {"pings": 400}}),
    "sidescan, expected, labels": ("sidescan", {"field": "incoherent", **LABELS, "track": STEADY | {"pings": 8}}),
    "sidescan over relief": (
        "sidescan",
        {"seabed": {"relief": ROUGH}, "track": STEADY, "paths": {"max_reflections": 2}},
    ),
    "sidescan, expected over relief": (
        "sidescan", {"field": "incoherent", "seabed": {"relief": ROUGH}, "track": STEADY | {"pings": 100}}
    ),
    "coherent sidescan": ("coherent-sidescan", {}),
    "elements": ("forward-looking", {}),
    "elements, moving": ("forward-looking", {
        "track": {"kind": "line", "start": [0, 0, 7], "heading": 0, "speed": "1 m/s", "pings": 3, "interval": "0.2 s",
                  "window": ["0 ms", "55 ms"]}}),
    "multibeam": ("multibeam", {}),
    "interferometric": ("interferometric", {}),
    "synthetic aperture": ("synthetic-aperture", {}),
    "harbour, expected": ("harbour", {"track": {"pings": 2}}),
    "harbour, coherent": ("harbour", {"track": {"pings": 2}, "field": "coherent"}),
}  # fmt: skip


def described(name: str) -> dict[str, Any]:
    """Contents of the scenario file of one scene."""
    base, changes = SCENES[name]
    file = EXAMPLES / f"{base}.yaml" if base == "harbour" else TEMPLATES / f"{base}.yaml"
    return merged(yaml.safe_load(file.read_text(encoding="utf-8")), changes)


def merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """A description with some of its values replaced; a track of another kind is replaced as a whole."""
    found = dict(base)
    for key, value in changes.items():
        old = found.get(key)
        deep = isinstance(value, dict) and isinstance(old, dict) and "kind" not in value
        found[key] = merged(old, value) if deep and isinstance(old, dict) else value
    return found
