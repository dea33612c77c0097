"""Claims about `insonify info`: it states what a file is, in words and in JSON, and what it left out."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import insonify
from insonify.cli import main
from oracles import instrument_files as files

PAGE = Path(__file__).parents[2] / "docs" / "explanation" / "recordings-of-instruments.md"
GROUPS = {".kmall": {"soundings": {"beam": 6}, "seabed image": {"beam": 6, "sample": 5},
                     "water column": {"beam": 5, "sample": 4}},
          ".all": {"soundings": {"beam": 5}, "seabed image": {"beam": 5, "sample": 4},
                   "water column": {"beam": 5, "sample": 4}},
          ".xtf": {"port": {"sample": 4}, "starboard": {"sample": 4}}}  # fmt: skip


@pytest.mark.parametrize("suffix", GROUPS)
def test_the_whole_content_is_listed(suffix, tmp_path, capsys):
    """Groups with shapes, bytes that add up to the file, the unknown datagram; the words agree with the JSON."""
    path = tmp_path / f"a{suffix}"
    path.write_bytes(files.SYNTHETIC[suffix]())
    assert main(["info", str(path), "--json", "--check"]) == 0
    about = json.loads(capsys.readouterr().out)
    assert {group["name"]: group["shape"] for group in about["groups"]} == GROUPS[suffix]
    assert {group["pings"] for group in about["groups"]} == {3}
    header = 1024 if suffix == ".xtf" else 0
    assert sum(row["bytes"] for row in about["datagrams"]) + header == path.stat().st_size == about["bytes"]
    assert about["start"].startswith("2023-11-14T") and about["clock_jumps"] == []
    (left_out,) = about["omissions"]
    assert "unknown" in left_out["reason"] and main(["info", str(path)]) == 0
    output = capsys.readouterr().out
    group = "port: 3 pings x 4 samples" if suffix == ".xtf" else "water column: 3 pings x 5 beams x 4 samples"
    reason = f"left out: byte {left_out['offset']}: {left_out['reason']}"
    assert all(words in output for words in (about["format"], about["model"], group, reason))


def test_ranges_of_settings_have_units(tmp_path, capsys):
    """Frequencies of all sectors in kHz, one value where all are alike, depth below the water line."""
    (tmp_path / "a.kmall").write_bytes(files.kmall())
    assert main(["info", str(tmp_path / "a.kmall")]) == 0
    output = capsys.readouterr().out
    assert "frequency 300 to 320 kHz" in output and "depth 9 m" in output and "sample rate 40 kHz" in output


def test_many_omissions_are_counted(tmp_path, capsys):
    """A terminal shows twenty, JSON a thousand and the number of the rest."""
    broken = files.kmall_datagram("#MWC", 0, b"\1\0\1\0" + b"\xff" * 36)
    (tmp_path / "a.kmall").write_bytes(broken * 1010)
    assert main(["info", str(tmp_path / "a.kmall"), "--check"]) == 0
    output = capsys.readouterr().out
    assert output.count("left out: byte") == 20 and "left out: 981 more" in output
    assert main(["info", str(tmp_path / "a.kmall"), "--check", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["omissions"][-1]["reason"] == "and 10 more"


def test_recordings_and_scenarios_of_ours_are_known(tmp_path, monkeypatch, capsys):
    """A scenario states its pings; a recording its shape, and how much of it is simulated."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "bay", "--template", "sidescan"]) == 0
    capsys.readouterr()
    assert main(["info", "bay.yaml"]) == 0 and "insonify scenario" in capsys.readouterr().out
    scenario = insonify.load_scenario("bay.yaml").with_("track.window", ["20 ms", "20.1 ms"])
    insonify.record(scenario, "bay.zarr", pings=[0])
    assert main(["info", "bay.zarr"]) == 0
    output = capsys.readouterr().out
    assert "insonify recording" in output and "simulated: 1 pings" in output
    samples = len(insonify.open_recording("bay.zarr")["time"])
    assert f": {scenario.track.ping_count:,} pings x 2 channels x {samples} times\n" in output


def test_the_page_about_recordings_runs(tmp_path, monkeypatch, capsys):
    """Its example reads the small file, and its table names every format."""
    if not PAGE.is_file():
        pytest.skip("no documents here: an installation, not a checkout")
    monkeypatch.chdir(tmp_path)
    Path("line.kmall").write_bytes(files.kmall())
    text, names = PAGE.read_text(encoding="utf-8"), {}
    exec(re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)[0], names)
    assert "EM2042" in capsys.readouterr().out and names["roll"].shape == (3,)
    np.testing.assert_allclose(names["depth"], 9.0)
    from insonify.formats.instruments.open_instrument import instrument_formats

    for reader in instrument_formats():
        assert f"| {reader.format} | {', '.join(reader.suffixes)} |" in text
