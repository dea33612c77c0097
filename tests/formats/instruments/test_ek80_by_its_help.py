"""Claims about EK80 files: bytes in the order of the maker's help "Interface" (file formats 1.20 to 1.25).

No layout of the reader or of other tests is used.
"""

import struct

import numpy as np
import pytest

from insonify import open_instrument

TICKS = 127510454149223493
"""Time of the help's example, steps of 100 ns since 1601; 25 January 2005, 12:50:14.9223493."""
TIME = (TICKS - 11644473600 * 10**7) / 1e7
CHANNELS = "WBT 545603-15 ES120-7C", "WBT 545604-15 ES38-7"


def datagram(kind, body):
    """One datagram: length, type, time, content, length."""
    content = kind + struct.pack("<Q", TICKS) + body
    return struct.pack("<I", len(content)) + content + struct.pack("<I", len(content))


def samples(kind, channel, datatype, offset, count, values):
    """A sample datagram: channel, type of data, two spare bytes, first sample, number of samples, samples."""
    head = channel.encode().ljust(128, b"\0") + struct.pack("<h2xii", datatype, offset, count)
    return datagram(kind, head + values)


def opened(tmp_path, *datagrams):
    """A file of a configuration and some datagrams, open."""
    rows = "".join(
        f'<Channel ChannelID="{name}" PulseDuration="6.4E-05;0.000128" PulseDurationFM="0.001024;0.002048">'
        f'<Transducer Frequency="{frequency}" BeamType="1" Gain="25;26" SaCorrection="-0.1;-0.2" /></Channel>'
        for name, frequency in zip(CHANNELS, (120000, 38000), strict=True)
    )
    text = "<Configuration><Transceivers><Transceiver Impedance='5400' RxSampleFrequency='1500000'><Channels>"
    head = datagram(b"XML0", f"{text}{rows}</Channels></Transceiver></Transceivers></Configuration>".encode())
    (tmp_path / "a.raw").write_bytes(head + b"".join(datagrams))
    return open_instrument(tmp_path / "a.raw")


def parameters(*channels):
    """Settings of a ping of one or more channels: a sweep of the first, a tone of the others."""
    fields = ['PulseForm="1" FrequencyStart="95000" FrequencyEnd="160000" PulseDuration="0.002048" TransmitPower="250"',
              'PulseForm="0" Frequency="38000" PulseDuration="6.4E-05" TransmitPower="2000"']  # fmt: skip
    rows = "".join(
        f'<Channel ChannelID="{name}" ChannelMode="0" {fields[CHANNELS.index(name)]} Slope="0.0102796052631579" '
        f'SampleInterval="1.06666666666667E-05" SoundVelocity="1500" Impedance="75" Phase="0" {" " * 400}/>'
        for name in channels
    )
    return datagram(b"XML0", f"<Parameter>{rows}</Parameter>".encode())


def test_samples_of_a_ping(tmp_path):
    """Type 1032 is four complex floats per sample, real before imaginary, sector by sector; bits 8 to 10 count them.

    Angles are a word whose high byte is the alongship one, 180/128 deg a step, positive fore and to starboard; power
    comes before them in steps of 10 log10(2) / 256 dB.
    """
    numbers = np.arange(24, dtype="<f4")  # 3 samples of 4 sectors
    words = struct.pack("<4h", -256, 0, 512, -1) + struct.pack("<4H", 0x40C0, 0x0001, 0x8000, 0xFF7F)
    pings = [
        samples(b"RAW3", CHANNELS[0], 1032, 5, 3, numbers.tobytes()),
        samples(b"RAW3", CHANNELS[0], 1032 | 0x2000, 0, 3, numbers.tobytes()),
        samples(b"RAW3", CHANNELS[1], 0b11, 0, 4, words),
    ]
    with opened(tmp_path, parameters(CHANNELS[0]), *pings) as file:
        swept, tone = file.read("120 kHz"), file.read("38 kHz")
        assert file.check() == ()
    assert swept.time.values.tolist() == pytest.approx([TIME] * 2, abs=1e-6) and swept.sizes["sector"] == 4
    for voltage in swept.voltage.values:
        assert voltage[2].tolist() == [4 + 5j, 12 + 13j, 20 + 21j]
    assert float(swept.first_range[0]) == pytest.approx(5 * 1500 / 2 * 1.06666666666667e-05)
    assert tone.power_db[0].values.tolist() == pytest.approx(10 * np.log10(2) * np.array([-1, 0, 2, -1 / 256]))
    assert np.degrees(tone.phase_alongship[0].values).tolist() == pytest.approx([90, 0, -180, -180 / 128])
    assert np.degrees(tone.phase_athwartship[0].values).tolist() == pytest.approx([-90, 180 / 128, 0, 127 * 180 / 128])


def test_settings_of_several_channels_in_one_datagram(tmp_path):
    """Each channel has its own settings: a <Parameter> may hold more than one <Channel>."""
    pings = [samples(b"RAW3", name, 1032, 0, 1, bytes(32)) for name in CHANNELS]
    with opened(tmp_path, parameters(*CHANNELS), *pings) as file:
        swept, tone = file.read("120 kHz"), file.read("38 kHz")
    names = "swept", "frequency_start", "frequency_end", "pulse_length", "transmit_power", "gain_db", "sa_correction_db"
    for found, values in (
        (swept, (1, 95e3, 160e3, 2.048e-3, 250, 26, -0.2)),
        (tone, (0, 38e3, 38e3, 6.4e-5, 2000, 25, -0.1)),
    ):
        assert [float(found[name][0]) for name in names] == list(values)


def test_filters_and_motion(tmp_path):
    """FIL1; MRU0 in degrees and metres; MRU1 with KM binary, whose status marks what is invalid."""
    taps = np.array([0.25, -0.5j], "<c8")
    filters = struct.pack("<hBb", 1, 0, 2) + CHANNELS[0].encode().ljust(128, b"\0") + struct.pack("<hh", 2, 6)
    inner = [
        struct.pack("<4sHHIII2d5f", b"#KMB", 132, 1, 1100000000, 0, status, 51.5, -3.25, 30.0, 1.5, -2.5, 270.0, 0.25)
        + bytes(76)
        for status in (0, 1, 2, 4, 8, 2 << 16)
    ]
    assert {len(part) for part in inner} == {132}
    parts = [datagram(b"FIL1", filters + taps.tobytes()), datagram(b"MRU0", struct.pack("<4f", -0.5, 3.0, -1.0, 90.0))]
    with opened(
        tmp_path, *parts, *(datagram(b"MRU1", part) for part in inner), samples(b"RAW3", CHANNELS[0], 1032, 0, 0, b"")
    ) as file:
        ping, poses = file.read("120 kHz"), file.attitude()
        assert file.check() == ()
    assert ping["filter_1"].values.tolist() == [0.25, -0.5j] and ping["filter_1"].attrs["decimation"] == 6
    nan = np.nan
    np.testing.assert_allclose(np.degrees(poses["roll"]), [3, 1.5, 1.5, nan, 1.5, 1.5, 1.5])
    np.testing.assert_allclose(np.degrees(poses.pitch), [-1, -2.5, -2.5, nan, -2.5, -2.5, -2.5])
    np.testing.assert_allclose(np.degrees(poses.yaw), [90, 270, 270, 270, nan, 270, 270])
    np.testing.assert_allclose(poses.heave, [-0.5, 0.25, 0.25, 0.25, 0.25, nan, 0.25])


def test_positions_behind_a_port(tmp_path):
    """NME1 of an EA640 has the port in 32 characters before the sentence, NME0 has the sentence alone."""
    sentence = b"$GPGGA,120000,5713.213,N,01041.458,E,2,9,1,0,M,0,M,,\r\n"
    parts = datagram(b"NME0", sentence), datagram(b"NME1", b"Lan Port 3, first of two".ljust(32, b"\0") + sentence)
    with opened(tmp_path, *parts) as file:
        fixes = file.navigation()
    np.testing.assert_allclose(np.degrees(fixes.latitude), [57 + 13.213 / 60] * 2)
    np.testing.assert_allclose(np.degrees(fixes.longitude), [10 + 41.458 / 60] * 2)
