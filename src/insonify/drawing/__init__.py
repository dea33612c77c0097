"""Pictures of what was simulated, for people who read sonar: axes with units, one colour for one cause.

Everything is drawn with matplotlib onto figures of our own; no display and no global state is needed.
"""

from insonify.drawing.absorption import absorption
from insonify.drawing.geometry import geometry
from insonify.drawing.labels import labels
from insonify.drawing.laws import laws, lobe, sediment
from insonify.drawing.levels import levels
from insonify.drawing.profile import profile
from insonify.drawing.rays import rays
from insonify.drawing.recording import recording
from insonify.drawing.relief import relief
from insonify.drawing.scene import scene
from insonify.drawing.sea import sea
from insonify.drawing.spikes import spikes

__all__ = [
    "absorption",
    "geometry",
    "labels",
    "laws",
    "levels",
    "lobe",
    "profile",
    "rays",
    "recording",
    "relief",
    "scene",
    "sea",
    "sediment",
    "spikes",
]
