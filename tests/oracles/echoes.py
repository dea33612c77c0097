"""Echoes laid down pair by pair and ear by ear: what quicker ways of many beams and of apertures must agree with."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.synthesis._arrival_kernel import (
    BLOCK,
    Floats,
    Integers,
    ReceiveBeams,
    ReceiveLegs,
    TransmitLegs,
    arrival_buffer,
    deposit_pair,
    nonzero_legs,
    scatterers_with_echo,
)


@njit(cache=True, nogil=True, error_model="numpy")
def spread_echoes(
    cells: NDArray[np.complex64],
    first_time: float,
    cell_rate: float,
    pair: Integers,
    sent: TransmitLegs,
    heard: ReceiveLegs,
    strength: NDArray[Any],
    ears: ReceiveBeams,
    slowness: float,
    gradient: float,
    loss: float,
    bent: bool,
    middle: float,
    frequency: float,
    node: Floats,
) -> None:
    """Echoes of one block by all pairs of legs, for all channels, each ear asked by itself.

    Args:
        cells: Grids of pressure, shape (channels, groups, cells, shapes of a group): see `group_layout`.
        first_time: Time of the first cell [s].
        cell_rate: Cells per second [Hz].
        pair: Row of the leg out, of the leg back and of the gain of each pair, (p, 3).
        sent: The legs out.
        heard: The legs back.
        strength: What each scatterer makes of each pair, real or complex, (p, n).
        ears: Who hears.
        slowness: Of sound at the array [s/m].
        gradient: Growth of the speed of sound with depth at the array [1/s].
        loss: Part of the pressure that the water takes on a metre [1/m].
        bent: Whether rays bend.
        middle: Time from the pulse's start to its middle, for an array under way; 0 for one that stands [s].
        frequency: Of the carrier [Hz].
        node: Doppler factor less one of each shape [1], (shapes,).
    """
    room = arrival_buffer(heard.expansion.shape[1], cells.shape[1], node)
    outs, backs, hears = nonzero_legs(sent, heard)
    for begin in range(0, strength.shape[1], BLOCK):
        end = min(begin + BLOCK, strength.shape[1])
        for p in range(pair.shape[0]):
            i, j, row = pair[p]
            count = scatterers_with_echo(
                begin,
                strength[p, begin:end],
                outs[i, begin:end],
                backs[j, begin:end],
                hears[row, begin:end],
                room.scatterer,
            )
            for k in range(count):
                room.strength[k] = strength[p, room.scatterer[k]]
            if count > 0:
                deposit_pair(
                    cells,
                    first_time,
                    cell_rate,
                    i,
                    j,
                    row,
                    count,
                    room,
                    sent,
                    heard,
                    ears,
                    slowness,
                    gradient,
                    loss,
                    bent,
                    middle,
                    frequency,
                    node,
                )
