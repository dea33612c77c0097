"""From a scene, a sonar and a pose to the pairs of legs that make a ping."""

from insonify.engines.eigenray_engine import EigenrayEngine

__all__ = ["Paths"]
