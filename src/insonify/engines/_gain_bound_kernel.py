"""Upper bound of the two-way pressure gain over neighbourhoods on a boundary: arrays only."""

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


class Neighbourhoods(NamedTuple):
    """Discs on a boundary whose bounds are to be raised: the first of n rows are in use."""

    row: Integers
    """Row of each among all neighbourhoods, (n,)."""
    centre: Floats
    """North and east of their centres [m], (n, 2)."""
    radius: Floats
    """Their radii [m], (n,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def raise_gain_bounds(
    transmit_end: BoundEnd, receive_end: BoundEnd, same_ends: bool, centre: Floats, radius: Floats,
    sufficient_gain: float, transmit: Floats, receive: Floats,
) -> None:  # fmt: skip
    """Raise bounds of both ends' pressure patterns to those of all families, or until their product is sufficient.

    Args:
        transmit_end: Transmitting end.
        receive_end: Receiving end.
        same_ends: True if these are the same; the bounds are the same array then.
        centre: North and east of the neighbourhoods' centres [m], (n, 2).
        radius: Their radii [m], (n,).
        sufficient_gain: Product of the bounds from which on no further family is evaluated [1].
        transmit: Changed: bound of the transmitting end's pressure pattern [1], (n,).
        receive: Changed: bound of the receiving end's pressure pattern [1], (n,).
    """
    n = transmit.size
    near = Neighbourhoods(np.empty(n, np.int64), np.empty((n, 2)), np.empty(n))
    rows, north_east, around = near
    for family in range(transmit_end.angles.vertical_travel.size):
        count = 0
        for row in range(n):
            if transmit[row] * receive[row] < sufficient_gain:
                rows[count], around[count] = row, radius[row]
                north_east[count, 0], north_east[count, 1], count = centre[row, 0], centre[row, 1], count + 1
        if count == 0:
            return
        _raise_bound(transmit_end, family, near, count, transmit)
        if not same_ends:
            _raise_bound(receive_end, family, near, count, receive)


@njit(cache=True, nogil=True, error_model="numpy")
def _raise_bound(end: BoundEnd, family: int, near: Neighbourhoods, count: int, bound: Floats) -> None:
    """Raise the bounds of one end in the first neighbourhoods to that of one family."""
    axis, exists = np.empty((count, 3)), np.empty(count, np.bool_)
    half_angle, gain = np.empty(count), np.empty(count)
    departure_cones(
        end.angles, family, end.position, near.centre[:count], near.radius[:count], axis, half_angle, exists
    )
    beam_bounds(axis, half_angle, end.beams, gain)
    for n in range(count):
        if exists[n]:
            bound[near.row[n]] = max(bound[near.row[n]], gain[n])


@raise_gain_bounds.stand_in
def _raise_gain_bounds(
    transmit_end: BoundEnd, receive_end: BoundEnd, same_ends: bool, centre: Floats, radius: Floats,
    sufficient_gain: float, transmit: Floats, receive: Floats,
) -> None:  # fmt: skip
    """Raise bounds; arguments are those of the kernel `raise_gain_bounds`."""
    for family in range(transmit_end.angles.vertical_travel.size):
        rows = np.flatnonzero(transmit * receive < sufficient_gain)
        axis, exists = np.empty((rows.size, 3)), np.empty(rows.size, np.bool_)
        half_angle, gain = np.empty(rows.size), np.empty(rows.size)
        for end, bound in ((transmit_end, transmit), (receive_end, receive))[: 1 if same_ends else 2]:
            departure_cones(end.angles, family, end.position, centre[rows], radius[rows], axis, half_angle, exists)
            beam_bounds(axis, half_angle, end.beams, gain)
            bound[rows] = np.maximum(bound[rows], np.where(exists, gain, 0.0))
