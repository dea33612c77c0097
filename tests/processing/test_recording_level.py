"""Levels of recordings."""

import numpy as np
import pytest
import xarray as xr

from insonify.processing.recording_level import recorded_level


def test_both_readings_of_one_sound_have_one_level() -> None:
    """A pressure of 100 uPa rms is an intensity of 10^4 uPa^2, and both are 40 dB re 1 uPa; silence is -inf."""
    pressure = xr.Dataset({"pressure": ("time", np.array([100j, 0], np.complex64))})
    intensity = xr.Dataset({"intensity": ("time", np.array([1e4, 0.0]))})
    for sound in (pressure, intensity):
        level = recorded_level(sound)
        assert float(level[0]) == pytest.approx(40, abs=1e-5)
        assert level[1] == -np.inf
        assert level.attrs["units"] == "dB re 1 uPa"
