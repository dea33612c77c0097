"""Work of legs off explicit waves: nodes of the search for bounce points, and the bounce points themselves.

Ends in one cell share a search. The mean number of bounce points is that of crossings of the slope that reflects.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.estimates import unit_costs
from insonify.propagation.explicit_surface import (
    MAX_BOUNCE_POINTS,
    MOST_NODES,
    NODES,
    SHARED,
    bounce_range_for_slope,
    explicit_waves,
)
from insonify.simulator import Simulator

Floats = NDArray[np.float64]

SLOPES, DISTANCES = 41, 8
"""Slopes and distances at which the search is evaluated [1]."""
NEWTON_STEPS = 5
"""Evaluations of the surface for each bounce point, about [1]."""
SPREAD = 6.0
"""Rows of bounce points beyond the first, over the root of their mean number beyond one, about [1]."""


def wave_leg_seconds(
    simulator: Simulator, sonar_depth: float, depth: float, distance: Floats, cell: Floats
) -> Floats:  # fmt: skip
    """Processor time of one leg off explicit waves, there and back [s], shape (n,).

    Args:
        simulator: A prepared scenario.
        sonar_depth: Depth of the sonar [m].
        depth: Depth of the legs' other ends [m].
        distance: Horizontal distance of these [m], shape (n,).
        cell: Area for each of them; infinite where none are neighbours [m^2], shape (n,).
    """
    scenario = simulator.scenario
    sea = explicit_waves(scenario.surface, scenario.seed, scenario.seabed.depth)
    at = np.unique(np.linspace(float(distance.min()), float(distance.max()), DISTANCES))
    found = np.array([_nodes_and_bounces(sea.waves, sea.max_slope, sea.shortest_wavelength, sonar_depth, depth, one)
                      for one in at])  # fmt: skip
    nodes, bounces = (np.interp(distance, at, column) for column in found.T)
    neighbours = np.maximum((sea.shortest_wavelength / SHARED) ** 2 / cell, 1e-9)
    searches = -np.expm1(-neighbours) / neighbours
    each = sea.waves.shape[1] * unit_costs.SECONDS_PER_WAVE + unit_costs.SECONDS_PER_WAVE_NODE
    rows = np.minimum(SPREAD * np.sqrt(np.maximum(bounces - 1, 0.0)), MAX_BOUNCE_POINTS - 1)
    return np.asarray(
        2 * (each * (searches * nodes + NEWTON_STEPS * bounces) + rows * unit_costs.SECONDS_PER_BOUNCE_ROW)
    )


def _nodes_and_bounces(
    waves: Floats, steepest: float, shortest: float, above: float, below: float, distance: float
) -> tuple[float, float]:  # fmt: skip
    """Nodes of one search for bounce points, and their mean number [1].

    Args:
        waves: Waves, see `ExplicitWaves`, shape (5, m).
        steepest: Largest slope of the search [1].
        shortest: Shortest wavelength [m].
        above: Depth of one end [m].
        below: Depth of the other [m].
        distance: Horizontal distance between them [m].
    """
    slope = np.linspace(-steepest, steepest, SLOPES)
    track = np.array([bounce_range_for_slope(float(one), distance, above, below) for one in slope])
    step = shortest / NODES
    nodes = min(abs(track[-1] - track[0]) / step + 4, MOST_NODES)
    number = 2 * np.pi * np.hypot(waves[0], waves[1])
    slope_variance = float(np.sum((waves[4] * number) ** 2)) / 4  # along one of all directions
    curvature = np.sqrt(3 / 16 * float(np.sum((waves[4] * number**2) ** 2)))
    density = np.exp(-(slope**2) / (2 * slope_variance)) / np.sqrt(2 * np.pi * slope_variance)
    reflecting = np.abs(np.gradient(slope, track))  # change of the slope that reflects, along the track
    ratio = reflecting / curvature
    difference = curvature * np.sqrt(2 / np.pi + ratio**2)  # mean of |curvature - its own|, within a tenth
    return nodes, max(float(np.abs(np.trapezoid(density * difference, track))), 1.0)
