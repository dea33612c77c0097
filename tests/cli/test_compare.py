"""Claims about `insonify compare`: every form of report, and advice where two recordings cannot be compared."""

import json

import numpy as np
import pytest

from insonify.cli import main
from insonify.records.recording import RecordingLayout, recording_dataset
from oracles.instrument_files import DATA
from oracles.speckled_recordings import SpeckledScene

EK80 = DATA / "real/ek80-zeebrugge-38-70-120-200-333khz.raw"


def stored(path, seed, frequency=2e5, **changes):
    """A draw of a speckled scene as a netCDF recording of ours."""
    draw = SpeckledScene(pings=16, samples=300).but(**changes).samples_of(seed)
    time = 2 * draw.slant_range / 1500.0
    poses = np.zeros((16, 3))
    layout = RecordingLayout("pressure", time, np.arange(16.0), np.zeros(1), poses, poses,
                             slant_range=draw.slant_range)  # fmt: skip
    recording_dataset(layout, {"centre_frequency": frequency}, draw.values, np.arange(16)).to_netcdf(path)
    return str(path)


def test_reports_have_all_forms(tmp_path, capsys):
    """Text, JSON, a picture and a page with its pictures inside; the JSON has every number of the text's verdict."""
    pair = stored(tmp_path / "a.nc", 1), stored(tmp_path / "b.nc", 2, noise_db=-30.0)
    for suffix in (".json", ".png", ".html"):
        assert main(["compare", *pair, "-o", str(tmp_path / f"r{suffix}")]) == 0
    output = capsys.readouterr().out
    about = json.loads((tmp_path / "r.json").read_text())
    assert about["summary"] in output and "level against range" in about["summary"]
    assert all(finding["verdict"] in ("alike", "different", "not compared") for finding in about["findings"])
    page = (tmp_path / "r.html").read_text()
    assert about["summary"] in page and page.count("data:image/png;base64,") >= 3 and "http" not in page
    assert (tmp_path / "r.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (("a.nc", "absent.nc"), "there is no such file. Give two recordings"),
        (("a.nc", "a.nc", "-o", "report.txt"), "not a report; end its name in .html, .json, .png"),
        (("a.nc", "a.nc", "-o", "absent/report.png"), "mkdir -p absent"),
    ],
)
def test_wrong_input_is_refused_with_advice(words, advice, tmp_path, monkeypatch, capsys):
    """Exit code 2, and a message with the remedy."""
    monkeypatch.chdir(tmp_path)
    stored(tmp_path / "a.nc", 1)
    assert main(["compare", *words]) == 2
    assert advice in capsys.readouterr().err


@pytest.mark.skipif(not EK80.exists(), reason="the public recording is absent")
def test_a_file_with_several_groups_names_them(tmp_path, capsys):
    """Five frequencies, none that of the other recording: exit code 2 and the names of the groups."""
    assert main(["compare", str(EK80), stored(tmp_path / "a.nc", 1, frequency=455e3)]) == 2
    assert "--group '38 kHz' or '70 kHz'" in capsys.readouterr().err
