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
        assert len(faults(file)) == 2


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
