"""Small scenarios that between them run every branch of the pipeline, each a few tenths of a second when compiled."""

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import insonify
from insonify.scenario.scenario import Scenario

Output = Mapping[str, np.ndarray]

RELIEF = {"kind": "power-law", "hurst": 0.8, "rms": "5 cm", "outer_scale": "10 m"}
PROFILE = [[0, 1510], [6, 1510], [12, 1490], [20, 1490]]
BOX = {"shape": "box", "label": "box", "position": [0.3, 40.5], "size": [1.5, 1.0, 1.0], "heading": "20 deg"}
PLANAR = {"kind": "planar", "width": "40 cm", "height": "4 cm"}


def scenario(**changes: object) -> Scenario:
    """A 100 kHz sidescan 11 m deep in 20 m of water over flat sand, out to 60 m, with some keys replaced.

    Args:
        changes: Top-level keys; `track` (of the same kind), `sonar`, `seabed` and `paths` are merged one level deep.
    """
    base = {
        "seed": 3,
        "water": {"sound_speed": 1500.0},
        "seabed": {
            "depth": 20.0, "scattering": {"law": "lambert", "strength_db": -27}, "reflection": 0.35,
        },
        "targets": [BOX],
        "sonar": {
            "source_level_db": 220,
            "pulse": {"kind": "cw", "frequency": 100e3, "duration": 0.2e-3},
            "transmit": PLANAR,
            "receive": PLANAR,
            "mounting": {"bearing": "90 deg", "tilt": "12 deg"},
        },
        "track": {
            "kind": "line", "start": [0, 0, 11], "heading": 0, "speed": 2.0, "pings": 2, "interval": 0.1,
            "window": [0.0, 0.08],
        },
        "paths": {"max_reflections": 1, "contributions": ["seabed", "surface", "target", "water"]},
    }  # fmt: skip
    for key, value in changes.items():
        merged = key in ("track", "sonar", "seabed", "paths") and "kind" not in value  # type: ignore[operator]
        base[key] = {**base[key], **value} if merged else value  # type: ignore[dict-item]
    # as when these recordings were made; `auto` is the default
    base["sonar"]["receiver"] = {"sub_bands": 1, **base["sonar"].get("receiver", {})}  # type: ignore[index,attr-defined]
    return Scenario(**base)  # type: ignore[arg-type]


def recorded(**changes: object) -> Callable[[int], Output]:
    """Recording of a scenario as a function of the number of threads."""

    def made(threads: int) -> Output:
        recording = insonify.simulate(scenario(**changes), threads=threads)
        name = "pressure" if "pressure" in recording else "intensity"
        return {name: recording[name].values}

    return made


def meshed(threads: int) -> Output:
    """Recording of a tetrahedron read from a mesh file."""
    corners = np.array([[0, 0, 0], [2, 0, 0], [1, 1.5, 0], [1, 0.6, 1.2]])
    facets = [f"facet normal 0 0 0\nouter loop\n{_vertices(corners[list(face)])}\nendloop\nendfacet" for face in FACES]
    with TemporaryDirectory() as folder:
        file = Path(folder, "tetrahedron.stl")
        file.write_text("\n".join(["solid tetrahedron", *facets, "endsolid tetrahedron\n"]))
        target = {"shape": "mesh", "label": "tetrahedron", "position": [0, 40], "file": str(file)}
        return recorded(targets=[target])(threads)


FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))


def _vertices(corners: np.ndarray) -> str:
    return "\n".join(f"vertex {x} {y} {z}" for x, y, z in corners)


def labelled(threads: int) -> Output:
    """Labels of one ping over relief with a box."""
    one = scenario(seabed={"relief": RELIEF})
    return {name: column.values for name, column in insonify.labels(one, 1, threads=threads).data_vars.items()}


def levelled(threads: int) -> Output:
    """Expected levels of one ping by object and pair of path families."""
    one = scenario(seabed={"relief": RELIEF}, field="incoherent")
    return {"level_db": insonify.levels(one, threads=threads)["level_db"].values}


def listed(_: int) -> Output:
    """Every arrival of one ping over a flat bed."""
    found = insonify.arrivals(scenario(), 1)
    return {"delay": found.delay, "amplitude": found.amplitude[:, None], "departure": found.departure}


LINE = {"kind": "line", "length": "40 cm", "elements": 8}
SCENES: Mapping[str, Callable[[int], Output]] = {
    "flat": recorded(),
    "flat-order-2": recorded(paths={"max_reflections": 2}),
    "relief": recorded(
        seabed={
            "relief": RELIEF, "cutoff_wavelength": 0.5, "scattering": {"law": "jackson", "sediment": "medium sand"}
        }
    ),
    "layered": recorded(water={"profile": PROFILE, "smoothing": 1.0}),
    "layered-relief": recorded(water={"profile": PROFILE, "smoothing": 1.0}, seabed={"relief": RELIEF}),
    "layered-relief-order-2": recorded(
        water={"profile": PROFILE, "smoothing": 1.0}, paths={"max_reflections": 2},
        seabed={"relief": {**RELIEF, "rms": "1 cm"}, "reflection": 0.9},
    ),
    "statistical-sea": recorded(surface={"reflection": "statistical", "wind_speed": 4.0}),
    "explicit-sea": recorded(surface={"reflection": "explicit", "wind_speed": 3.0}, track={"window": [0.0, 0.06]}),
    "solids": recorded(
        targets=[
            {"shape": "cylinder", "label": "log", "position": [0, 30], "length": 2.0, "diameter": 0.5},
            {"shape": "rock", "label": "rock", "position": [1, 45]},
            {"shape": "point", "label": "buoy", "position": [0, 35, 15], "target_strength_db": -20},
        ]
    ),
    "smooth-box": recorded(targets=[{**BOX, "face_reflection_coefficient": 0.8}]),
    "elements": recorded(
        sonar={"receive": LINE, "receiver": {"record": "elements"}}, track={"window": [0.0, 0.06]}
    ),
    "elements-of-a-sector": recorded(
        sonar={"receive": {**LINE, "elements": 32}, "receiver": {"record": "elements"}},
        track={"speed": 4.0, "window": [0.0, 0.06]},
    ),
    "moving-platform": recorded(
        track={"speed": 4.0, "motion": {"roll": {"rms": "2 deg", "period": 4.0}}},
        sonar={"sides": ["port", "starboard"]},
    ),
    "bistatic": recorded(receiver_track={
        "kind": "line", "start": [0, 4, 9], "heading": 0, "speed": 2.0, "pings": 2, "interval": 0.1,
        "window": [0.0, 0.08],
    }),
    "slice": recorded(
        paths={"geometry": "slice", "max_reflections": 2},
        sonar={"mounting": {"bearing": "90 deg"}},
        track={"kind": "static", "position": [0, 0, 11], "pings": 2, "interval": 0.1, "window": [0.0, 0.08]},
    ),
    "mesh": meshed,
    "compressed-sub-bands": recorded(
        sonar={
            "pulse": {"kind": "lfm", "frequency": 100e3, "duration": 2e-3, "bandwidth": 15e3},
            "receiver": {"bandwidth": 20e3, "matched_filter": True, "sub_bands": 3},
        }
    ),
    "volume-and-noise": recorded(
        water={"sound_speed": 1500.0, "volume_strength_db": -70, "noise_level_db": 40},
        sonar={"receiver": {"bandwidth": 20e3, "adc": {"full_scale_db": 190, "bits": 16}}},
        track={"window": [0.0, 0.05]},
    ),
    "tracer": recorded(field="incoherent", paths={"engine": "tracer", "rays": 20_000, "max_reflections": 1}),
    "incoherent": recorded(field="incoherent", seabed={"relief": RELIEF}, sonar={"sides": ["port", "starboard"]}),
    "incoherent-layered": recorded(field="incoherent", water={"profile": PROFILE, "smoothing": 1.0}),
    "boundary-echoes": recorded(
        seabed={"relief": RELIEF}, surface={"reflection": "statistical", "wind_speed": 1.0},
        paths={"max_reflections": 3, "contributions": ["boundary echo"]},
        sonar={"sides": ["port", "starboard"], "transmit": {"kind": "point"}},
    ),
    "labels": labelled,
    "levels": levelled,
    "arrivals": listed,
}  # fmt: skip
"""Output of each scene as a function of the number of threads."""
