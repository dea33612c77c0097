"""Claims about warnings on the command line: each is printed once, however many laws and arrays it concerns."""

import pytest

from insonify.cli import main

CHANGES = [
    ("frequency: 100 kHz", "frequency: 300 kHz"),
    ("window: [0 ms, 240 ms]", "window: [30 ms, 31 ms]"),
    ("[0 m, 150.5 m]", "[0 m, 23 m]"),
    ("scattering: {law: lambert, strength_db: -27}", "scattering: {law: jackson, sediment: medium sand}"),
    ("scattering: null # for its own echoes", "scattering: {law: apl-surface, wind_speed: 3 m/s} # for its own echoes"),
]


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_frequency_beyond_the_handbook_is_reported_once(tmp_path, capsys, command):
    """The bed's roughness, the surface and its bubbles are of one handbook; both arrays are out of focus alike."""
    path = tmp_path / "high.yaml"
    main(["new", str(path)])
    text = path.read_text()
    for old, new in CHANGES:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    capsys.readouterr()
    assert main([command, str(path), *(["-o", str(tmp_path / "a.zarr")] if command == "run" else [])]) == 0
    output = capsys.readouterr()
    assert command == "run" or "nothing wrong but the 2 warnings above" in output.out
    warned = [line for line in output.err.splitlines() if line.startswith("warning:")]
    assert sum("trusted for frequency 10 to 100 kHz; 300 kHz is outside" in line for line in warned) == 1
    assert sum("far-field patterns" in line for line in warned) == 1
    assert any("sonar.transmit and sonar.receive: beams are far-field" in line for line in warned)
    assert len(warned) == len(set(warned)) == 2
