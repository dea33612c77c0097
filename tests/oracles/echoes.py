"""Echoes deposited pair by pair and receiver by receiver.

What quicker ways of many beams and of apertures must agree with.
"""

from typing import Any

from numba import njit
from numpy.typing import NDArray

from insonify.synthesis._arrival_kernel import (
    BLOCK,
    BlockLegs,
    ReceiveBeams,
    Reception,
    arrival_buffer,
    deposit_pair,
    nonzero_legs,
    scatterers_with_echo,
)
from insonify.synthesis._element_arrivals_kernel import PairedLegs


@njit(cache=True, nogil=True, error_model="numpy")
def spread_echoes(cells: NDArray[Any], paired: PairedLegs, receive_beams: ReceiveBeams, reception: Reception) -> None:
    """Echoes of one block by all pairs of legs, for all channels, each receiver requested by itself.

    Args:
        cells: Grids of pressure, shape (channels, groups, cells, shapes of a group): see `group_layout`.
        paired: The legs, and what each scatterer makes of each pair.
        receive_beams: Receive points and their channels.
        reception: Time grid, carrier and water.
    """
    pair, sent, received, strength = paired
    room, legs = (
        arrival_buffer(received.expansion.shape[1], cells.shape[1]),
        BlockLegs(sent, received),
    )
    outs, backs, receivable = nonzero_legs(sent, received)
    for begin in range(0, strength.shape[1], BLOCK):
        end = min(begin + BLOCK, strength.shape[1])
        for p in range(pair.shape[0]):
            i, j, row = pair[p]
            count = scatterers_with_echo(
                begin,
                strength[p, begin:end],
                outs[i, begin:end],
                backs[j, begin:end],
                receivable[row, begin:end],
                room.scatterer,
            )
            for k in range(count):
                room.strength[k] = strength[p, room.scatterer[k]]
            if count > 0:
                deposit_pair(cells, (i, j, row), count, room, legs, receive_beams, reception)
