"""The sonar: pulse, arrays and their beams, receiver, mounting, track."""

from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.beam import Beams, beams, grating_lobes
from insonify.sonar.element_array import ArcArray, Array, ElementArray
from insonify.sonar.hydrophones import ElementErrors, Hydrophones, element_layout, hydrophones
from insonify.sonar.pulse import Pulse, energy_duration, envelope, spectrum
from insonify.sonar.received_pulse import ReceivedPulse, receive_pulse, received_pulse
from insonify.sonar.receiver import Receiver, response
from insonify.sonar.recorder import Recorder
from insonify.sonar.sonar import Mounting, Sonar, array_position, array_rotation
from insonify.sonar.track import (
    LineTrack,
    Motion,
    NavigationErrors,
    NavigationTrack,
    Poses,
    StaticTrack,
    Track,
    WaypointTrack,
    logged_poses,
    true_poses,
)
from insonify.sonar.two_way_beam import two_way_footprint, two_way_width

__all__ = [
    "ArcArray",
    "Array",
    "Beams",
    "ElementArray",
    "ElementErrors",
    "Hydrophones",
    "LineArray",
    "LineTrack",
    "Motion",
    "Mounting",
    "NavigationErrors",
    "NavigationTrack",
    "PlanarArray",
    "PointTransducer",
    "Poses",
    "Pulse",
    "ReceivedPulse",
    "Receiver",
    "Recorder",
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
    "hydrophones",
    "logged_poses",
    "receive_pulse",
    "received_pulse",
    "response",
    "spectrum",
    "true_poses",
    "two_way_footprint",
    "two_way_width",
]
