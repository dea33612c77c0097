"""Tracer: a second engine that follows rays from the sonar from reflection to reflection, to verify the first.

It also includes echoes between targets and the seabed, which the eigenray engine does not.
"""

from insonify.engines.tracer.engine import Tracer

__all__ = ["Tracer"]
