"""The second engine: rays thrown from the sonar and followed from mirror to mirror, to check the first one by.

It also knows what the first does not: echoes between targets and the seabed.
"""

from insonify.engines.tracer.engine import Tracer

__all__ = ["Tracer"]
