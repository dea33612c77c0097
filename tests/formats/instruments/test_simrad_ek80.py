"""Claims about EK80 files: samples and settings are those written, and what is damaged is left out by name."""

import struct

import numpy as np
import pytest

from insonify.formats.instruments import open_instrument
from insonify.formats.store_description import StoreError
from insonify.processing.split_beam import echosounder_levels
from oracles import simrad_files as files
from oracles.instrument_files import DATA

REAL = DATA / "real" / "ek80-zeebrugge-38-70-120-200-333khz.raw"
NO_REAL = pytest.mark.skipif(not REAL.is_file(), reason=f"the recording {REAL.name} is not in the folder of data")
WHOLE = files.ek80()


def opened(tmp_path, content=WHOLE):
    """A file with some content, open."""
    (tmp_path / "a.raw").write_bytes(content)
    return open_instrument(tmp_path / "a.raw")


def test_samples_of_each_type_are_those_written(tmp_path):
    """Complex samples of both precisions in volts by sector, power in 3/256 dB, angles in 180/128 degrees."""
    with opened(tmp_path) as file:
        assert file.groups == {"38 kHz": 3, "38 kHz, twin": 3, "70 kHz": 3, "120 kHz": 3} and not file.omissions
        for group, sectors in (("38 kHz", 4), ("70 kHz", 3)):
            read = file.read(group, slice(1, None))
            assert list(read.ping) == [1, 2] and read.voltage.dtype == np.complex64
            expected = [files.volts(ping, sectors).T for ping in (1, 2)]
            np.testing.assert_array_equal(read.voltage, expected)
        read = file.read("120 kHz")
    assert "voltage" not in read and read.power_db.shape == (3, files.SAMPLES)
    np.testing.assert_allclose(read.power_db[1], -10 * np.log10(2) * (np.arange(files.SAMPLES) + 1 / 256), rtol=1e-6)
    np.testing.assert_allclose(read.phase_athwartship, np.pi / 2, rtol=1e-6)
    np.testing.assert_allclose(read.phase_alongship[0], np.arange(files.SAMPLES) * np.pi / 128, rtol=1e-6)


def test_settings_are_those_in_force(tmp_path):
    """Pulse, gain by its duration, water, calibration by ascending frequency, filters, start of the samples."""
    with opened(tmp_path) as file:
        tone, sweep = file.read("38 kHz"), file.read("70 kHz")
        settings = {setting.name: setting for setting in file.settings()}
        assert file.instrument.serial == "0, 1, 2, 3"
    assert list(tone.frequency) == [38e3] * 3 and list(tone.gain_db) == [25] * 3 and list(sweep.gain_db) == [20] * 3
    assert (sweep.frequency_start[0], sweep.frequency_end[0], sweep.frequency[0], sweep.swept[0]) == (6e4, 9e4, 75e3, 1)
    assert list(tone.transmit_power) == [250] * 3 and list(tone.temperature) == [12] * 3
    np.testing.assert_allclose(tone.range_step, 0.0075)
    np.testing.assert_allclose(tone.first_range, 0.015)
    np.testing.assert_allclose(tone.time - files.START, [0, 1, 2], atol=1e-6)
    assert list(sweep.calibration_frequency) == [6e4, 9e4] and list(sweep.calibrated_gain_db) == [26, 28]
    for stage, (taps, decimation) in files.FILTERS.items():
        assert tone[f"filter_{stage}"].attrs["decimation"] == decimation and "filter_1" not in sweep
        np.testing.assert_array_equal(tone[f"filter_{stage}"], taps)
    assert float(tone.beam_width_alongship) == pytest.approx(np.radians(7)) == settings[
        "38 kHz.transducer.BeamWidthAlongship"].value  # fmt: skip
    assert settings["38 kHz.mounting.TransducerOffsetX"].value == 7.5 and settings["temperature"].unit == "degC"


def test_sensors_and_profiles_are_those_written(tmp_path):
    """Fixes with a sound checksum, attitude in degrees with heave down, the profile of the environment."""
    with opened(tmp_path) as file:
        fixes, attitude, (profile,) = file.navigation(), file.attitude(), file.sound_speed_profiles()
    np.testing.assert_allclose(np.degrees([fixes.latitude[0], fixes.longitude[0]]), [51.5, -3.25])
    assert fixes.sizes["time"] == 2 * files.PINGS and set(fixes.quality.values) == {4}
    np.testing.assert_allclose(np.degrees([attitude["roll"][0], attitude.pitch[0], attitude.yaw[0]]), [1, -2, 180])
    np.testing.assert_allclose(attitude.heave, 0.5)
    assert list(profile.depth) == [0, 20] and list(profile.sound_speed) == [1500, 1490]


def test_attitude_in_the_binary_datagram_of_the_maker_is_read(tmp_path):
    """MRU1 encloses KM binary: roll, pitch, heading and heave from byte 40 on; one without its mark is left out."""
    inner = b"#KMB" + bytes(36) + struct.pack("<4f", 1.0, -2.0, 90.0, 0.25) + bytes(76)
    parts = [files.datagram(b"MRU1", 5, inner), files.datagram(b"MRU1", 6, b"#XYZ" + inner[4:])]
    with opened(tmp_path, WHOLE + b"".join(parts)) as file:
        attitude = file.attitude()
        assert [part.reason for part in file.omissions] == ["MRU1: no datagram KM binary inside"]
    last = attitude.isel(time=-1)
    np.testing.assert_allclose(np.degrees([last["roll"], last["pitch"], last["yaw"]]), [1, -2, 90])
    assert last.heave == 0.25 and attitude.sizes["time"] == files.PINGS + 1


def test_a_damaged_datagram_is_left_out_and_the_next_is_found(tmp_path):
    """Lengths that differ, a count that lies, the end of the file: each with offset and reason."""
    at = WHOLE.index(b"RAW3") - 4
    size = struct.unpack_from("<I", WHOLE, at)[0] + 8
    wrong = bytearray(WHOLE)
    wrong[at + size - 4] ^= 1
    lying = WHOLE[:at] + files.datagram(b"RAW3", 0, files.samples("tone 4", 0, 2**30)) + WHOLE[at + size :]
    for content, pings, where, reason in (
        (bytes(wrong), 2, at, "RAW3: the lengths before and after it differ"),
        (lying, 2, at, "RAW3: 1073741824 samples of type 0x408 do not fit its 544 bytes"),
        (WHOLE[:-9], 3, len(WHOLE) - size, "are stated, and the file has"),
        (WHOLE[:at] + b"no datagram" + WHOLE[at:], 3, at, "no datagram of a known kind"),
    ):
        with opened(tmp_path, content) as file:
            assert file.groups["38 kHz"] == pings
            (part,) = file.omissions
            assert part.offset == where and reason in part.reason, part


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaa">' + "".join(
    f'<!ENTITY {name} "{f"&{part};" * 9}">' for part, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("head", "reason"),
    [
        (files.configuration(BOMB + "]>").replace(b'"EK80"', b'"&i;"'), "DOCTYPE is refused"),
        (files.configuration().replace(b"</Channels>", b"", 1), "not well formed"),
    ],
)
def test_a_configuration_that_cannot_be_trusted_is_left_out(tmp_path, head, reason):
    """Entities are not expanded, nor is broken XML guessed at; samples are read without a configuration."""
    with opened(tmp_path, files.ek80(head)) as file:
        assert file.groups == dict.fromkeys(files.CHANNELS, 3)
        np.testing.assert_array_equal(file.read("twin").voltage[2], files.volts(2, 4).T)
        (part,) = file.omissions
    assert part.offset == 0 and reason in part.reason


def test_the_names_of_earlier_versions_are_known(tmp_path):
    """Length of the pulse by its former name; the sample rate of the type of transceiver where none is stated."""
    head = files.configuration().replace(b'PulseDuration="', b'PulseLength="')
    head = head.replace(b'RxSampleFrequency="600000"', b'TransceiverType="WBT HP"')
    former = files.parameter("tone 4").replace(b"PulseDuration", b"PulseLength")
    parts = [(b"XML0", head), (b"XML0", former), (b"RAW3", files.samples("tone 4", 0))]
    with opened(tmp_path, b"".join(files.datagram(kind, 0, body) for kind, body in parts)) as file:
        pings = file.read("38 kHz")
    assert pings.pulse_length == 2e-4 and pings.gain_db == 25 and float(pings.receiver_sample_rate) == 187.5e3


def test_a_ping_whose_parameters_are_damaged_has_samples_without_settings(tmp_path):
    """Its settings are NaN, and the datagram of the parameters is listed."""
    damaged = WHOLE.replace(b'Slope="0.1"', b"Slope='0.1\"", 1)
    with opened(tmp_path, damaged) as file:
        pings = file.read("38 kHz")
        assert [part.reason[:30] for part in file.omissions] == ["XML0: XML that is not well for"]
    np.testing.assert_array_equal(np.isnan(pings.transmit_power), [True, False, False])
    np.testing.assert_array_equal(pings.voltage[0], files.volts(0, 4).T)


def test_more_memory_than_allowed_is_refused(tmp_path, monkeypatch):
    """The refusal states how many pings fit."""
    monkeypatch.setattr("insonify.formats.instruments.instrument_file.MAX_VALUES", 2 * 8 * files.SAMPLES)
    with opened(tmp_path) as file, pytest.raises(StoreError, match="Read at most 2 at once"):
        file.read("38 kHz")


@NO_REAL
def test_the_echo_train_in_six_metres_of_water_is_that_published():
    """Second echo re the first by frequency; multiples at 2 and 3 times the first range: their mirror is the hull.

    Levels within 0.3 dB: half the last digit and the choice of the window; leading edges within a sixth of the pulse.
    The first echoes at 38 and 70 kHz are clipped at 1.13 V in every sector, so that the true ratios there are lower.
    """
    second = {"38 kHz": -12.4, "70 kHz": -23.2, "120 kHz": -23.2, "200 kHz": -30.4, "333 kHz": -39.3}
    third = dict(zip(second, (-40, -48, -48, -59, -71), strict=True))
    with open_instrument(REAL) as file:
        assert file.groups == dict.fromkeys(second, 2) and not file.check()
        for group, level in second.items():
            pings = file.read(group)
            assert float(pings.temperature[0]) == 15.9 and float(pings.salinity[0]) == 34.8
            assert float(pings.pulse_length[0]) == 0.256e-3
            voltage = pings.voltage.values
            power = (np.abs(voltage.mean(1)) ** 2).mean(0)
            slant = float(pings.range_step[0]) * np.arange(power.size)
            spans = [np.flatnonzero((slant > low) & (slant < low + 2)) for low in (4.9, 10.8, 17.0)]
            peaks = [span[np.argmax(power[span])] for span in spans]
            levels = 10 * np.log10(power[peaks] / power[peaks[0]])
            assert levels[1] == pytest.approx(level, abs=0.3) and levels[2] == pytest.approx(third[group], abs=1.0)
            clipped = np.abs(voltage[..., spans[0]]) > 1.05
            assert (clipped.sum() > 100) == (group in ("38 kHz", "70 kHz")) and np.abs(
                voltage[..., spans[0]]
            ).max() < 1.15
            edges = [
                slant[span[0] + np.argmax(power[span] > power[peak] / 4)]
                for span, peak in zip(spans, peaks, strict=True)
            ]
            assert slant[peaks[0]] == pytest.approx(5.83, abs=0.1)
            assert edges[1] / edges[0] == pytest.approx(2, abs=0.03)
            assert edges[2] / edges[0] == pytest.approx(3, abs=0.06)
            echo = voltage[..., peaks[0] - 12 : peaks[0] + 13]
            cross = np.abs(echo @ np.conj(np.swapaxes(echo, 1, 2)))
            own = np.sqrt(np.diagonal(cross, axis1=1, axis2=2))
            assert np.all(cross / (own[:, :, None] * own[:, None]) > 0.76)


@NO_REAL
def test_another_reader_finds_the_same_samples_and_power():
    """Complex samples bit for bit, times in a microsecond, power in 1e-4 dB, target strength in 0.02 dB.

    Power is single precision there. Its sound speed is computed, ours is stated by the file: absorption differs by it.
    """
    other = pytest.importorskip("themachinethatgoesping.echosounders", reason="the other reader is not installed")
    theirs = other.simradraw.SimradRawFileHandler(str(REAL), show_progress=False)
    raw = {part.get_timestamp(): part for part in theirs.datagram_interface.datagrams("RAW3")}
    with open_instrument(REAL) as file:
        ours = {(pings := file.read(group)).attrs["channel"]: pings for group in file.groups}
    levels = {channel: echosounder_levels(pings) for channel, pings in ours.items()}
    for number, ping in enumerate(theirs.get_pings()):
        channel, row = ping.get_channel_id(), number // len(ours)
        found, level = ours[channel].isel(ping=row), levels[channel].isel(ping=row)
        assert ping.get_timestamp() == pytest.approx(float(found.time), abs=1e-6)
        samples = np.ascontiguousarray(raw[ping.get_timestamp()].get_sample_data().complex_samples)
        np.testing.assert_array_equal(found.voltage.values.T, samples.view(np.complex64)[..., 0])
        np.testing.assert_allclose(10 * np.log10(level.received_power), ping.watercolumn.get_power()[0], atol=1e-4)
        speed = ping.watercolumn.get_watercolumn_calibration().get_sound_velocity_m_s()  # of their wavelength
        point = level.point_scattering_strength - 20 * np.log10(speed / found.sound_speed)
        np.testing.assert_allclose(point[500:], ping.watercolumn.get_ap()[0][500:], atol=0.02)


@NO_REAL
@pytest.mark.filterwarnings("ignore")
def test_a_third_reader_finds_the_same_samples_filters_and_settings():
    """Samples and filters bit for bit, settings of pings, gains, attitude and positions to the last digit of the text.

    Positions there are of all sentences, ours of GGA; the gain is that listed for the duration of the pulse.
    """
    echopype = pytest.importorskip("echopype", reason="the other reader is not installed")
    data = echopype.open_raw(str(REAL), sonar_model="EK80")
    beams, extras, platform = (data[name] for name in ("Sonar/Beam_group1", "Vendor_specific", "Platform"))
    degree = np.pi / 180
    with open_instrument(REAL) as file:
        groups, attitude, fixes = [file.read(group) for group in file.groups], file.attitude(), file.navigation()
    for ours in groups:
        theirs, extra = beams.sel(channel=ours.attrs["channel"]), extras.sel(channel=ours.attrs["channel"])
        theirs = theirs.dropna("ping_time", how="all", subset=["slope"])
        seconds = (theirs.ping_time.values - np.datetime64(0, "s")) / np.timedelta64(1, "s")
        np.testing.assert_allclose(ours.time, seconds, rtol=0, atol=2e-6)
        samples = (theirs.backscatter_r + 1j * theirs.backscatter_i).values.transpose(0, 2, 1)
        sectors, count = ours.voltage.shape[1:]
        np.testing.assert_array_equal(ours.voltage, samples[:, :sectors, :count].astype(np.complex64))
        for name, (field, scale) in {
            "pulse_length": ("transmit_duration_nominal", 1), "transmit_power": ("transmit_power", 1),
            "slope": ("slope", 1), "sample_interval": ("sample_interval", 1), "beam_type": ("beam_type", 1),
            "beam_width_alongship": ("beamwidth_twoway_alongship", degree),
            "beam_width_athwartship": ("beamwidth_twoway_athwartship", degree),
            "angle_sensitivity_alongship": ("angle_sensitivity_alongship", 1),
            "angle_offset_alongship": ("angle_offset_alongship", degree),
            "equivalent_beam_angle_db": ("equivalent_beam_angle", 1),
        }.items():  # fmt: skip
            np.testing.assert_allclose(ours[name], scale * theirs[field], rtol=1e-6, err_msg=name)
        entry = int(np.argmin(np.abs(extra.pulse_length.values - float(ours.pulse_length[0]))))
        assert float(ours.gain_db[0]) == float(extra.gain_correction[entry])
        assert float(ours.sa_correction_db[0]) == float(extra.sa_correction[entry])
        assert float(ours.transceiver_impedance) == float(extra.impedance_transceiver)
        assert float(ours.receiver_sample_rate) == float(extra.receiver_sampling_frequency)
        for stage, name in ((1, "WBT"), (2, "PC")):
            taps = (extra[f"{name}_coeffs_real"] + 1j * extra[f"{name}_coeffs_imag"]).values.ravel()
            np.testing.assert_array_equal(ours[f"filter_{stage}"], taps[np.isfinite(taps)].astype(np.complex64))
            assert ours[f"filter_{stage}"].attrs["decimation"] == float(extra[f"{name}_deci_fac"].values.item())
    for name, field in (("roll", "roll"), ("pitch", "pitch"), ("yaw", "heading")):
        np.testing.assert_allclose(attitude[name], degree * platform[field], rtol=1e-12)
    np.testing.assert_array_equal(attitude.heave, platform.vertical_offset)
    positions = np.column_stack([platform.latitude, platform.longitude])[platform.sentence_type.values == "GGA"]
    for fix in np.degrees(np.column_stack([fixes.latitude, fixes.longitude])):
        assert np.abs(positions - fix).max(axis=1).min() < 1e-9
