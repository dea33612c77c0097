"""A data set of small images, and its file, for tests."""

from pathlib import Path

SCENE = """
seabed:
  depth: 16 m
  relief: {kind: power-law, hurst: 0.8, rms: 2 cm, outer_scale: 10 m}
  cutoff_wavelength: 20 cm
  scattering: {law: lambert, strength_db: -27}
targets:
  - {shape: cylinder, label: pipe, position: [1 m, 12 m], length: 3 m, diameter: 1 m}
sonar:
  source_level_db: 215
  pulse: {kind: cw, frequency: 100 kHz, duration: 0.3 ms}
  transmit: {kind: planar, width: 60 cm, height: 2 cm}
  receive: {kind: planar, width: 60 cm, height: 2 cm}
  receiver: {bandwidth: 7 kHz}
  mounting: {bearing: 90 deg, tilt: 20 deg}
track: {kind: line, start: [0 m, 0 m, 10 m], heading: 0 deg, speed: 2 m/s, pings: 12, interval: 0.2 s,
  window: [8 ms, 24 ms]}
paths: {max_reflections: 0, edge_diffraction: none, beam_cutoff_db: -20, scatterers_per_cell: 4}
field: incoherent
"""
DATASET = """
dataset: {images: 4, seed: 7, split: {train: 0.5, val: 0.5}, projection: slant}
scene: scene.yaml
vary:
  targets[pipe].position: {uniform_in: {area: swath, along: [0.3, 0.7], across: [9 m, 13 m]}}
  targets[pipe].heading: {uniform: [0 deg, 360 deg]}
write: [coco]
"""


def write_small(folder: Path, *edits: tuple[str, str], scene: tuple[tuple[str, str], ...] = ()) -> Path:
    """Write the small data set with edits of its text and of its scenario's."""
    text, about = DATASET, SCENE
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    for old, new in scene:
        assert old in about
        about = about.replace(old, new)
    (folder / "scene.yaml").write_text(about)
    (folder / "dataset.yaml").write_text(text)
    return folder / "dataset.yaml"
