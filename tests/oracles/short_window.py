"""Scenario file of one ping with a window of 5 ms about the seabed at 150 m, computed in a moment."""

SHORT = """
sonar:
  source_level_db: 220
  pulse: {kind: cw, frequency: 100 kHz, duration: 0.2 ms}
  transmit: {kind: line, length: 1.5 m}
  receive: {kind: line, length: 1.5 m}
track: {kind: static, position: [0, 0, 11 m], window: [199 ms, 204 ms]}
paths: {geometry: slice, max_reflections: 0}
"""
WITH_TARGET = f"targets: [{{shape: box, position: [0 m, 150.5 m], size: [2 m, 1 m, 1 m]}}]{SHORT}"
"""The same with a box that returns an echo and casts a shadow."""
