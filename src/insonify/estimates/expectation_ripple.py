"""Ripple of an expected intensity under a statistical sea, whose glints are drawn, and a note on it for `check`."""

import math

import numpy as np

from insonify.engines.glint_spread import glint_spread
from insonify.propagation.families import families_reaching, surface_bounces
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from insonify.sonar.two_way_beam import two_way_width

MEASURED_AT = 5.0
"""Points in a resolution cell at which ripple was measured [1]: by arrays of 0.5 and 1.5 m at 100 kHz, 3 and 8 m/s."""
MIN_SPREAD = 15.0
"""Spread of the glints' bearings over the width of the beams below which no note is given [1].

At a ratio of 6, by arrays of 0.1 m at 100 kHz, samples ripple by 0.5 dB rms.
"""
ENOUGH = 40.0
"""Points in a resolution cell from which on no note is given [1]."""


def expectation_ripple(scenario: Scenario) -> str:
    """Note on the ripple of an expected intensity; empty where glints do not matter.

    A glint sends sound into one direction. Where glints spread by far more than the beams are wide, few of those drawn
    for a resolution cell are received, and its intensity varies.
    """
    paths, surface = scenario.paths, scenario.scene.surface
    off_surface = [name for name in families_reaching("seabed", paths.followed_families) if surface_bounces(name)]
    if (
        scenario.field != "incoherent" or paths.engine == "tracer" or surface.reflection != "statistical"
        or "seabed" not in paths.contributions or not off_surface or paths.scatterers_per_cell >= ENOUGH
    ):  # fmt: skip
        return ""
    here = build_simulator(scenario).ping_geometries(0)[0]
    spread, depth = glint_spread(scenario.scene, here.frequency), scenario.seabed.depth
    middle = np.array([here.sound_speed * sum(here.window) / 4])
    legs = None if spread is None else spread.legs(off_surface[0], float(here.transmit_position[2]), middle, depth)
    width = two_way_width(here.transmit_beams, here.receive_beams)
    if legs is None or float(legs.bearing_change[0]) < MIN_SPREAD * width:
        return ""
    factor = math.sqrt(MEASURED_AT / paths.scatterers_per_cell)
    return (
        "glints of the sea spread by far more than the beams are wide: samples of the expected intensity ripple by "
        f"{factor:.1f} to {2 * factor:.1f} dB rms, means over 2 ms by {0.3 * factor:.1f} to {0.6 * factor:.1f} dB; "
        f"paths.scatterers_per_cell: {ENOUGH:g} for {math.sqrt(MEASURED_AT / ENOUGH):.1f} to "
        f"{2 * math.sqrt(MEASURED_AT / ENOUGH):.1f} dB"
    )
