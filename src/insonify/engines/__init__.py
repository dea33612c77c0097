"""Engines: the pairs of transmit and receive legs of one ping, for a scene and a sonar."""

from insonify.engines.eigenray_engine import EigenrayEngine

__all__ = ["EigenrayEngine"]
