"""Sample points of local planes: over an ellipse of the resolved terrain about a bounce.

A bounce is a specular reflection at one plane, fitted to the terrain over its first Fresnel zone. Waves of the relief
longer than the zone shift and tilt the plane; shorter ones reduce the coherent reflection by
`SeabedTerrain.roughness_reflection_factor`.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.scene.seabed_terrain import SeabedTerrain

Floats = NDArray[np.float64]

_GOLDEN = 0.6180339887498949
"""Golden ratio less 1: its multiples modulo 1 are evenly distributed."""


def _pattern(count: int) -> Floats:
    """Samples of the unit disc, evenly over its area and symmetric about both axes and diagonals, (8 count + 1, 2).

    The last row holds the sums of their squares.
    """
    number = np.arange(count)
    radius, turn = np.sqrt((number + 0.5) / count), np.pi / 4 * np.mod((number + 0.5) * _GOLDEN, 1)
    eighth = radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    quarter = np.concatenate([eighth, eighth[:, ::-1]])
    disc = np.concatenate([quarter * (side, other) for side in (1, -1) for other in (1, -1)])
    return np.concatenate([disc, np.sum(disc**2, axis=0, keepdims=True)])


FINE_PATTERN, COARSE_PATTERN = _pattern(4), _pattern(1)
"""Sample points of an ellipse re its half axes [1]: 32 points and 8; the last row has the sums of their squares."""


def min_half_axis(terrain: SeabedTerrain) -> float:
    """Half axis below which ellipses are not distinguished [m]: an eighth of the terrain's shortest wave."""
    return terrain.relief.shortest_wavelength / 8
