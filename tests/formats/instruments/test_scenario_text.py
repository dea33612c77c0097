"""Claims about scenarios of recordings of real instruments: what a file states is in them, with its source."""

import re

import numpy as np
import pytest
import xarray as xr

from insonify import load_scenario, open_instrument
from insonify.cli import main
from insonify.formats.instruments.instrument_file import Instrument, InstrumentFile, LeverArm
from insonify.formats.instruments.navigation_text import active_rows, navigation_log
from insonify.formats.instruments.scenario_text import scenario_text
from insonify.formats.instruments.scenario_values import leading_edge
from insonify.formats.instruments.soundings_grid import soundings_grid
from insonify.formats.store_description import StoreError
from insonify.scenario.platform_poses import platforms
from insonify.sonar.beam import beams
from insonify.sonar.receiver import response
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
    of_a_sector = np.unique(data.frequency.values[np.isfinite(data.frequency.values)])
    assert np.abs(scenario.sonar.pulse.frequency / of_a_sector - 1).min() < 1e-5
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
        angle, direction = np.radians(0.35) + array.steers[0][1], np.zeros((1, 3))
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


class Survey(InstrumentFile):
    """A multibeam without a file: three sectors, heading east at 2 m/s, over a seabed of one's own."""

    format = "survey"
    arm = LeverArm((8.0, -1.0, 3.0), "drawing")

    def __init__(self, path, depth):
        self.path, self.depth = path, depth

    matches = staticmethod(lambda head: False)
    _index = None
    instrument, groups = Instrument(), {"soundings": 20}

    def settings(self):
        """None."""
        return ()

    def lever_arm(self, group=None):
        """As drawn."""
        return self.arm

    def navigation(self):
        """Every second one a fix of another system, 5 m to the north."""
        time, other = np.arange(0, 10, 0.25), np.arange(40) % 2
        place = {"latitude": 0.9 + 5 * other / 6.37e6, "longitude": time * 2 / (6.39e6 * np.cos(0.9))}
        return xr.Dataset(
            {name: ("time", values) for name, values in place.items()} | {"active": ("time", other == 0)},
            {"time": time},
        )

    def attitude(self):
        """Level, heading east."""
        still = np.zeros(101)
        angles = {"roll": still, "pitch": still, "yaw": still + np.pi / 2}
        return xr.Dataset(
            {name: ("time", values) for name, values in angles.items()}, {"time": np.linspace(0, 10, 101)}
        )

    def read(self, group, pings=slice(None)):
        """Beams from -60 to 60 deg; depths by a function of metres east and north of the first fix."""
        angle, time = np.radians(np.linspace(-60, 60, 121)), np.arange(20) * 0.45
        forward = np.full((20, 121), 8.0)
        starboard = np.broadcast_to(-1 + 10 * np.tan(angle), forward.shape)
        depth = self.depth(2 * time[:, None] + forward, -starboard)
        alternating = np.where(np.arange(20) % 4, 1.0, 2.0)[:, None]
        per_sector = {
            "frequency": np.array([3e5, 2e5, 4e5]) * alternating, "tilt": np.radians([1.0, -2.0, 0.0]) * alternating,
            "sector_delay": np.array([0, 1e-3, 2e-3]) * alternating, "source_level": [210, 220, 215] * alternating,
            "pulse_length": np.array([1e-4, 2e-4, 3e-4]) * alternating, "focus_range": [5.0, 6, 7] * alternating,
        }  # fmt: skip
        per_beam = {
            "depth": depth, "forward": forward, "starboard": starboard,
            "travel_time": 20 / np.cos(angle) / 1500 + 0 * depth,
            "beam_angle": angle + 0 * depth, "sector": np.digitize(np.degrees(angle), [-20.5, 20.5]) + 0 * depth,
            "gain": 40 * np.log10(10 / np.cos(angle)) + 0 * depth,
        }  # fmt: skip
        per_ping = {"heading": time * 0 + np.pi / 2, "time": time, "transducer_depth": time * 0 + 2,
                    "sound_speed": time * 0 + 1500}  # fmt: skip
        return xr.Dataset(
            {name: (("ping", "tx_sector"), values) for name, values in per_sector.items()}
            | {name: (("ping", "beam"), values) for name, values in per_beam.items()}
            | {name: ("ping", values) for name, values in per_ping.items()}
        ).isel(ping=pings)


def sloping(east, north):
    """A plane, deeper to the east and to the north."""
    return 12 + 0.05 * east + 0.1 * north


@pytest.mark.parametrize("sector", [None, 0, 1, 2])
def test_each_transmit_sector_has_a_scenario(tmp_path, sector):
    """Frequency, pulse, level, tilt to the bow, gain: those of its commonest mode; None: the one in the middle."""
    text = scenario_text(Survey(tmp_path / "a", sloping), "a", sector=sector)
    (tmp_path / "a.yaml").write_text(text)
    sonar, row = load_scenario(tmp_path / "a.yaml").sonar, 1 if sector is None else sector
    assert sonar.pulse.frequency == [3e5, 2e5, 4e5][row] and sonar.source_level_db == [210, 220, 215][row]
    assert sonar.pulse.duration == pytest.approx([1e-4, 2e-4, 3e-4][row])
    assert np.degrees(sonar.transmit.steers[0][1]) == pytest.approx([-1, 2, 0][row], abs=1e-3)
    assert f"# Transmit sector {row} of 0 to 2" in text and f"transmitted {row} ms" in text
    assert f"focused at {5 + row} m" in text and ["-60 to -21", "-20 to 20", "21 to 60"][row] in text
    curve = np.array(sonar.recorder.stages[0].curve)
    np.testing.assert_allclose(curve[:, 1], 40 * np.log10(curve[:, 0]), atol=0.1)
    with pytest.raises(StoreError, match="no sector 3; group soundings has 0 to 2"):
        scenario_text(Survey(tmp_path / "a", sloping), "a", sector=3)


def test_the_log_is_of_the_transducer(tmp_path):
    """Lever arm, turned: 8 m ahead, so east, 1 m to port, so north; fixes of another system, 5 m off, are left out."""
    survey = Survey(tmp_path / "a", sloping)
    rows = np.array([line.split(",") for line in navigation_log(survey).splitlines()[1:]], float)
    north = (rows[:, 1] - np.degrees(0.9)) * 111_270
    east = np.radians(rows[:, 2]) * 6.39e6 * np.cos(0.9) - 2 * rows[:, 0]
    np.testing.assert_allclose(north, 1, atol=0.01)
    np.testing.assert_allclose(east, 8, atol=0.03)
    assert active_rows(survey.navigation()).sizes["time"] == 20
    survey.arm = None
    assert "no lever arm is stated" in scenario_text(survey, "a", log="a.csv")


def test_soundings_that_vary_become_a_grid(tmp_path):
    """A slope, in the scenario's frame, out to the recorded range; a bed that is flat for soundings has no grid."""
    survey = Survey(tmp_path / "a", sloping)
    (tmp_path / "a.csv").write_text(navigation_log(survey))
    start = np.array((tmp_path / "a.csv").read_text().splitlines()[1].split(",")[1:3], float)
    grid = soundings_grid(survey, *start)
    grid.write(tmp_path / "a.npz")
    (tmp_path / "a.yaml").write_text(scenario_text(survey, "a", log="a.csv", bathymetry="a.npz"))
    scenario = load_scenario(tmp_path / "a.yaml")
    north, east = np.meshgrid(np.arange(-10, 12, 2.0), np.arange(1.0, 8, 2), indexing="ij")
    true = sloping(east + 8, north + 1)
    found = np.vectorize(scenario.seabed.depth_at)(north, east)
    np.testing.assert_allclose(found, true, atol=0.04)  # a cell is 0.6 m
    assert np.ptp(grid.north) > 2 * 1.3 * 20 and np.isfinite(grid.depth).all()
    assert soundings_grid(Survey(tmp_path / "a", lambda east, north: 12 + 0.01 * north), *start) is None
    with pytest.raises(FileExistsError):
        grid.write(tmp_path / "a.npz")


class DamagedSurvey(Survey):
    """The same with a few numbers and names that no sonar states."""

    instrument = Instrument("Maker", "EM\x7f\x00 2040")

    def read(self, group, pings=slice(None)):
        """Every other beam of the first ping is wrong in one variable."""
        data = super().read(group, slice(None)).copy(deep=True)
        wrong = {
            "travel_time": (np.inf, 1e36),
            "forward": (3e38, -1e9),
            "depth": (1e30, -2e5),
            "gain": (np.nan, np.inf),
        }
        for row, (name, values) in enumerate(wrong.items()):
            for number, value in enumerate(values):
                data[name][0, 4 * row + 2 * number] = value
        return data.isel(ping=pings)

    def sound_speed_profiles(self):
        """One depth twice, and one below any sea."""
        depth, speed = [0, 5, 5.0001, 20, 2e38], [1500.0, 1501, 1502, 1503, 1504]
        return (xr.Dataset({"sound_speed": ("depth", speed)}, {"depth": np.array(depth)}),)


def test_damaged_numbers_and_names_leave_a_scenario_that_loads(tmp_path):
    """Grid, window and gains are those of the sound soundings."""
    sound, damaged = Survey(tmp_path / "a", sloping), DamagedSurvey(tmp_path / "a", sloping)
    start = np.array(navigation_log(sound).splitlines()[1].split(",")[1:3], float)
    grid, expected = soundings_grid(damaged, *start), soundings_grid(sound, *start)
    assert np.interp(9, grid.north, grid.depth[:, 40]) == pytest.approx(
        np.interp(9, expected.north, expected.depth[:, 40]), abs=0.1
    )
    scenarios = []
    for survey in (sound, damaged):
        (tmp_path / "a.yaml").write_text(scenario_text(survey, "a"))
        scenarios.append(load_scenario(tmp_path / "a.yaml"))
    whole, partial = scenarios
    assert "EM?? 2040" in (tmp_path / "a.yaml").read_text()
    assert partial.track.window[1] == pytest.approx(whole.track.window[1], rel=0.05)
    assert partial.seabed.depth == pytest.approx(whole.seabed.depth, rel=0.01)
    curves = [np.array(each.sonar.recorder.stages[0].curve) for each in scenarios]
    np.testing.assert_allclose(curves[1], curves[0], rtol=0.05)


def test_the_antenna_of_a_real_multibeam_is_not_its_transducer():
    """EM2040: soundings, stated re the antenna, lie ahead by the lever arm (tilt and pitch: 0.3 m); the log is smooth.

    Two systems of positions, 5.6 m apart, and two of attitude, 0.3 deg apart, alternate in the file.
    """
    with open_instrument(real("em2040-belgica-0077.all")) as file:
        rows = np.array([line.split(",") for line in navigation_log(file).splitlines()[1:]], float)
        arm, soundings = file.lever_arm(), file.soundings()
    assert arm.position[:2] == pytest.approx((0.377 + 7.887, 0.008 - 0.875)) and "P1X" in arm.source
    assert float(np.nanmedian(soundings.forward)) == pytest.approx(arm.position[0], abs=0.3)
    speed = np.hypot(np.gradient(rows[:, 1], rows[:, 0]) * 111e3, np.gradient(rows[:, 2], rows[:, 0]) * 70e3)
    assert speed.min() > 1.0 and speed.max() < 2.5


STATED = {
    "em2042-ostend-os02-300khz-b.kmwcd": ("water column", 30.0, 30.0, {"bits": 8, "step_db": 0.5}),
    "em2040-belgica-0077.wcd": ("water column", 30.0, 40.0, {"bits": 8, "step_db": 0.5}),
    "em2040-belgica-0077.all": ("seabed image", 40.0, 0.0, {"bits": 16, "step_db": 0.1}),
    "../scotsman-iver2.xtf": ("port", 40.0, 0.0, {"bits": 15, "step_db": None}),
    "oculus-three-pings-8bit.raw": ("image", 40.0, 0.0, {"bits": 8, "step_db": None}),
    "aris-1200-sample.aris": ("image", 0.0, 24.0, {"bits": 8, "step_db": 80 / 255, "signed": False}),
}  # fmt: skip


@pytest.mark.parametrize("name", STATED)
def test_the_recorder_is_the_one_that_the_file_states(tmp_path, name):
    """X, offset and absorption of the gain, gamma, bins, bits and steps of the format; what is not known is marked."""
    group, spreading, offset, rounding = STATED[name]
    scenario, text = scenario_of(tmp_path, real(name), "--group", group)
    stages = scenario.sonar.recorder.stages
    gains = [stage for stage in stages if stage.kind == "gain"]
    assert any((gain.tvg_db_per_decade, gain.fixed_db) == (spreading, offset) for gain in gains)
    for key, value in rounding.items():
        assert getattr(stages[-1], key) == (value and pytest.approx(value, rel=1e-5))
    if name.startswith("oculus"):
        assert stages[2].gamma == pytest.approx(127 / 255, rel=1e-3) and stages[1].samples == 703
    if "scotsman" in name:
        assert stages[1].samples == 1024 and stages[1].keep == "peak"
    for line in re.findall(r"- {kind.*", text):
        assert re.search(r"# (format|assumed|\S+.*(:|assumed))", line), line


def test_an_echosounder_has_no_recorder_but_the_band_and_pulse_of_its_file(tmp_path):
    """EK80: filters pass the noise of 17.1 kHz; the bed lies at the leading edge, not at the peak 5 cm on."""
    scenario, text = scenario_of(tmp_path, real("ek80-zeebrugge-38-70-120-200-333khz.raw"), "--group", "38 kHz")
    offset = np.linspace(-20e3, 20e3, 4001)
    assert scenario.sonar.recorder is None
    assert np.sum(response(scenario.sonar.receiver, offset) ** 2) * 10 == pytest.approx(17.1e3, rel=0.01)
    assert scenario.sonar.pulse.taper_fraction == pytest.approx(2 * 0.41118, rel=1e-3)
    assert "leading edge of the strongest echo, 5.75 m" in text


def test_a_leading_edge_lies_at_half_the_amplitude_of_the_peak():
    """A ramp of 10 steps to 1 behind noise of 0.1: half is reached at its fifth sample."""
    amplitude = np.concatenate([np.full(20, 0.1), np.linspace(0.1, 1, 10), np.full(5, 0.3)])
    assert leading_edge(amplitude) == pytest.approx(24, abs=1e-9)
    assert leading_edge(np.ones(3)) == 0


def test_the_command_writes_a_scenario_for_each_sector(tmp_path):
    """Three files, one log; each loads with a frequency of its own swath."""
    out = tmp_path / "line.yaml"
    file = real("em2042-ostend-os02-300khz-b.kmall")
    assert main(["scenario-from", str(file), "-o", str(out), "--sector", "all"]) == 0
    found = [load_scenario(tmp_path / f"line-sector-{k}.yaml") for k in range(3)]
    assert [one.sonar.pulse.frequency for one in found] == [320e3, 380e3, 320e3] and not out.exists()
    assert main(["scenario-from", str(file), "-o", str(tmp_path / "b.yaml"), "--sector", "two"]) == 2
