"""From a scene, a sonar and a pose to the pairs of legs that make a ping."""

from insonify.engines.paths import Paths

__all__ = ["Paths"]
