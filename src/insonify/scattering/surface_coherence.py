"""Coherent reflection of a rough, moving sea surface.

The sea surface reflects nearly all the incident energy. Roughness reduces the coherent part;
the incoherent part comes from a patch around the specular point, later and shifted in frequency.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from insonify.scattering.law import Floats
from insonify.validity import require_grazing_angle, require_numbers, require_sound_speed


def rayleigh_parameter(
    frequency: ArrayLike, rms_height: ArrayLike, grazing: ArrayLike, *, sound_speed: ArrayLike = 1500.0
) -> Floats:
    """Rayleigh parameter, rms phase of specular reflection by a rough surface, 2 k h sin(grazing) [rad].

    Args:
        frequency: Frequency [Hz], any shape.
        rms_height: Rms height of the surface, a quarter of the significant height [m], broadcast.
        grazing: Grazing angle [rad], broadcast.
        sound_speed: Sound speed in the water at the surface [m/s], broadcast.

    Returns:
        Rayleigh parameter [rad], broadcast shape: smooth well below 1, rough well above.
    """
    tone = require_numbers("frequency", frequency, "Hz", 0.0)
    k = 2 * math.pi * tone / require_sound_speed("sound_speed", sound_speed)
    height, angle = require_numbers("rms_height", rms_height, "m", 0.0), require_grazing_angle("grazing", grazing)
    return np.asarray(2 * k * height * np.sin(angle))


def coherent_reflection(
    frequency: ArrayLike, rms_height: ArrayLike, grazing: ArrayLike, *, sound_speed: ArrayLike = 1500.0
) -> Floats:
    """Coherent (mean) pressure reflection coefficient of a rough sea surface [1].

    Args:
        frequency: Frequency [Hz], any shape.
        rms_height: Rms height of the surface [m], broadcast.
        grazing: Grazing angle [rad], broadcast.
        sound_speed: Sound speed in the water at the surface [m/s], broadcast.

    Returns:
        -exp(-P^2 / 2) with the Rayleigh parameter P [1], broadcast shape: -1 for a flat sea.

    Source: Eckart (1953), J. Acoust. Soc. Am. 25, 566 (not verified): the mean of
    exp(j P x) over Gaussian heights. Valid: no shadows, slopes small.
    """
    parameter = rayleigh_parameter(frequency, rms_height, grazing, sound_speed=sound_speed)
    return np.asarray(-np.exp(-np.minimum(parameter**2 / 2, 700.0)))
