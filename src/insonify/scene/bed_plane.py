"""Planes that stand for uneven ground where sound bounces: fitted to the resolved bed over an ellipse.

A bounce sees the ground of its first Fresnel zone as one mirror. Waves longer than the zone raise and tilt it; shorter
ones roughen it, and are in the account of `Bed.smoothness`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.scene._plane_kernel import fit_ellipses
from insonify.scene.bed import Bed

Floats = NDArray[np.float64]

_GOLDEN = 0.6180339887498949


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


PATTERN, FEW = _pattern(4), _pattern(1)
"""Where an ellipse is sampled, as parts of its half axes [1]: 32 places, and 8; then the sums of their squares."""


class Planes(NamedTuple):
    """A plane for each of n places."""

    height: Floats
    """Above the mean plane at the place itself, positive up [m], shape (n,)."""
    slope: Floats
    """Gradient of the height to the north and the east [1], shape (n, 2)."""

    left: Floats
    """Mean square of the resolved ground about the plane [m^2], shape (n,)."""

    @property
    def normal(self) -> Floats:
        """Unit normal from the bed into the water, in north, east, down, shape (n, 3)."""
        up = np.concatenate([-self.slope, np.full((len(self.slope), 1), -1.0)], axis=1)
        return np.asarray(up / np.linalg.norm(up, axis=1, keepdims=True))


def fitted_planes(
    bed: Bed, place: Floats, bearing: Floats, half_length: Floats, half_width: Floats, *, rough: bool = False
) -> Planes:
    """The planes of least squares to the resolved bed over ellipses about some places.

    Args:
        bed: The ground.
        place: North and east of the middle of each ellipse [m], shape (n, 2).
        bearing: Of its long axis [rad], shape (n,).
        half_length: Half its length [m], shape (n,); no shorter than an eighth of the ground's shortest wave is taken.
        half_width: Half its width [m], shape (n,), likewise.
        rough: Whether 8 samples of each will do, not 32.

    Returns:
        Planes by samples of the map of heights that shadows are found on. Where nobody knows the ground, the
        mean plane.
    """
    lattice = bed.ground.terrain.lattice
    own, turn, least = lattice.from_world(place), bearing - lattice.heading, least_half_axis(bed)
    columns = (*own.T, np.cos(turn), np.sin(turn), np.maximum(half_length, least), np.maximum(half_width, least))
    ellipses = np.stack(columns, axis=-1)
    found, done = np.empty((len(ellipses), 4)), np.zeros(len(ellipses), bool)
    if not len(ellipses):
        return Planes(found[:, 0], found[:, 1:3], found[:, 3])
    pattern = FEW if rough else PATTERN
    bed.asked(own, lambda pages, wanted: fit_ellipses(ellipses, pattern, pages, wanted, done, found))
    c, s, along, across = np.cos(bearing), np.sin(bearing), found[:, 1], found[:, 2]
    return Planes(found[:, 0], np.stack([c * along - s * across, s * along + c * across], axis=-1), found[:, 3])


def least_half_axis(bed: Bed) -> float:
    """Half axis below which ellipses are not told apart [m]: an eighth of the ground's shortest wave."""
    return bed.ground.finest / 8
