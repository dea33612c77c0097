"""Claims about scenarios of recordings of real instruments: what a file states is in them, with its source."""

import re

import numpy as np
import pytest

from insonify import load_scenario, open_instrument
from insonify.cli import main
from insonify.formats.instruments.scenario_text import scenario_text
from insonify.formats.store_description import StoreError
from insonify.scenario.platform_poses import platforms
from insonify.sonar.beam import beams
from oracles import instrument_files, simrad_files
from oracles.instrument_files import DATA

pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
RECORDINGS = {
    "em2042-ostend-os02-300khz-b.kmall": "soundings", "ek80-zeebrugge-38-70-120-200-333khz.raw": "200 kHz",
    "em2040-belgica-0077.all": "soundings", "oculus-three-pings-8bit.raw": "image", "aris-1200-sample.aris": "image",
    "../scotsman-iver2.xtf": "port",
}  # fmt: skip


def scenario_of(tmp_path, file, *words):
    """The scenario that the command writes of a file, and its text."""
    out = tmp_path / "harbour.yaml"
    assert main(["scenario-from", str(file), "-o", str(out), *words]) == 0
    return load_scenario(out), out.read_text()


def poses_of(scenario):
    """Poses of the sonar at its pings."""
    return platforms(scenario).transmitter_poses


def real(name):
    """A public recording; skipped where it is absent."""
    path = DATA / "real" / name
    if not path.is_file():
        pytest.skip(f"{path.name}, a public recording, is not in the folder INSONIFY_DATA")
    return path


@pytest.mark.parametrize("name", RECORDINGS)
def test_every_public_recording_becomes_a_scenario(tmp_path, name):
    """It loads; frequency and sound speed at the sonar are the file's, and every value has a source."""
    scenario, text = scenario_of(tmp_path, real(name), "--group", RECORDINGS[name])
    with open_instrument(DATA / "real" / name) as file:
        data = file.read(RECORDINGS[name])
    assert scenario.sonar.pulse.frequency == pytest.approx(float(np.nanmedian(data.frequency)), rel=1e-5)
    depth = poses_of(scenario).position[0, 2]
    assert scenario.water.sound_speed_at(depth) == pytest.approx(float(np.nanmedian(data.sound_speed)), abs=3)
    for line in text.splitlines():
        value = re.match(r"  (\w+): (?!navigation|static)", line)
        assert value is None or value[1] == "sides" or " # " in line, line


def test_a_multibeam_keeps_geometry_beams_and_track(tmp_path):
    """EM2042: flat seabed at 8.2 m, 0.7 by 0.7 deg, source level, heading and heave of the attitude sensor."""
    scenario, text = scenario_of(tmp_path, real("em2042-ostend-os02-300khz-b.kmall"))
    assert scenario.seabed.depth == pytest.approx(8.2, abs=0.15) and 204 < scenario.sonar.source_level_db < 213
    for array, axis in ((scenario.sonar.transmit, 2), (scenario.sonar.receive, 1)):
        angle, direction = np.radians(0.35), np.zeros((1, 3))
        direction[0, 0], direction[0, axis] = np.cos(angle), np.sin(angle)
        gain = beams(array, scenario.sonar.pulse.frequency, 1480.7).single_beam(0).gain(direction)[0, 0]
        assert 20 * np.log10(gain) == pytest.approx(-3, abs=0.1)
    poses = poses_of(scenario)
    with open_instrument(real("em2042-ostend-os02-300khz-b.kmall")) as file:
        attitude, soundings = file.attitude(), file.soundings()
    assert np.ptp(poses.position[:, 2]) > 0.05 and "# soundings: source_level" in text
    assert poses.position[:, 2].min() > float(soundings.transducer_depth.min()) - 1e-3
    apart = np.angle(np.exp(1j * (attitude["yaw"].values[None] - poses.heading[:, None])))
    assert np.abs(apart).min(axis=1).max() < 1e-3  # half a step of the sensor


def test_an_echosounder_finds_the_seabed(tmp_path):
    """EK80 over 5.83 m: depth of the seabed below the transducer within a tenth of a metre, at every frequency."""
    for group in ("38 kHz", "70 kHz", "120 kHz", "200 kHz", "333 kHz"):
        folder = tmp_path / group[:3].strip()
        folder.mkdir()
        scenario, _ = scenario_of(folder, real("ek80-zeebrugge-38-70-120-200-333khz.raw"), "--group", group)
        assert scenario.seabed.depth - poses_of(scenario).position[0, 2] == pytest.approx(5.83, abs=0.1)


@pytest.mark.parametrize(("content", "suffix"), [(instrument_files.kmall(), "kmall"), (simrad_files.ek80(), "raw")])
def test_a_small_file_becomes_a_scenario(tmp_path, content, suffix):
    """Files that the tests write: the text states its sources, and a second run replaces nothing."""
    path = tmp_path / f"a.{suffix}"
    path.write_bytes(content)
    with open_instrument(path) as file:
        text = scenario_text(file, "a")
        with pytest.raises(StoreError, match="there is no group 'nothing'"):
            scenario_text(file, "a", "nothing")
    assert "# assumed" in text and ": frequency" in text
    out = tmp_path / "harbour.yaml"
    assert main(["scenario-from", str(path), "-o", str(out)]) == 0
    written = out.read_text()
    assert main(["scenario-from", str(path), "-o", str(out)]) == 2 and out.read_text() == written
