"""Claims about SONAR-netCDF4 files: they satisfy the convention, and give back samples, poses and beam directions."""

import numpy as np
import pytest
import xarray as xr

import insonify
from insonify.frames import mounting_rotation
from oracles.sonar_netcdf4 import faults
from oracles.surveys import ORIGIN, aperture, multibeam, sidescan

netcdf4 = pytest.importorskip("netCDF4")
POINT = {"shape": "point", "label": "p", "position": (0.3, 13.0, 9.0), "target_strength_db": 0.0}


@pytest.fixture(scope="module", params=["complex", "expected", "downward"])
def both(request, tmp_path_factory):
    """A recording and its file: of elements, of two sides, of a multibeam."""
    made = {"complex": lambda: aperture(targets=[POINT], pings=3), "expected": lambda: sidescan(pings=3),
            "downward": lambda: multibeam(targets=[POINT], paths={"contributions": ("target",)})}  # fmt: skip
    recording = insonify.simulate(made[request.param](), threads=1).assign_attrs(ORIGIN)
    path = tmp_path_factory.mktemp("a") / "a.nc"
    with netcdf4.Dataset(insonify.export(recording, path, "sonar-netcdf4")) as file:
        yield recording, file, path


def test_the_convention_finds_no_fault(both):
    """By its own tables: groups, attributes, variables with dimensions, types, units and ranges."""
    assert faults(both[1]) == []


def test_the_validator_finds_what_is_missing(both, tmp_path):
    """A copy without its beam rotations and with another version is refused."""
    broken = tmp_path / "b.nc"
    broken.write_bytes(both[2].read_bytes())
    with netcdf4.Dataset(broken, "a") as file:
        file.sonar_convention_version = "1.0"
        file["Sonar/Beam_group1"].renameVariable("rx_beam_rotation_phi", "phi")
        file["Platform"].renameGroup("Gyro", "Gyros")
        file["Sonar/Beam_group1/receiver_sensitivity"].units = "V"
        assert len(faults(file)) == 5  # the renamed variable is missing, and an unknown one in its place


def test_samples_come_back_bit_by_bit(both):
    """Real and imaginary parts, or rms amplitudes, of every ping and beam, and their times."""
    recording, file, _ = both
    group = file["Sonar/Beam_group1"]
    real = np.array([[group["backscatter_r"][p, b, 0] for b in range(recording.sizes["channel"])]
                     for p in range(recording.sizes["ping"])])  # fmt: skip
    if "pressure" in recording:
        imaginary = np.array([[group["backscatter_i"][p, b, 0] for b in range(recording.sizes["channel"])]
                              for p in range(recording.sizes["ping"])])  # fmt: skip
        np.testing.assert_array_equal(real + 1j * imaginary, recording.pressure.values)
    else:
        np.testing.assert_array_equal(real, np.sqrt(recording.intensity.values).astype(np.float32))
    time = group["blanking_interval"][0, 0] + np.arange(real.shape[2]) * group["sample_interval"][0]
    np.testing.assert_allclose(time, recording.time, rtol=1e-6)
    np.testing.assert_allclose(np.diff(group["ping_time"][:].astype(np.int64)) / 1e9, np.diff(recording.ping_time))


def test_type_2_gives_the_strength_of_a_target(tmp_path):
    """TS = 20 log(A / sqrt 2) + 40 log r + 2 alpha r - (SL + K + dG + TVG), by the file alone, of one of -12 dB."""
    target = {"shape": "point", "label": "p", "position": (0.0, 9.0, 9.0), "target_strength_db": -12.0}
    sonar = {
        "source_level_db": 210,
        "pulse": {"kind": "cw", "frequency": 300e3, "duration": 0.5e-3, "taper": "hann"},  # no overshoot in the band
        "transmit": {"kind": "point"}, "receive": {"kind": "point"}, "mounting": {"bearing": "90 deg", "tilt": 0.0},
    }  # fmt: skip
    scenario = sidescan(
        targets=[target], pings=1, sonar=sonar, field="coherent",
        paths={"contributions": ("target",), "max_reflections": 0},
        water={"sound_speed": 1500.0, "noise_level_db": None},
    )  # fmt: skip
    path = insonify.export(insonify.simulate(scenario, threads=1), tmp_path / "a.nc", "sonar-netcdf4")
    with netcdf4.Dataset(path) as file:
        group = file["Sonar/Beam_group1"]
        amplitude = np.hypot(group["backscatter_r"][0, 0, 0], group["backscatter_i"][0, 0, 0])
        sample, away = int(amplitude.argmax()), np.hypot(9.0, 3.0)
        speed, alpha = (
            file[f"Environment/{name}"][...].item() for name in ("sound_speed_indicative", "absorption_indicative")
        )
        start = float(group["blanking_interval"][0, 0] - group["sample_time_offset"][0, 0])
        reach = speed * (start + sample * float(group["sample_interval"][0])) / 2
        assert 0 <= reach - away <= 0.5e-3 * speed / 2  # within the pulse
        known = sum(float(group[name][0, 0]) for name in (
            "transmit_source_level", "receiver_sensitivity", "gain_correction"))  # fmt: skip
        strength = 20 * np.log10(amplitude[sample] / np.sqrt(2)) + 40 * np.log10(away) + 2 * alpha * away
        assert strength - known - group["time_varied_gain"][0][sample] == pytest.approx(-12, abs=0.1)
        assert group["time_varied_gain"][0].size == amplitude.size


def test_transducers_are_those_of_the_channels(tmp_path):
    """Positions and functions of elements with a transmitter of its own, and its depth with pitch and roll."""
    changed = multibeam().with_({"sonar.transmit.offset": (0.5, 0.3, 0.2), "sonar.receive.offset": (0.1, 0.0, 0.1)})
    recording = insonify.simulate(changed, threads=1)
    with netcdf4.Dataset(insonify.export(recording, tmp_path / "a.nc", "sonar-netcdf4")) as file:
        group, platform = file["Sonar/Beam_group1"], file["Platform"]
        assert faults(file) == []
        place = np.stack([platform[f"transducer_offset_{axis}"][:] for axis in "xyz"], axis=1)
        receiving, sending = group["receive_transducer_index"][:], group["transmit_transducer_index"][0]
        np.testing.assert_allclose(place[receiving], recording.element_position, atol=1e-6)
        np.testing.assert_allclose(place[sending], np.tile([0.5, 0.3, 0.2], (64, 1)), atol=1e-6)
        assert len(place) == 65 and np.ptp(recording.element_position.values[:, 1]) > 0.15
        function = platform["transducer_function"][:]
        assert set(function[receiving]) == {0} and set(function[sending]) == {1}
        roll = recording.logged_attitude.values[:, 2]
        depth = recording.logged_position.values[:, 2] + 0.2 * np.cos(roll) + 0.3 * np.sin(roll)
        assert abs(roll).max() > 0.02
        np.testing.assert_allclose(group["tx_transducer_depth"][:], depth, atol=1e-6)


def test_a_transmit_beam_that_is_not_steered_points_along_boresight(tmp_path):
    """A level fan of receive beams over one transmit beam ahead: bearings of both, which psi alone can state."""
    steer = [float(angle) for angle in np.radians([-30, 0, 20])]
    sonar = {
        "source_level_db": 200, "pulse": {"kind": "cw", "frequency": 300e3, "duration": 0.1e-3},
        "transmit": {"kind": "planar", "width": 0.002, "height": 0.01, "steer": 0.0},
        "receive": {"kind": "planar", "width": 0.2, "height": 0.01, "steer": steer},
        "mounting": {"bearing": 0.0, "tilt": 0.0},
    }  # fmt: skip
    recording = insonify.simulate(sidescan(sonar=sonar, pings=1), threads=1)
    with netcdf4.Dataset(insonify.export(recording, tmp_path / "a.nc", "sonar-netcdf4")) as file:
        group = file["Sonar/Beam_group1"]
        for end, expected in (("rx", np.degrees(steer)), ("tx", [0.0, 0.0, 0.0])):
            phi, theta, psi = (np.radians(group[f"{end}_beam_rotation_{name}"][0].astype(float))
                               for name in ("phi", "theta", "psi"))  # fmt: skip
            north = np.cos(psi) * np.sin(theta) * np.cos(phi) + np.sin(psi) * np.sin(phi)
            east = np.sin(psi) * np.sin(theta) * np.cos(phi) - np.cos(psi) * np.sin(phi)
            np.testing.assert_allclose(np.degrees(np.arctan2(east, north)), expected, atol=1e-4)
            np.testing.assert_allclose(np.cos(theta) * np.cos(phi), 0, atol=1e-6)


def test_poses_and_beam_directions_keep_their_signs(both):
    """Heading, pitch, roll, depth; rotations psi, theta, phi turn the platform's z axis into the steered boresight."""
    recording, file, _ = both
    group = file["Sonar/Beam_group1"]
    attitude = np.radians([group[f"platform_{name}"][:] for name in ("heading", "pitch", "roll")]).T
    np.testing.assert_allclose(attitude, recording.logged_attitude, atol=1e-6)
    np.testing.assert_allclose(-group["platform_vertical_offset"][:], recording.logged_position[:, 2], rtol=1e-6)
    np.testing.assert_allclose(
        (group["platform_latitude"][:] - 54) * 111_284, recording.logged_position[:, 0], atol=2e-3
    )
    phi, theta, psi = (
        np.radians(group[f"rx_beam_rotation_{name}"][0].astype(float)) for name in ("phi", "theta", "psi")
    )
    pointing = np.stack([np.cos(psi) * np.sin(theta) * np.cos(phi) + np.sin(psi) * np.sin(phi),
                         np.sin(psi) * np.sin(theta) * np.cos(phi) - np.cos(psi) * np.sin(phi),
                         np.cos(theta) * np.cos(phi)], axis=1)  # fmt: skip
    scenario = insonify.surveys.survey.open_survey(recording).scenario
    expected = [mounting_rotation(one.mounting.bearing, one.mounting.tilt)[0] for one in scenario.sonar.side_sonars]
    np.testing.assert_allclose(pointing, np.repeat(expected, scenario.sonar.beam_count, axis=0), atol=1e-6)


def test_xarray_opens_all_groups(both):
    """As a tree, variable lengths included."""
    tree = xr.open_datatree(both[2], engine="netcdf4", decode_times=False)
    assert tree["Sonar/Beam_group1"]["backscatter_r"].values[1, 0, 0].size == both[0].sizes["time"]
    assert float(tree["Environment"]["sound_speed_indicative"]) == 1500.0
