"""Fresnel number of an edge, written out: the definition that the kernels use to first order."""

import numpy as np


def fresnel_number(height, before, behind, wavelength):
    """Height of an edge above the straight path past it, in Fresnel zones: ITU-R P.526-15, eq. 26 (not verified)."""
    ways = 1 / np.asarray(before, float) + 1 / np.asarray(behind, float)
    return np.asarray(np.asarray(height, float) * np.sqrt(2 / wavelength * ways))
