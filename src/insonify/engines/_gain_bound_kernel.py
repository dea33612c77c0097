"""Upper bound of the two-way gain over neighbourhoods on a boundary: arrays only."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.departure_cone_kernel import DepartureAngles, departure_cones
from insonify.sonar.beam_kernels import BeamMajorants, beam_bounds

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class BoundEnd(NamedTuple):
    """One end of the sonar, and the rays that leave it for a boundary: f families."""

    position: Floats
    """North, east, depth [m], (3,)."""
    angles: DepartureAngles
    """Departure of the rays of each family."""
    beams: BeamMajorants
    """Its beams."""


@njit(cache=True, nogil=True, error_model="numpy")
def raise_gain_bounds(
    transmit_end: BoundEnd, receive_end: BoundEnd, same_ends: bool, centre: Floats, radius: Floats,
    sufficient_gain: float, transmit: Floats, receive: Floats,
) -> None:  # fmt: skip
    """Raise bounds of the gain of both ends to those of all families, or until their product is sufficient.

    Args:
        transmit_end: Transmitting end.
        receive_end: Receiving end.
        same_ends: True if these are the same; the bounds are the same array then.
        centre: North and east of the neighbourhoods' centres [m], (n, 2).
        radius: Their radii [m], (n,).
        sufficient_gain: Product of the bounds from which on no further family is evaluated [1].
        transmit: Changed: bound of the gain of the transmitting end [1], (n,).
        receive: Changed: bound of the gain of the receiving end [1], (n,).
    """
    for family in range(transmit_end.angles.vertical_travel.size):
        rows = np.flatnonzero(transmit * receive < sufficient_gain)
        if rows.size == 0:
            return
        _raise_bound(transmit_end, family, rows, centre[rows], radius[rows], transmit)
        if not same_ends:
            _raise_bound(receive_end, family, rows, centre[rows], radius[rows], receive)


@njit(cache=True, nogil=True, error_model="numpy")
def _raise_bound(end: BoundEnd, family: int, rows: Integers, centre: Floats, radius: Floats, bound: Floats) -> None:
    """Raise the bounds of one end in some rows to that of one family."""
    axis, exists = np.empty((rows.size, 3)), np.empty(rows.size, np.bool_)
    half_angle, gain = np.empty(rows.size), np.empty(rows.size)
    departure_cones(end.angles, family, end.position, centre, radius, axis, half_angle, exists)
    beam_bounds(axis, half_angle, end.beams, gain)
    bound[rows] = np.maximum(bound[rows], np.where(exists, gain, 0.0))


raise_gain_bounds.stand_in(raise_gain_bounds.py_func)
_raise_bound.stand_in(_raise_bound.py_func)
