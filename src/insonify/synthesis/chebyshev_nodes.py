"""Chebyshev nodes along an array: points at which echoes are evaluated exactly; between them they are interpolated.

The delay of an echo at a position x along a straight array, |r u - x| / c, is analytic except at two points of the
complex plane at a distance r from the array's centre: interpolation through Chebyshev nodes converges geometrically.
The parabolic motion of each element of a rotating platform is interpolated exactly by the same weights.

Source: error of interpolation of degree n at Chebyshev nodes at most 4 M rho^-n / (rho - 1) for functions analytic, and
not larger than M, within the ellipse of sum of half axes rho; Trefethen (2013), Approximation Theory and Approximation
Practice, theorem 8.2 (not verified).
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.synthesis._echo_series_kernel import ApertureNodes

Floats = NDArray[np.float64]
ERROR = 2e-7
"""Largest error of an echo's phase at an element [cycles]."""
MAX_DEVIATION = 1e-9
"""Largest deviation of elements from a straight line, and from the interpolated parabolic motion [m]."""
MIN_NODES = 4
"""Least number of nodes [1]."""
FEW_NODES_RATIO = 18.0
"""Radius of wavefronts re half the length of an array from which on few nodes, about seven, represent it [1]."""


def aperture_nodes(
    position: Floats, velocity: Floats, acceleration: Floats, min_radius: float, latest_arrival: float,
    wavelength: float, extra_positions: Floats | None = None,
) -> ApertureNodes:  # fmt: skip
    """Chebyshev nodes of a straight array, or all elements where nodes would not be fewer.

    Args:
        position: Element positions from the array's centre, in the world, at the start of the ping [m], shape (m, 3).
        velocity: Element velocities [m/s], shape (m, 3).
        acceleration: Element accelerations [m/s^2], shape (m, 3).
        min_radius: Least radius of the received wavefronts [m].
        latest_arrival: Time of the last arrival [s].
        wavelength: Wavelength of the carrier [m].
        extra_positions: Further interpolation points along a straight array, -1..1, shape (p,); without nodes: unused.
    """
    line = straight_array(position, velocity, acceleration, latest_arrival)
    if line is not None:
        element_coordinate, ends = line
        count = chebyshev_node_count(min_radius - _drift(ends), float(np.linalg.norm(ends[1, :3])), wavelength)
        if count < len(position):
            node = np.cos((np.arange(count) + 0.5) * np.pi / count)
            positions = (
                element_coordinate if extra_positions is None else np.concatenate([element_coordinate, extra_positions])
            )
            node_motion = ends[0] + node[:, None] * ends[1]
            node_velocity = node_motion[:, 3:6] / latest_arrival
            node_acceleration = node_motion[:, 6:] / latest_arrival**2
            return ApertureNodes(
                *(
                    np.ascontiguousarray(part)
                    for part in (node_motion[:, :3], node_velocity, node_acceleration, *_chebyshev(node, positions))
                )
            )
    return ApertureNodes(position, velocity, acceleration, np.empty((0, 0)), np.empty((0, 0)))


def few_nodes_beyond(position: Floats, velocity: Floats, acceleration: Floats, latest_arrival: float) -> float:
    """Radius of wavefronts beyond which few nodes represent an array [m]; infinite for an array that is not straight.

    Args:
        position: Element positions, as for `aperture_nodes`.
        velocity: Element velocities [m/s], shape (m, 3).
        acceleration: Element accelerations [m/s^2], shape (m, 3).
        latest_arrival: Time of the last arrival [s].
    """
    line = straight_array(position, velocity, acceleration, latest_arrival)
    return math.inf if line is None else _drift(line[1]) + FEW_NODES_RATIO * float(np.linalg.norm(line[1][1, :3]))


def _drift(ends: Floats) -> float:
    """Upper bound of the displacement of an array during a ping [m], from the second result of `straight_array`."""
    return float(np.abs(ends[:, 3:]).sum(axis=1).max())


def chebyshev_node_count(min_radius: float, half: float, wavelength: float) -> int:
    """Number of nodes that represent the delays along an aperture.

    It is 2^30, more than any array has elements, where a wavefront's radius is at most the length of the aperture.

    Args:
        min_radius: Least radius of a wavefront about any position of the array's centre [m].
        half: Half the length of the aperture [m].
        wavelength: Wavelength of the carrier [m].
    """
    if min_radius <= 2 * half:
        return 1 << 30
    ratio = min_radius / half if half > 0 else math.inf
    rho = min(ratio + math.sqrt(ratio * ratio - 1), 1e9)
    error = 4 * min_radius / (rho - 1) / wavelength / ERROR
    return max(MIN_NODES, math.ceil(math.log(max(error, 1.0)) / math.log(rho)) + 1)


def straight_array(
    position: Floats, velocity: Floats, acceleration: Floats, latest_arrival: float
) -> tuple[Floats, Floats] | None:
    """Element positions along a straight array and its motion; None if the array is not straight.

    Args:
        position: Element positions, as for `aperture_nodes`.
        velocity: Element velocities [m/s], shape (m, 3).
        acceleration: Element accelerations [m/s^2], shape (m, 3).
        latest_arrival: Time of the last arrival [s].

    Returns:
        Coordinate of each element along the array, -1..1 [1], shape (m,).
        Mean, and half the difference, of the motion of the array's ends: position, velocity times `latest_arrival`,
        acceleration times its square [m], shape (2, 9).
    """
    motion = np.concatenate([position, velocity * latest_arrival, acceleration * latest_arrival**2], axis=1)
    middle = (motion[0] + motion[-1]) / 2
    half = (motion[-1] - motion[0]) / 2
    length = float(half[:3] @ half[:3])
    if len(motion) <= MIN_NODES or not length > 0:
        return None
    coordinate = (motion - middle)[:, :3] @ half[:3] / length
    if (
        np.abs(coordinate).max() > 1 + 1e-9
        or np.abs(motion - middle - coordinate[:, None] * half).max() > MAX_DEVIATION
    ):
        return None
    return coordinate, np.stack([middle, half])


def _chebyshev(node: Floats, positions: Floats) -> tuple[Floats, Floats]:
    """Matrix from node values to Chebyshev series, (terms, nodes), and polynomials at positions, (positions, terms)."""
    order = np.arange(len(node))
    at_nodes = np.cos(order[:, None] * np.arccos(node))
    polynomials = np.cos(order * np.arccos(np.clip(positions, -1, 1))[:, None])
    return at_nodes * np.where(order == 0, 1.0, 2.0)[:, None] / len(node), polynomials
