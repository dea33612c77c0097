"""Sea water between the sonar and its targets.

Sound speed, absorption and pressure of sea water; sound-speed profiles; ambient noise; volume scattering;
wave spectra and a moving sea surface. Arguments broadcast. NaN and masked values are gaps in a
measurement and stay gaps (NaN). Impossible values are refused, and a law used outside its range
warns with `insonify.validity.PhysicsWarning`, which names law and range.
"""

from insonify.ocean.absorption import absorption_db_per_m, absorption_filter
from insonify.ocean.ambient_noise import (
    NoiseSpectrum,
    noise_components_db,
    noise_level_db,
    rain_noise_db,
    shipping_noise_db,
    thermal_noise_db,
    turbulence_noise_db,
    wind_noise_db,
)
from insonify.ocean.directional_spreading import CosinePowerSpreading, ElfouhailySpreading
from insonify.ocean.elfouhaily import Elfouhaily
from insonify.ocean.jonswap import Jonswap
from insonify.ocean.pierson_moskowitz import PiersonMoskowitz
from insonify.ocean.pressure import depth_from_pressure, pressure_dbar
from insonify.ocean.profile import SoundSpeedProfile
from insonify.ocean.profile_file import read_profile
from insonify.ocean.sea_surface import SeaSurface
from insonify.ocean.sound_speed import sound_speed, sound_speed_at_pressure
from insonify.ocean.volume_scattering import (
    ScatteringLayer,
    bubble_resonance_frequency,
    resonant_bubble_radius,
    volume_backscattering_coefficient,
    volume_strength_db,
)
from insonify.ocean.water import Water
from insonify.ocean.wave_spectrum import WaveSpectrum, angular_frequency, mean_square_slope, significant_height

__all__ = [
    "CosinePowerSpreading",
    "Elfouhaily",
    "ElfouhailySpreading",
    "Jonswap",
    "NoiseSpectrum",
    "PiersonMoskowitz",
    "ScatteringLayer",
    "SeaSurface",
    "SoundSpeedProfile",
    "Water",
    "WaveSpectrum",
    "absorption_db_per_m",
    "absorption_filter",
    "angular_frequency",
    "bubble_resonance_frequency",
    "depth_from_pressure",
    "mean_square_slope",
    "noise_components_db",
    "noise_level_db",
    "pressure_dbar",
    "rain_noise_db",
    "read_profile",
    "resonant_bubble_radius",
    "shipping_noise_db",
    "significant_height",
    "sound_speed",
    "sound_speed_at_pressure",
    "thermal_noise_db",
    "turbulence_noise_db",
    "volume_backscattering_coefficient",
    "volume_strength_db",
    "wind_noise_db",
]
