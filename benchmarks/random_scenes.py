"""Random valid scenarios: every feature at any value, small enough for one ping in some seconds."""

import math
import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

Description = dict[str, Any]

SOUND_SPEED = 1500.0
"""Nominal, for wavelengths and windows [m/s]."""
SEDIMENTS = ("rock", "gravel", "coarse sand", "medium sand", "fine silt", "clay")
LIBRARY = ("rock", "drum", "manta", "tyre", "anchor", "rockan", "cylinder_mine", "pipe")
SHORTEST_WINDOW = 6e-4
"""Window of a small scene, where its pulse is short [s]."""
SMOOTH_LARGEST = 1.5
"""Largest smooth target [m]."""
TETRAHEDRON = """v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""
"""A mesh in OBJ."""


def random_description(seed: int, folder: Path) -> Description:
    """Contents of a random scenario file; not all are valid, for features exclude one another.

    Args:
        seed: Number of the scene.
        folder: Folder that files named by the scenario are written to.
    """
    draw = _Draw(seed)
    frequency = draw.log(20e3, 900e3)
    wavelength, depth = SOUND_SPEED / frequency, draw.log(4, 40)
    reach = draw.log(8, 60)
    sonar_depth = depth * draw.between(0.1, 0.85)
    field = "incoherent" if draw.chance(0.3) else "coherent"
    found: Description = {
        "title": f"Random scene {seed}",
        "seed": draw.random.randrange(1000),
        "water": _water(draw, depth),
        "seabed": _seabed(draw, depth),
        "surface": _surface(draw),
        "targets": [
            _target(draw, number, depth, reach, folder) for number in range(draw.one((0, 0, 1, 1, 2, 3)))
        ],
        "sonar": _sonar(draw, frequency, wavelength),
        "track": _track(draw, sonar_depth, reach),
        "paths": _paths(draw, field),
        "field": field,
        "output": {"labels": draw.chance(0.25)},
    }  # fmt: skip
    if draw.chance(0.1) and "sides" not in found["sonar"]:
        position = [draw.between(-5, 5), draw.between(-5, 5), depth * draw.between(0.1, 0.85)]
        found["receiver_track"] = {"kind": "static", "position": position}
    if draw.chance(0.15):
        found["water"]["patches"] = [_patch(draw, depth, reach)]
    return _reconciled(found)


def small_description(seed: int, folder: Path) -> Description:
    """Contents of a random scenario file of two pings and a short window, most often at its first target.

    Args:
        seed: Number of the scene.
        folder: Folder that files named by the scenario are written to.
    """
    found, draw = random_description(seed, folder), _Draw(-1 - seed)
    track, first = found["track"], found["track"]["window"][1] * draw.between(0.3, 0.9)
    if found["targets"] and draw.chance(0.7):
        first = 2 * math.hypot(*found["targets"][0]["position"][:2], found["seabed"]["depth"] / 4) / SOUND_SPEED
    length = max(SHORTEST_WINDOW, 1.5 * found["sonar"]["pulse"]["duration"])
    track |= {"window": [max(first - SHORTEST_WINDOW / 2, 0), first + length], "pings": 2}
    return found


def _reconciled(found: Description) -> Description:
    """The description without the most frequent contradictions between features drawn independently."""
    paths, receiver, surface = found["paths"], found["sonar"]["receiver"], found["surface"]
    if found["field"] == "incoherent" or paths.get("geometry") == "slice":
        receiver.pop("sub_bands", None)
        receiver.pop("record", None)
    if "record" in receiver:
        found["output"]["labels"] = False
    if "engine" in paths:
        found["water"].pop("profile", None)
        found["water"].pop("smoothing", None)
    if paths.get("geometry") == "slice" or "engine" in paths:
        found["surface"] = surface = {"reflection": "flat"}
        found["water"].pop("volume_strength_db", None)
        found["water"].pop("patches", None)
        found["track"].pop("motion", None)
        found["sonar"].pop("sides", None)
    if surface["reflection"] == "explicit":
        found["water"].pop("profile", None)
        found["water"].pop("smoothing", None)
        paths["max_reflections"] = min(paths["max_reflections"], 1)
    return found


class _Draw:
    """Random numbers of one scene."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)

    def chance(self, probability: float) -> bool:
        """Return True with a probability."""
        return self.random.random() < probability

    def between(self, low: float, high: float) -> float:
        """A number, uniform, of four digits."""
        return float(f"{self.random.uniform(low, high):.4g}")

    def log(self, low: float, high: float) -> float:
        """A number, uniform in its logarithm, of four digits."""
        return float(f"{low * (high / low) ** self.random.random():.4g}")

    def one(self, values: Sequence[Any]) -> Any:
        """One of some values."""
        return self.random.choice(values)


def _water(draw: _Draw, depth: float) -> Description:
    found: Description = {"temperature": f"{draw.between(0, 25)} degC"}
    if draw.chance(0.3):
        count = draw.one((2, 3, 5))
        found["profile"] = [[depth * row / (count - 1), draw.between(1480, 1520)] for row in range(count)]
        if draw.chance(0.5):
            found["smoothing"] = depth * draw.between(0.03, 0.15)
    if draw.chance(0.15):
        found["volume_strength_db"] = draw.between(-95, -60)
    if draw.chance(0.15):
        found["inhomogeneity"] = {"rms_index": draw.log(1e-6, 1e-4), "correlation_length": draw.log(0.5, 5)}
    if draw.chance(0.4):
        found["noise_level_db"] = draw.between(10, 50)
    elif draw.chance(0.3):
        found["noise"] = {"wind_speed": draw.between(1, 15)}
    return found


def _patch(draw: _Draw, depth: float, reach: float) -> Description:
    height = depth * draw.between(0.1, 0.3)
    position = [draw.between(-5, 5), reach * draw.between(0.2, 1), depth * draw.between(0.3, 0.7)]
    return {"label": "school", "position": position, "size": [draw.log(1, 10), draw.log(1, 10), height],
            "volume_strength_db": draw.between(-60, -35)}  # fmt: skip


def _seabed(draw: _Draw, depth: float) -> Description:
    relief = []
    if draw.chance(0.3):
        relief.append({"kind": "power-law", "hurst": draw.between(0.4, 0.9), "rms": draw.log(0.01, 0.2),
                       "outer_scale": draw.log(5, 40)})  # fmt: skip
    if draw.chance(0.25):
        length = draw.log(0.6, 6)
        relief.append({"kind": "ripples", "wavelength": length, "height": length * draw.between(0.01, 0.1),
                       "direction": f"{draw.between(0, 180)} deg"})  # fmt: skip
    law: Description | None = {"law": "lambert", "strength_db": draw.between(-40, -15)}
    if draw.chance(0.4):
        law = {"law": draw.one(("jackson", "small-slope", "sediment-volume")), "sediment": draw.one(SEDIMENTS)}
    elif draw.chance(0.05):
        law = None
    found: Description = {"depth": depth, "scattering": law}
    found["reflection"] = draw.one(SEDIMENTS) if draw.chance(0.4) else draw.between(0, 0.9)
    if relief:
        found["relief"] = relief
    if draw.chance(0.15):
        found["texture"] = {"k_shape": draw.log(0.5, 20), "correlation_length": draw.log(0.3, 5)}
    return found


def _surface(draw: _Draw) -> Description:
    bounce = draw.one(("flat", "flat", "statistical", "statistical", "tilted", "explicit"))
    found: Description = {"reflection": bounce}
    wind = draw.between(1.5, 8)
    if bounce in ("statistical", "explicit"):
        found["wind_speed"] = wind
    if bounce == "tilted" or (bounce == "explicit" and draw.chance(0.3)):
        found["swell"] = {"height": draw.log(0.05, 0.4), "length": draw.log(30, 120)}
        found["wave_direction"] = f"{draw.between(0, 359)} deg"
    if draw.chance(0.25):
        found["scattering"] = {"law": "apl-surface", "wind_speed": wind}
    return found


def _target(draw: _Draw, number: int, depth: float, reach: float, folder: Path) -> Description:
    distance, bearing = reach * draw.between(0.15, 1.0), draw.between(-0.6, 0.6)
    position = [round(distance * bearing, 3), round(distance, 3)]
    kind = draw.one(("point", "point", "box", "box", "sphere", "cylinder", "cone", "plate", "mesh", "library"))
    if kind == "point":
        where = [*position, round(depth * draw.between(0.1, 0.95), 3)]
        return {"shape": "point", "label": f"point {number}", "position": where,
                "target_strength_db": draw.between(-40, 5)}  # fmt: skip
    size = [draw.log(0.2, 2.5) for _ in range(3)]
    found: Description = {"shape": kind, "label": f"{kind} {number}", "position": position,
                          "heading": f"{draw.between(0, 360)} deg"}  # fmt: skip
    found |= {
        "box": {"size": size},
        "sphere": {"diameter": size[0]},
        "cylinder": {"length": size[0], "diameter": size[1] / 2},
        "cone": {"height": size[0], "diameter": size[1]},
        "plate": {"length": size[0], "width": size[1]},
        "mesh": {"file": "mesh.obj", "scale": size[0]},
        "library": {"name": draw.one(LIBRARY)},
    }[kind]
    if kind == "mesh":
        (folder / "mesh.obj").write_text(TETRAHEDRON, encoding="utf-8")
    if draw.chance(0.3):
        found["burial"] = draw.between(0.05, 0.6)
    if draw.chance(0.25) and max(size) < SMOOTH_LARGEST:
        found["face_reflection_coefficient"] = draw.between(-1, 1)
    return found


def _array(draw: _Draw, wavelength: float, waves: float) -> Description:
    length = min(waves * wavelength, 3.0)
    kind = draw.one(("line", "line", "planar", "planar", "planar", "point"))
    if kind == "point":
        return {"kind": "point", "element": "baffled"}
    shading = {"shading": draw.one(("uniform", "uniform", "hann", "taylor"))}
    if kind == "line":
        return {"kind": "line", "length": length, **shading}
    return {"kind": "planar", "width": length, "height": wavelength * draw.log(2, 20), **shading}


def _sonar(draw: _Draw, frequency: float, wavelength: float) -> Description:
    transmit, receive = _array(draw, wavelength, draw.log(5, 150)), _array(draw, wavelength, draw.log(8, 150))
    receiver: Description = {}
    if draw.chance(0.12):
        count = draw.one((2, 4, 8, 16))
        receive = {"kind": "line", "length": count * wavelength / 2, "elements": count}
        receiver["record"] = "elements"
    elif receive["kind"] != "point" and draw.chance(0.3):
        receive["steer"] = [f"{draw.between(-30, 30)} deg" for _ in range(draw.one((1, 2, 5)))]
    if draw.chance(0.5):
        band = frequency * draw.between(0.03, 0.12)
        pulse: Description = {"kind": "lfm", "bandwidth": band, "duration": draw.log(20, 150) / band}
        receiver["matched_filter"] = draw.chance(0.4)
    else:
        pulse = {"kind": "cw", "duration": draw.log(8, 150) / frequency}
        band = 2 / pulse["duration"]
    receiver["bandwidth"] = 1.5 * band
    if draw.chance(0.15):
        receiver["sub_bands"] = draw.one((2, 3))
    if draw.chance(0.2):
        receiver["self_noise"] = {"level_db": draw.between(10, 40)}
    if draw.chance(0.15):
        receiver["adc"] = {"full_scale_db": draw.between(140, 200), "bits": draw.one((8, 12, 16))}
    found: Description = {
        "source_level_db": draw.between(190, 225),
        "pulse": {"frequency": frequency, **pulse},
        "transmit": transmit,
        "receive": receive,
        "receiver": receiver,
        "mounting": {"bearing": "90 deg", "tilt": f"{draw.between(0, 60)} deg"},
    }
    if draw.chance(0.2):
        found["sides"] = ["port", "starboard"]
    return found


def _track(draw: _Draw, depth: float, reach: float) -> Description:
    last = 2 * reach / SOUND_SPEED
    first = last * draw.one((0, 0, draw.between(0.1, 0.7)))
    shared: Description = {"window": [first, last], "pings": 1, "interval": last * 1.5}
    if draw.chance(0.5):
        return {"kind": "static", "position": [0, 0, depth], **shared}
    found = {"kind": "line", "start": [0, 0, depth], "heading": f"{draw.between(-20, 20)} deg",
             "speed": draw.between(0.2, 5), **shared}  # fmt: skip
    if draw.chance(0.5):
        found["motion"] = {"roll": {"rms": f"{draw.between(0.1, 3)} deg", "period": draw.between(3, 9)}}
    if draw.chance(0.3):
        found["stop_and_hop"] = True
    return found


def _paths(draw: _Draw, field: str) -> Description:
    found: Description = {
        "max_reflections": draw.one((0, 1, 1, 2, 2, 3)),
        "scatterers_per_cell": draw.log(1, 8),
        "beam_cutoff_db": draw.between(-60, -25),
        "edge_diffraction": draw.one(("knife-edge", "none")),
    }
    if draw.chance(0.08):
        found["geometry"] = "slice"
    elif field == "incoherent" and draw.chance(0.15):
        found |= {"engine": "tracer", "rays": draw.one((20_000, 100_000))}
    if draw.chance(0.1):
        found["importance_sampling"] = False
    if draw.chance(0.1):
        found["jitter"] = draw.between(0, 0.5)
    if draw.chance(0.1):
        found["contributions"] = draw.one((["seabed"], ["target"], ["seabed", "target"], ["surface"]))
    return found
