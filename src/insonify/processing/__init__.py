"""From a recording to an image."""

from insonify.processing.gain import along_db, lambert_db, learnt_db, tvg_db
from insonify.processing.ground import first_return, slant_to_ground
from insonify.processing.level import recorded_level
from insonify.processing.sidescan import GAINS, sidescan

__all__ = [
    "GAINS",
    "along_db",
    "first_return",
    "lambert_db",
    "learnt_db",
    "recorded_level",
    "sidescan",
    "slant_to_ground",
    "tvg_db",
]
