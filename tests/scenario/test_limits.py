"""Claims about limits of scenario keys: nonsense is refused by name and range, and what is allowed makes sense."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.ocean.scattering_layers import ScatteringPatch
from insonify.ocean.scenario_profile import ScenarioProfile
from insonify.ocean.water import Water
from insonify.scattering import Lambert
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.seabed import Seabed
from insonify.scene.surface import Surface
from insonify.scene.target import Box
from insonify.scene.terrain import PowerLaw, Ripples
from insonify.scene.terrain.roughness_cutoff import RoughnessCutoff
from insonify.scene.terrain.scour import Scour
from insonify.sonar.array import LineArray
from insonify.sonar.electronics import ReceiverGain
from insonify.sonar.element_array import ElementArray
from insonify.sonar.pulse import Pulse
from insonify.sonar.track.motion import RandomRotation

BOX = {"position": (0, 50), "size": (1, 1, 1)}
PULSE = {"kind": "lfm", "frequency": "100 kHz", "duration": "1 ms"}
PATCH = {"position": (0, 50, 5), "size": (1, 1, 1), "volume_strength_db": -50}


@pytest.mark.parametrize(
    ("model", "values", "advice"),
    [
        (Box, BOX | {"position": (0, 2e7)}, r"position\.1: .*out of range \(-10000000 to 10000000 m\)"),
        (Box, BOX | {"heading": 90}, r"heading: .*out of range \(-12\.5664 to 12\.5664 rad\)"),
        (Box, BOX | {"base_depth": "13 km"}, r"base_depth: .*out of range \(above 0, to 12 km\)"),
        (Box, BOX | {"base_depth": -1}, "base_depth: .*at or above the sea surface"),
        (ScatteringPatch, PATCH | {"position": (0, 50, 1e5)}, r"position\.2: .*out of range"),
        (ScatteringPatch, PATCH | {"heading": 90}, "heading: .*out of range"),
        (Water, {"volume_strength_db": [[2e5, -50]]}, r"out of range \(0 to 12000 m\)"),
        (Water, {"absorption_db_per_m": 2000}, r"absorption_db_per_m: .*out of range \(0 to 1000 dB/m\)"),
        (ScattererGrid, {"heading": 90}, "heading: .*out of range"),
        (Scour, {"position": (0, 2e7), "size": (1, 1)}, r"position\.1: .*out of range"),
        (Surface, {"wave_direction": 45}, "wave_direction: .*out of range"),
        (Ripples, {"wavelength": "2 km"}, r"wavelength: .*out of range \(above 0, to 1 km\)"),
        (Ripples, {"height": 200}, r"height: .*out of range \(0 to 100 m\)"),
        (Ripples, {"direction": 90}, "direction: .*out of range"),
        (PowerLaw, {"hurst": 0.8, "strength": 1e3}, r"strength: .*out of range \(above 0, to 100\)"),
        (PowerLaw, {"hurst": 0.8, "rms": "2 km"}, r"rms: .*out of range \(above 0, to 1 km\)"),
        (PowerLaw, {"hurst": 0.8, "rms": 1, "outer_scale": 1e10}, r"out of range \(0\.005 to 1e\+09 m\)"),
        (PowerLaw, {"hurst": 0.8, "rms": 1, "outer_scale": 1e-6}, "outer_scale: .*out of range"),
        (Pulse, PULSE | {"bandwidth": "30 MHz"}, r"bandwidth: .*out of range \(0 to below 20 MHz\)"),
        (ReceiverGain, {"curve": [[-1, 0], [10, 20]]}, r"curve\.0\.0: .*out of range \(0 to 1000000 m\)"),
        (ReceiverGain, {"curve": [[1, 0], [10, 900]]}, r"curve\.1\.1: .*out of range \(-400 to 400 dB\)"),
        (ElementArray, {"positions": [[0, 0, 0], [0, 2e5, 0]]}, r"positions\.1\.1: .*out of range"),
        (ElementArray, {"positions": [[0, 0, 0]], "orientations": [45]}, r"orientations\.0: .*out of range"),
        (RandomRotation, {"spectrum": [[0.1, 1], [2000, 1]]}, r"spectrum\.1\.0: .*out of range \(0 to 1000 Hz\)"),
        (RandomRotation, {"spectrum": [[-0.1, 1], [2, 1]]}, r"spectrum\.0\.0: .*out of range"),
        (RandomRotation, {"spectrum": [[0.1, 1e15], [2, 1]]}, r"spectrum\.0\.1: .*out of range"),
        (LineArray, {"length": 1, "steer": [0, 7]}, r"steer\.1: .*write 7 deg"),
        (Seabed, {"scattering": {"strength_db": -500}}, r"strength_db: .*out of range \(-400 to -4\.9715 dB\)"),
        (Seabed, {"scattering": {"strength_db": -3}}, "more energy than it receives"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore")
def test_nonsense_is_refused_by_name_and_range(model, values, advice):
    """Values that no scene, sea or sonar has, most of them slips of a unit."""
    with pytest.raises(ValidationError, match=advice):
        model(**values)


def test_a_strength_too_weak_to_be_one_is_refused_in_python_too():
    """The same limits as in a file, for the law by itself."""
    with pytest.raises(ValueError, match="-400 or more"):
        Lambert(strength_db=-500.0)
    assert Lambert(strength_db=-400.0).strength_db == -400


@pytest.mark.parametrize("depths", [(-200, 20), (0, 13_000)])
def test_depths_of_a_profile_have_those_limits_that_its_tables_have(depths):
    """Also where the model is filled by columns."""
    with pytest.raises(ValidationError, match="-100 to 12000 m"):
        ScenarioProfile.model_validate({"depth": depths, "speed": (1500, 1500)})


@pytest.mark.parametrize("outer_scale", [0.005, 1e9])
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("hurst", [0.05, 0.95])
def test_fractal_relief_at_its_limits_has_the_slopes_of_its_spectrum(outer_scale, hurst):
    """The closed form of the mean square gradient, whose terms cancel, against the integral of K^3 W over ln K."""
    relief = PowerLaw(hurst=hurst, rms=1000.0, outer_scale=outer_scale)
    high = RoughnessCutoff().wavenumber
    wavenumber = np.geomspace(1e-4 * min(relief.outer_wavenumber, high), high, 200_001)
    gradient = 2 * math.pi * np.trapezoid(wavenumber**4 * relief.spectrum(wavenumber), np.log(wavenumber))
    assert relief.slope_variance(high) == pytest.approx(gradient, rel=1e-6)
