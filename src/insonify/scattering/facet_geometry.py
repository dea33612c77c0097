"""Geometry of specular facets: change of direction by the facet that reflects one direction into another.

All quantities follow from the change of direction, d = out - in, so that they are symmetric in source and receiver.
"""

import numpy as np

from insonify.scattering.law import Floats

SHALLOWEST = 1e-9
"""Sine of the grazing angle up to which a direction counts as behind the interface [1]."""


def half_direction_change(grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> tuple[Floats, Floats]:
    """Half the change of direction, in the plane of the interface and along its normal.

    Args:
        grazing_in: Grazing angle of the incident sound [rad], any shape.
        grazing_out: Grazing angle of the scattered sound [rad], broadcast.
        azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.

    Returns:
        Half the change in the plane of the interface and half that along its normal [1],
        broadcast shape; 0 and 1 for backscatter at normal incidence.
    """
    in_plane_in, in_plane_out = np.cos(grazing_in), np.cos(grazing_out)
    # The law of cosines as a sum of squares: exact for the specular direction, where the plain form leaves rounding.
    squared = (in_plane_in - in_plane_out) ** 2 + 4 * in_plane_in * in_plane_out * np.sin(np.asarray(azimuth) / 2) ** 2
    return np.asarray(np.sqrt(squared) / 2), np.asarray((np.sin(grazing_in) + np.sin(grazing_out)) / 2)


def illumination(grazing_in: Floats, grazing_out: Floats) -> Floats:
    """One where both directions are on the water's side of the interface, else zero [1], broadcast shape."""
    is_illuminated = (np.sin(grazing_in) > SHALLOWEST) & (np.sin(grazing_out) > SHALLOWEST)
    return np.asarray(is_illuminated, dtype=float)
