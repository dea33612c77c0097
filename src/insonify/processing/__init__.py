"""From a recording to an image."""

import importlib
from typing import TYPE_CHECKING, Any

from insonify.processing.gain import along_db, lambert_db, learnt_db
from insonify.processing.ground import first_return, samples_spanned, slant_to_ground
from insonify.processing.image_labels import image_labels
from insonify.processing.level import recorded_level
from insonify.processing.sidescan import GAINS, sidescan
from insonify.sonar.time_varied_gain import tvg_db

if TYPE_CHECKING:
    from insonify.processing.alike import (
        advance,
        coherence_by_delay,
        complex_coherence,
        displaced_phase_centres,
        peak_between,
    )
    from insonify.processing.beamforming import beamform_delay_sum, beamform_fft
    from insonify.processing.bottom import Detections, amplitude_detection, bottom_detection, phase_detection
    from insonify.processing.element_recordings import (
        beam_recording,
        compressed_recording,
        decimated_recording,
        fan_of_beams,
    )
    from insonify.processing.fan import fan_image
    from insonify.processing.interferometer import (
        elevation_to_phase,
        flat_bed_elevation,
        interferometric_depth,
        phase_deviation,
        phase_to_elevation,
        unwrapped,
    )
    from insonify.processing.pulse_compression import matched_filter
    from insonify.processing.recorded_aperture import synthetic_aperture_image
    from insonify.processing.recorded_depths import interferometric_bathymetry, multibeam_soundings
    from insonify.processing.recorder import decimate, decimated_time, multilook
    from insonify.processing.synthetic_aperture import backproject, resolution_along

# Kernels take a moment to import: those of coherent processing are loaded when they are asked for.
_HOME = {
    "advance": "alike",
    "coherence_by_delay": "alike",
    "complex_coherence": "alike",
    "displaced_phase_centres": "alike",
    "peak_between": "alike",
    "beamform_delay_sum": "beamforming",
    "beamform_fft": "beamforming",
    "Detections": "bottom",
    "amplitude_detection": "bottom",
    "bottom_detection": "bottom",
    "phase_detection": "bottom",
    "beam_recording": "element_recordings",
    "compressed_recording": "element_recordings",
    "decimated_recording": "element_recordings",
    "fan_of_beams": "element_recordings",
    "fan_image": "fan",
    "elevation_to_phase": "interferometer",
    "flat_bed_elevation": "interferometer",
    "interferometric_depth": "interferometer",
    "phase_deviation": "interferometer",
    "phase_to_elevation": "interferometer",
    "unwrapped": "interferometer",
    "matched_filter": "pulse_compression",
    "synthetic_aperture_image": "recorded_aperture",
    "interferometric_bathymetry": "recorded_depths",
    "multibeam_soundings": "recorded_depths",
    "decimate": "recorder",
    "decimated_time": "recorder",
    "multilook": "recorder",
    "backproject": "synthetic_aperture",
    "resolution_along": "synthetic_aperture",
}

__all__ = [
    "GAINS",
    "Detections",
    "advance",
    "along_db",
    "amplitude_detection",
    "backproject",
    "beam_recording",
    "beamform_delay_sum",
    "beamform_fft",
    "bottom_detection",
    "coherence_by_delay",
    "complex_coherence",
    "compressed_recording",
    "decimate",
    "decimated_recording",
    "decimated_time",
    "displaced_phase_centres",
    "elevation_to_phase",
    "fan_image",
    "fan_of_beams",
    "first_return",
    "flat_bed_elevation",
    "image_labels",
    "interferometric_bathymetry",
    "interferometric_depth",
    "lambert_db",
    "learnt_db",
    "matched_filter",
    "multibeam_soundings",
    "multilook",
    "peak_between",
    "phase_detection",
    "phase_deviation",
    "phase_to_elevation",
    "recorded_level",
    "resolution_along",
    "samples_spanned",
    "sidescan",
    "slant_to_ground",
    "synthetic_aperture_image",
    "tvg_db",
    "unwrapped",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used."""
    if name in _HOME:
        return getattr(importlib.import_module(f"insonify.processing.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Every public name, loaded or not."""
    return sorted(__all__)
