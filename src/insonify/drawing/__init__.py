"""Pictures of what was simulated, for people who read sonar: axes with units, one colour for one cause.

Everything is drawn with matplotlib onto figures of our own; no display and no global state is needed.
"""

from insonify.drawing.geometry import geometry
from insonify.drawing.levels import levels
from insonify.drawing.recording import recording
from insonify.drawing.spikes import spikes

__all__ = ["geometry", "levels", "recording", "spikes"]
