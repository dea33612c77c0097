"""Everything at once: a moving two-sided sonar over fractal and rippled ground, with bodies of all kinds about it."""

import warnings
from math import cos, sin

from oracles.scenes import nominal

THERMOCLINE = [[0.0, 1510.0], [8.0, 1510.0], [14.0, 1490.0], [20.0, 1490.0]]
ALMOST_EVEN = [[0.0, 1500.0], [20.0, 1500.001]]
RELIEF = ({"kind": "power-law", "hurst": 0.8, "rms": 0.1, "outer_scale": 20.0},
          {"kind": "ripples", "wavelength": 1.2, "height": 0.05, "direction": 0.6})  # fmt: skip
MOTION = {"heave": {"rms": 0.1, "period": 4.0}, "roll": {"rms": 0.02, "period": 5.0}}
TETRAHEDRON = """v 0.8 0 0\nv -0.8 0.7 0\nv -0.8 -0.7 0\nv 0 0 1.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"""
BODIES = (
    {"shape": "box", "label": "box", "position": (0.3, 40.0), "size": (2.0, 1.0, 1.0), "heading": 0.2},
    {"shape": "cylinder", "label": "log", "position": (0.6, 35.0), "length": 2.0, "diameter": 0.5, "heading": 0.5},
    {"shape": "sphere", "label": "ball", "position": (0.5, 46.0), "diameter": 1.0, "heading": 0.0},
    {"shape": "drum", "label": "drum", "position": (0.4, -38.0), "heading": 0.0},
)


def harbour(*, water, folder=None, turn=0.0, shift=(0.0, 0.0), window=(0.044, 0.064), pings=3, motion=True,
            **changes):  # fmt: skip
    """The scene, as a whole turned by an angle [rad] and then moved [m].

    Args:
        water: The water.
        folder: Where the mesh may be written; None: no mesh.
        turn: Angle [rad].
        shift: North and east [m].
        window: What is recorded [s].
        pings: How many.
        motion: Whether the ship heaves and rolls.
        changes: Changes to the scenario.
    """

    def put(north, east):
        return (shift[0] + cos(turn) * north - sin(turn) * east, shift[1] + sin(turn) * north + cos(turn) * east)

    bodies = list(BODIES)
    if folder is not None:
        (folder / "hull.obj").write_text(TETRAHEDRON)
        bodies.append({"shape": "mesh", "label": "hull", "position": (-0.2, 43.0), "file": str(folder / "hull.obj"),
                       "heading": 0.3})  # fmt: skip
    targets = [{**body, "position": put(*body["position"]), "heading": body["heading"] + turn} for body in bodies]
    relief = (RELIEF[0], {**RELIEF[1], "direction": RELIEF[1]["direction"] + turn})
    seabed = {"relief": relief, "seed": 5, "scatterer_grid": {"origin": shift, "heading": turn}}
    scenario = nominal(
        water={"noise_level_db": None, **water}, seabed=seabed, targets=targets,
        sonar={"sides": ["port", "starboard"]}, paths={"max_reflections": 2}, **changes,
    )  # fmt: skip
    track = {"kind": "line", "start": (*put(0.0, 0.0), 11.0), "heading": turn, "speed": 2.0, "pings": pings,
             "window": window, "motion": MOTION if motion else {}}  # fmt: skip
    return type(scenario)(**{**scenario.model_dump(), "track": track})


def quiet_harbour(**settings):
    """`harbour` without warnings: its profile has corners, and is meant to."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return harbour(**settings)
