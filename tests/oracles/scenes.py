"""The paper's nominal scene, and ways to receive less than all of it. Built from the project's own models."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator

BED = {"depth": 20.0, "scattering": {"law": "lambert", "strength_db": -27.0}, "reflection": 0.35}
BOX = {"shape": "box", "position": (0.0, 150.5), "size": (2.0, 1.0, 1.0)}
SCATTERED = ("seabed", "surface", "target", "water")
"""All contributions but the boundary echoes."""
PULSE = {"kind": "cw", "frequency": 100e3, "duration": 0.2e-3, "taper": "tukey", "taper_fraction": 0.2}


def nominal(*, box=None, line=None, transmit=None, receive=None, paths=None, track=None, sonar=None, **top):
    """The nominal scene, silent water, 11 m deep sonar over a bed at 20 m; no target unless requested; hard shadows.

    Args:
        box: Changes to the nominal box; None for no box.
        line: Changes to both line arrays.
        transmit: Changes to the transmit array.
        receive: Changes to the receive array.
        paths: Changes to the choice of paths.
        track: Changes to the track.
        sonar: Changes to the sonar.
        top: Changes to the scenario itself.
    """
    array = {"kind": "line", "length": 1.5, **(line or {})}
    ends = {
        end: {key: value for key, value in {**array, **(change or {})}.items() if value is not None}
        for end, change in (("transmit", transmit), ("receive", receive))
    }
    sonar = sonar or {}
    receiver = {"sub_bands": 1, **sonar.get("receiver", {})}  # closed forms have one beam for the whole band
    described = {
        "water": {"noise_level_db": None},
        "targets": [] if box is None else [{**BOX, **box}],
        "sonar": {"source_level_db": 220, "pulse": PULSE, **ends, **sonar, "receiver": receiver},
        "track": {"kind": "static", "position": (0.0, 0.0, 11.0), **(track or {})},
        "paths": {"edge_diffraction": "none", "contributions": SCATTERED, **(paths or {})},
        **top,
        "seabed": {**BED, **top.get("seabed", {})},
    }
    return Scenario(**described)


def point(north, east, depth, *, strength=0.0, label="point"):
    """A point target, as the scenario describes it."""
    return {"shape": "point", "label": label, "position": (north, east, depth), "target_strength_db": strength}


def receive_blocks(scenario, blocks, ping=0, field="coherent"):
    """What one ping sounds like if the scene offered these scatterers and no others."""
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(ping)
    accumulator = getattr(simulator, f"{field}_accumulator")(here)
    total = accumulator.empty()
    for block in blocks:
        accumulator.add(total, simulator.engine.path_pairs(here, block))
    return accumulator.time_series(total)


def each_ping(scenarios, work, threads=2):
    """Results of `work` on scenarios, in order, two at a time."""
    with ThreadPoolExecutor(threads) as pool:
        return np.array(list(pool.map(work, scenarios)))
