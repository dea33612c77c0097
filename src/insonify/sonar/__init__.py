"""Who calls and listens: the pulse, the arrays and their beams, the receiver, the sonar, its track."""

from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.beam import Beams, beams, grating_lobes
from insonify.sonar.element_array import ArcArray, Array, ElementArray
from insonify.sonar.footprint import two_way_footprint, two_way_width
from insonify.sonar.heard import HeardPulse, hear, heard_pulse
from insonify.sonar.hydrophones import ElementErrors, Hydrophones, element_layout, hydrophones
from insonify.sonar.pulse import Pulse, energy_duration, envelope, spectrum
from insonify.sonar.receiver import Receiver, response
from insonify.sonar.sonar import Mounting, Sonar, array_position, array_rotation
from insonify.sonar.track import (
    LineTrack,
    LoggedNavigation,
    Motion,
    NavigationTrack,
    Poses,
    StaticTrack,
    Track,
    WaypointTrack,
    logged_poses,
    poses,
)

__all__ = [
    "ArcArray",
    "Array",
    "Beams",
    "ElementArray",
    "ElementErrors",
    "HeardPulse",
    "Hydrophones",
    "LineArray",
    "LineTrack",
    "LoggedNavigation",
    "Motion",
    "Mounting",
    "NavigationTrack",
    "PlanarArray",
    "PointTransducer",
    "Poses",
    "Pulse",
    "Receiver",
    "Sonar",
    "StaticTrack",
    "Track",
    "WaypointTrack",
    "array_position",
    "array_rotation",
    "beams",
    "element_layout",
    "energy_duration",
    "envelope",
    "grating_lobes",
    "hear",
    "heard_pulse",
    "hydrophones",
    "logged_poses",
    "poses",
    "response",
    "spectrum",
    "two_way_footprint",
    "two_way_width",
]
