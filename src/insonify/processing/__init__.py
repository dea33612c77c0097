"""Processing of recordings: beams, detections, synthetic apertures, images."""

import importlib
from typing import TYPE_CHECKING, Any

from insonify.processing.gain import along_track_gain_db, empirical_gain_db, lambert_gain_db
from insonify.processing.image_labels import image_labels
from insonify.processing.recording_level import recorded_level
from insonify.processing.sidescan import GAINS, sidescan
from insonify.processing.slant_range_correction import first_bottom_return, ground_cell_edges, slant_to_ground_range
from insonify.sonar.time_varied_gain import tvg_db

if TYPE_CHECKING:
    from insonify.processing.beamforming import beamform_delay_sum, beamform_fft
    from insonify.processing.bottom_detectors import Detections, amplitude_detection, bottom_detection, phase_detection
    from insonify.processing.coherence import (
        coherence_by_delay,
        complex_coherence,
        displaced_phase_centres,
        dpca_displacement,
        parabolic_peak,
    )
    from insonify.processing.decimation import decimate, decimated_time, multilook
    from insonify.processing.element_recordings import (
        beam_recording,
        compressed_recording,
        decimated_recording,
        sector_image_of_beams,
    )
    from insonify.processing.interferometry import (
        elevation_to_phase,
        flat_bed_elevation,
        interferometric_depth,
        phase_deviation,
        phase_to_elevation,
        unwrap_to_reference,
    )
    from insonify.processing.pulse_compression import matched_filter
    from insonify.processing.recorded_aperture import synthetic_aperture_image
    from insonify.processing.recorded_bathymetry import interferometric_bathymetry, multibeam_soundings
    from insonify.processing.recorder import instrument_recording, lines_as_pings, received_level, record_series
    from insonify.processing.recorder_fit import fit_recorder
    from insonify.processing.sector_images import sector_image
    from insonify.processing.split_beam import echosounder_levels
    from insonify.processing.synthetic_aperture import along_track_resolution, backproject

# Kernels take a moment to import: those of coherent processing are loaded on first use.
_NAMES = {
    "beamforming": ("beamform_delay_sum", "beamform_fft"),
    "bottom_detectors": ("Detections", "amplitude_detection", "bottom_detection", "phase_detection"),
    "coherence": ("coherence_by_delay", "complex_coherence", "displaced_phase_centres", "dpca_displacement",
        "parabolic_peak"),
    "decimation": ("decimate", "decimated_time", "multilook"),
    "element_recordings": ("beam_recording", "compressed_recording", "decimated_recording", "sector_image_of_beams"),
    "interferometry": ("elevation_to_phase", "flat_bed_elevation", "interferometric_depth", "phase_deviation",
        "phase_to_elevation", "unwrap_to_reference"),
    "pulse_compression": ("matched_filter",),
    "recorded_aperture": ("synthetic_aperture_image",),
    "recorded_bathymetry": ("interferometric_bathymetry", "multibeam_soundings"),
    "recorder": ("instrument_recording", "lines_as_pings", "received_level", "record_series"),
    "recorder_fit": ("fit_recorder",),
    "sector_images": ("sector_image",),
    "split_beam": ("echosounder_levels",),
    "synthetic_aperture": ("along_track_resolution", "backproject"),
}  # fmt: skip
_HOMES = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "GAINS", "Detections", "along_track_gain_db", "along_track_resolution", "amplitude_detection", "backproject",
    "beam_recording", "beamform_delay_sum", "beamform_fft", "bottom_detection", "coherence_by_delay",
    "complex_coherence", "compressed_recording", "decimate", "decimated_recording", "decimated_time",
    "displaced_phase_centres", "dpca_displacement", "echosounder_levels", "elevation_to_phase", "empirical_gain_db",
    "first_bottom_return", "fit_recorder", "flat_bed_elevation", "ground_cell_edges", "image_labels",
    "instrument_recording", "interferometric_bathymetry", "interferometric_depth", "lambert_gain_db", "lines_as_pings",
    "matched_filter", "multibeam_soundings", "multilook", "parabolic_peak", "phase_detection", "phase_deviation",
    "phase_to_elevation", "received_level", "record_series", "recorded_level", "sector_image", "sector_image_of_beams",
    "sidescan", "slant_to_ground_range", "synthetic_aperture_image", "tvg_db", "unwrap_to_reference",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Load a public name on its first use."""
    if name in _HOMES:
        return getattr(importlib.import_module(f"insonify.processing.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """All public names, loaded or not."""
    return sorted(__all__)
