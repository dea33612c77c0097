"""Where along an array echoes are worked out, to be known at each of its elements.

The delay of an echo at a place x along a straight array, |r u - x| / c, is analytic but for places a distance r from
the array in the complex plane: polynomials through Chebyshev's nodes come as close to it as a geometric series goes.
Elements of a body that turns run on parabolas that are the same mix of those of the nodes.

Source: error of interpolation at Chebyshev nodes at most 4 M rho^-n / (rho - 1) for functions analytic within the
ellipse of sum of half axes rho; Trefethen (2013), Approximation Theory and Approximation Practice, theorem 8.2 (from
memory).
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.synthesis._element_arrivals_kernel import ApertureNodes

Floats = NDArray[np.float64]
ERROR = 2e-7
"""Of an echo's phase at an element [cycles]."""
STRAIGHT = 1e-9
"""How far elements may be from a straight line [m], and from the parabolas of places along it."""
FEWEST = 4
"""Nodes at least [1]."""


def aperture_nodes(
    position: Floats, velocity: Floats, acceleration: Floats, min_radius: float, latest_arrival: float,
    wavelength: float,
    extra_positions: Floats | None = None,
) -> ApertureNodes:  # fmt: skip
    """Where echoes are worked out: at a few nodes of a straight array, or at all elements.

    Args:
        position: Of the elements, from the array's centre, in the world, at the start of the ping [m], shape (m, 3).
        velocity: Likewise [m/s], shape (m, 3).
        acceleration: Likewise [m/s^2], shape (m, 3).
        min_radius: Least radius of the wavefronts that come back [m].
        latest_arrival: When the last of them comes [s].
        wavelength: Of the carrier [m].
        extra_positions: Other places along a straight array to be told of, -1..1, shape (p,); they are told by nodes
            alone.
    """
    along = straight_array(position, velocity, acceleration, latest_arrival)
    if along is not None:
        t, ends = along
        drift = float(np.abs(ends[:, 3:]).sum(axis=1).max())
        count = chebyshev_node_count(min_radius - drift, float(np.linalg.norm(ends[1, :3])), wavelength)
        if count < len(position):
            node = np.cos((np.arange(count) + 0.5) * np.pi / count)
            mix = _lagrange(node, t if extra_positions is None else np.concatenate([t, extra_positions]))
            here = ends[0] + node[:, None] * ends[1]
            speed, growth = here[:, 3:6] / latest_arrival, here[:, 6:] / latest_arrival**2
            return ApertureNodes(*(np.ascontiguousarray(part) for part in (here[:, :3], speed, growth, mix)))
    return ApertureNodes(position, velocity, acceleration, np.eye(len(position)))


def chebyshev_node_count(min_radius: float, half: float, wavelength: float) -> int:
    """How many nodes tell the delays along an aperture; very many where wavefronts are not much larger than it.

    Args:
        min_radius: Least radius of a wavefront about any place that the array's centre comes to [m].
        half: Half the length of the aperture [m].
        wavelength: Of the carrier [m].
    """
    if min_radius <= 2 * half:
        return 1 << 30
    ratio = min_radius / half if half > 0 else math.inf
    rho = min(ratio + math.sqrt(ratio * ratio - 1), 1e9)
    error = 4 * min_radius / (rho - 1) / wavelength / ERROR
    return max(FEWEST, math.ceil(math.log(max(error, 1.0)) / math.log(rho)) + 1)


def straight_array(
    position: Floats, velocity: Floats, acceleration: Floats, latest_arrival: float
) -> tuple[Floats, Floats] | None:
    """Places of elements along a straight array, -1..1, and its middle and half (2, 9); none if it is not straight.

    Args:
        position: As of `aperture_nodes`.
        velocity: Likewise.
        acceleration: Likewise.
        latest_arrival: Likewise.
    """
    motion = np.concatenate([position, velocity * latest_arrival, acceleration * latest_arrival**2], axis=1)
    middle = (motion[0] + motion[-1]) / 2
    half = (motion[-1] - motion[0]) / 2
    length = float(half[:3] @ half[:3])
    if len(motion) <= FEWEST or not length > 0:
        return None
    t = (motion - middle)[:, :3] @ half[:3] / length
    if np.abs(t).max() > 1 + 1e-9 or np.abs(motion - middle - t[:, None] * half).max() > STRAIGHT:
        return None
    return t, np.stack([middle, half])


def _lagrange(node: Floats, positions: Floats) -> Floats:
    """What the value at each of some Chebyshev nodes counts for elsewhere, shape (nodes, places)."""
    order = np.arange(len(node))
    at_nodes = np.cos(order[:, None] * np.arccos(node))
    waves = np.cos(order[:, None] * np.arccos(np.clip(positions, -1, 1)))
    weight = np.where(order == 0, 1.0, 2.0) / len(node)
    return np.asarray((at_nodes * weight[:, None]).T @ waves)
