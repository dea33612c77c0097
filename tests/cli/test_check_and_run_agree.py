"""Claims about faults: what a run refuses, check refuses, in the same words and with the same exit code."""

from pathlib import Path

import numpy as np
import pytest

import insonify
from insonify.cli import main
from insonify.engines import volume
from insonify.estimates.run_cost import estimate_cost

TEMPLATES = {
    path.stem: path.read_text() for path in (Path(insonify.__file__).parent / "scenario" / "templates").glob("*.yaml")
}
FAULTS = [
    ("\nsonar:", "\nfild: coherent\nsonar:"),  # an unknown key
    ("\nseed: ", "\nseed: -"),
    ("  depth: 20 m", "  depth: 0.2 m"),  # the track is below the seabed
    ("source_level_db: ", "source_level_db: strong # "),
    ("\nwater:", "\nwater: {volume_strength_db: []}\nold_water:"),
]


def verdicts(path, capsys, *options):
    """Exit code and last words of check, and of a run of the first ping."""
    messages = []
    run = ["run", str(path), "-o", str(path.with_suffix(".zarr")), "--quiet", "--pings", "0"]
    for command in (["check", str(path)], run):
        code = main([*command, *options])
        lines = capsys.readouterr().err.splitlines()
        messages.append((code, "\n".join(line for line in lines if not line.startswith("compiling"))))
    return messages


def written(tmp_path, template, *changes):
    """A template with some of its text replaced."""
    path = tmp_path / f"{template}.yaml"
    assert main(["new", str(path), "--template", template]) == 0
    text = path.read_text()
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path.write_text(text)
    return path


FOUND = [(name, *fault) for name, text in sorted(TEMPLATES.items()) for fault in FAULTS if fault[0] in text]


@pytest.mark.parametrize(("template", "old", "new"), FOUND)
def test_a_fault_in_a_template_is_reported_alike(tmp_path, capsys, template, old, new):
    """Of every template: unknown keys, values out of range, words for numbers, parts that do not fit together."""
    path = written(tmp_path, template, (old, new))
    capsys.readouterr()
    (checked, words), (ran, others) = verdicts(path, capsys)
    assert checked == ran == 2
    assert words == others and str(path) in words


SHORT = ("window: [0 ms, 240 ms]", "window: [20 ms, 24 ms]")
WATER = ("volume_strength_db: null", "volume_strength_db: -70")


def test_too_much_water_is_refused_by_both(tmp_path, capsys, monkeypatch):
    """For the sound, and for the labels alone: they are of even points, and request others."""
    path = written(tmp_path, "nominal", SHORT, WATER, ("labels: false", "labels: true"))
    assert main(["check", str(path)]) == 0
    monkeypatch.setattr(volume, "MAX_TILES", 1)
    capsys.readouterr()
    (checked, words), (ran, others) = verdicts(path, capsys)
    assert (checked, ran) == (2, 2) and words == others and "water.volume_strength_db" in words
    path.write_text(path.read_text().replace("labels: true", "labels: false"))
    assert main(["check", str(path)]) == 0
    capsys.readouterr()
    (checked, words), (ran, others) = verdicts(path, capsys, "--labels")
    assert (checked, ran) == (2, 2) and words == others
    monkeypatch.setattr(volume, "MAX_CUBES", 1)
    assert [code for code, _ in verdicts(path, capsys)] == [2, 2]


def test_too_much_water_at_a_later_ping_is_refused_by_both(tmp_path, capsys, monkeypatch):
    """A sonar that comes up to a layer: its first ping is judged no better than its shallowest."""
    near = ("window: [0 ms, 240 ms]", "window: [0 ms, 20 ms]")
    layer = ("volume_strength_db: null", "volume_strength_db: [[0 m, -70], [1 m, null]]")
    rising = (
        "  kind: static # (needed) or line, waypoints, navigation (log): see `insonify new NAME --template sidescan`\n"
        "  position: [0 m, 0 m, 11 m] # north, east, depth (needed)\n  heading: 0 deg # clockwise from north\n",
        "  kind: waypoints\n  waypoints: [[0 m, 0 m, 19 m], [0 m, 9 m, 10 m]]\n  speed: 1 m/s\n",
    )
    path = written(tmp_path, "nominal", near, layer, rising, ("  pings: 1\n", "  pings: 30\n"))
    assert main(["check", str(path)]) == 0
    monkeypatch.setattr(volume, "MAX_CUBES", 100)
    whole = estimate_cost(insonify.load_scenario(path))
    assert np.isfinite(whole.scatterers)  # the first ping, right above the bed, does not reach the layer
    capsys.readouterr()
    (checked, words), (ran, others) = verdicts(path, capsys)
    assert (checked, ran) == (2, 2) and words == others and "water.volume_strength_db" in words


def test_labels_of_elements_are_refused_by_both(tmp_path, capsys):
    """Requested by the option: what the scenario's own key is refused for."""
    path = written(tmp_path, "forward-looking")
    capsys.readouterr()
    (checked, words), (ran, others) = verdicts(path, capsys, "--labels")
    assert (checked, ran) == (2, 2) and words == others and "--labels is for beams" in words
