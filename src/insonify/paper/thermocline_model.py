"""The paper's second model: one vertical plane, direct paths, the profile of figure 1 or none.

The paper prints its profile as a picture only. Assumed here: a summer thermocline, 1510 m/s down to 8 m and 1490 m/s
from 14 m to the bed at 20 m, with 1500 m/s at the sonar at 11 m. That is also the sound speed of the
water without a profile. Changed in the nominal scene besides: no reflections (`paths.max_reflections: 0`), a sea
surface that echoes by Lambert's law at -30 dB, and an amplitude of each replica that varies by up to 30 % at random
(`paths.amplitude_perturbation`), the paper's "less than perfect surfaces".
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from insonify.paper.nominal_scenario import nominal
from insonify.plotting import style
from insonify.plotting.rays import section, shadow_zone
from insonify.plotting.rays import speed as beside
from insonify.propagation.ray_fan import trace_fan
from insonify.propagation.sound_speed_layers import sound_speed_layers
from insonify.records.arrivals import Arrivals
from insonify.scenario.scenario import Scenario
from insonify.simulator import arrivals, build_simulator
from insonify.synthesis.arrival_weights import arrival_weights

Floats = NDArray[np.float64]
Knots = tuple[tuple[float, float], ...]

PROFILE = ((0.0, 1510.0), (8.0, 1510.0), (14.0, 1490.0), (20.0, 1490.0))
"""Depth [m] and sound speed [m/s] of the knots."""
WARM_LAYER = ((0.0, 1506.0), (9.0, 1506.0), (10.0, 1500.0), (20.0, 1500.0))
"""A profile as the paper's conclusion implies: warm water that ends above the sonar."""
SOUND_SPEED = 1500.0
"""Sound speed of the water without a profile, and at the sonar with one [m/s]."""
WINDOW = (0.195, 0.230)
"""The paper's window of 35 ms [s]."""
PERTURBATION = 0.3
"""Largest random change of each replica's amplitude [1]."""
STRENGTHS_DB = {"target": -10.0, "seabed": -27.0, "surface": -30.0}
"""Lambert strengths by contribution [dB]."""
FARTHEST = 180.0
"""Largest range of the pictures [m]."""


def layered(changes: dict[str, Any] | None = None, profile: Knots = PROFILE) -> Scenario:
    """Nominal scene with the profile.

    Args:
        changes: Other values by dotted name.
        profile: Depth [m] and sound speed [m/s] of the knots.
    """
    rows = [list(knot) for knot in profile]
    return nominal({"water.profile": rows, "water.sound_speed": None, **(changes or {})})


def scene(profile: bool | Knots, changes: dict[str, Any] | None = None) -> Scenario:
    """Scenario of the second model.

    Args:
        profile: True for the profile, False for one sound speed; or the knots of another profile.
        changes: Other values by dotted name.
    """
    fixed = {
        "paths.geometry": "slice", "paths.max_reflections": 0, "paths.amplitude_perturbation": PERTURBATION,
        "surface.scattering": {"strength_db": STRENGTHS_DB["surface"]}, "track.window": WINDOW,
    }  # fmt: skip
    values = {**fixed, **(changes or {})}
    if not profile:
        return nominal({"water.sound_speed": SOUND_SPEED, **values})
    return layered(values, PROFILE if isinstance(profile, bool) else profile)


def replica_sum(scenario: Scenario) -> NDArray[np.complex128]:
    """Coherent series by the method of the paper: the sum of all replicas at their delays, in float64 [uPa].

    Args:
        scenario: Scenario whose first ping and first beam are computed.

    Returns:
        Complex envelope at the times of the recording, shape (time,).
    """
    simulator = build_simulator(scenario)
    geometry, time = simulator.ping_geometry(0), simulator.grid.time
    paths = arrivals(scenario)
    weight = arrival_weights(paths, geometry)
    series = np.zeros(len(time), complex)
    for begin in range(0, len(paths), 500):  # a pulse with all its ringing is as long as the window
        part = slice(begin, begin + 500)
        series += weight[part] @ geometry.pulse.samples(time - paths.delay[part, None])
    return series


def thinned(paths: Arrivals) -> Arrivals:
    """Select all paths of targets, and every second of the others, for drawing."""
    return paths.take(~np.isin(paths.object, ("seabed", "surface")) | (paths.group % 2 == 0))


def draw_rays(left: Axes, right: Axes, scenario: Scenario) -> None:
    """Draw direct rays over the scene, beside the profile."""
    bed, source = scenario.seabed.depth, float(build_simulator(scenario).ping_geometry(0).transmit_position[2])
    profile = scenario.water.profile_to_depth(bed)
    water = sound_speed_layers(profile, bed)
    rays = trace_fan(water, source, np.radians(np.linspace(-20, 20, 101)), max_range=FARTHEST, max_bounces=0, step=0.5)
    beside(left, water.depth, water.speed, source)
    left.set_xlim(1486, 1514)
    dark = shadow_zone(right, profile, bed, source, FARTHEST)
    section(right, rays, bed, source, dark=dark)
    right.add_patch(Rectangle((150, bed - 1), 1, 1, color=style.CONTRIBUTION_COLOURS["target"], zorder=5))
    right.set_xlim(0, FARTHEST)
