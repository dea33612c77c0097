"""List of the measures, in the order of reports: one line registers a measure."""

from importlib import import_module

from insonify.comparison.measure import Measure

MEASURES: tuple[str, ...] = (
    "echo_trains.EchoTrains",
    "level_against_range.LevelAgainstRange",
    "level_against_angle.LevelAgainstAngle",
    "amplitude_distribution.AmplitudeDistribution",
    "distribution_against_angle.DistributionAgainstAngle",
    "autocorrelation.Autocorrelation",
    "point_spread.PointSpread",
    "texture.ImageTexture",
    "contrast.Contrast",
    "sector_coherence.SectorCoherence",
    "noise_floor.NoiseFloor",
    "full_scale.FullScale",
    "detections.DetectedDepths",
)
"""Module and class of each measure."""


def measures() -> tuple[type[Measure], ...]:
    """Classes of all measures."""
    pairs = (entry.split(".") for entry in MEASURES)
    return tuple(getattr(import_module(f"insonify.comparison.{module}"), name) for module, name in pairs)
