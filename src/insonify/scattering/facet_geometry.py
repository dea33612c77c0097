"""Which facet would send a mirror's echo, and other questions of two directions at a plane.

All of it follows from the change of direction, d = out - in, of which everything symmetric
in source and receiver can be built.
"""

import numpy as np

from insonify.scattering.law import Floats

SHALLOWEST = 1e-9
"""Sine below which a direction counts as behind the interface [1]."""


def half_direction_change(grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> tuple[Floats, Floats]:
    """Half the change of direction, in the plane and across it.

    Args:
        grazing_in: Of the sound that arrives [rad], any shape.
        grazing_out: Of the sound that leaves [rad], broadcast.
        azimuth: Between the two, 0 forward, pi back [rad], broadcast.

    Returns:
        Half the change in the plane of the interface and half that along its normal [1],
        broadcast shape; 0 and 1 for an echo from straight above.
    """
    in_plane_in, in_plane_out = np.cos(grazing_in), np.cos(grazing_out)
    # The law of cosines as a sum of squares: exact for the mirror direction, where the plain form leaves rounding.
    squared = (in_plane_in - in_plane_out) ** 2 + 4 * in_plane_in * in_plane_out * np.sin(np.asarray(azimuth) / 2) ** 2
    return np.asarray(np.sqrt(squared) / 2), np.asarray((np.sin(grazing_in) + np.sin(grazing_out)) / 2)


def illumination(grazing_in: Floats, grazing_out: Floats) -> Floats:
    """One where both directions are on the water's side of the interface, else zero [1], broadcast shape."""
    seen = (np.sin(grazing_in) > SHALLOWEST) & (np.sin(grazing_out) > SHALLOWEST)
    return np.asarray(seen, dtype=float)
