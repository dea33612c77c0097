"""Claims about XTF that the small file does not have: many channels, other samples, other positions, odd packets."""

import numpy as np
import pytest

from insonify import open_instrument
from oracles import instrument_files as files

P = files.xtf_parts
DATE = {"magic": 0xFACE, "year": 2023, "month": 11, "day": 14, "hour": 22}


def packet(kind, part=P.PACKET, body=b"", **fields):
    """One packet with its length."""
    head = np.frombuffer(files.record(part, magic=0xFACE, kind=kind, **fields), part).copy()
    head["size"] = part.itemsize + len(body)
    return head.tobytes() + body


def written(path, channels, packets, **head):
    """A file with a header for these channels, rows of (kind, frequency, size, format), and packets."""
    infos = np.zeros(max(len(channels), 6), P.CHANNEL)
    for name, column in zip(
        ("kind", "frequency", "sample_size", "sample_format"), zip(*channels, strict=True), strict=True
    ):
        infos[name][: len(channels)] = column
    start = files.record(P.FILE, format=123, system=1, sonar_channels=len(channels), **{"navigation_units": 3} | head)
    start += infos.tobytes()
    path.write_bytes(start.ljust(-(-len(start) // 1024) * 1024, b"\0") + b"".join(packets))
    return open_instrument(path)


def ping(samples, **fields):
    """A sonar packet with the samples of each channel as they are stored."""
    body = b"".join(files.record(P.PING_CHANNEL, channel=number, samples=len(values)) + values.tobytes()
                    for number, values in enumerate(samples))  # fmt: skip
    return packet(
        0, P.PING, body, channels=len(samples), **{name: DATE[name] for name in DATE if name != "magic"}, **fields
    )


def test_eight_channels_have_names_by_side_and_frequency(tmp_path):
    """A header of two kilobytes; two frequencies a side, in kHz or Hz; two of one frequency are numbered."""
    channels = [(side, frequency, 1, 0) for frequency in (100.0, 400.0, 400e3, 900.0) for side in (1, 2)]
    samples = [np.full(3, number, np.uint8) for number in range(8)]
    with written(tmp_path / "a.xtf", channels, [ping(samples)] * 2) as file:
        assert list(file.groups) == ["port 100 kHz", "starboard 100 kHz", "port 400 kHz", "starboard 400 kHz",
                                     "port 400 kHz 4", "starboard 400 kHz 5", "port 900 kHz",
                                     "starboard 900 kHz"]  # fmt: skip
        for number, group in enumerate(file.groups):
            assert set(file.read(group).amplitude.values.flat) == {number}
            assert file.groups[group] == 2
        assert not file.omissions


@pytest.mark.parametrize(
    ("size", "kind", "dtype"),
    [(1, 0, "u1"), (1, 8, "u1"), (2, 0, "<u2"), (2, 3, "<u2"), (4, 0, "<u4"), (4, 2, "<i4"), (4, 5, "<f4")],
)  # fmt: skip
def test_samples_of_every_format_are_read(tmp_path, size, kind, dtype):
    """Whole numbers of 1, 2 and 4 bytes and floats, in their order of a starboard channel."""
    values = np.array([1, 2, 100], dtype)
    with written(tmp_path / "a.xtf", [(2, 100.0, size, kind)], [ping([values])]) as file:
        np.testing.assert_array_equal(file.read("starboard").amplitude, [[1, 2, 100]])


@pytest.mark.parametrize(("size", "kind"), [(4, 1), (3, 0), (0, 0)])
def test_samples_of_an_unknown_format_are_reported(tmp_path, size, kind):
    """Floats of old mainframes, three bytes, none: the channel is empty, and listed."""
    with written(tmp_path / "a.xtf", [(2, 100.0, size, kind)], [ping([np.zeros(0, np.uint8)])]) as file:
        assert file.read("starboard").sizes["ping"] == 0
        assert f"samples of {size} bytes, format {kind}, not read" in file.omissions[0].reason


def test_a_sub_bottom_channel_is_not_turned_round(tmp_path):
    """Only port is stored from far to near."""
    values = np.array([5, 6, 7], "<u2")
    with written(tmp_path / "a.xtf", [(0, 3.5, 2, 0), (1, 100.0, 2, 0)], [ping([values, values])]) as file:
        assert list(file.read("sub-bottom").amplitude.values[0]) == [5, 6, 7]
        assert list(file.read("port").amplitude.values[0]) == [7, 6, 5]
        assert file.read("sub-bottom").frequency.values[0] == 3500


def test_positions_come_from_the_best_packets(tmp_path):
    """Raw positions before navigation before pings; times from the epoch, tenths of milliseconds or the date."""
    position = {name: DATE[name] for name in DATE if name != "magic"}
    logged = packet(42, P.NAVIGATION, latitude=2.0, longitude=2.0, epoch=files.START, microseconds=250_000, **position)
    raw = packet(107, P.RAW_POSITION, latitude=3.0, longitude=3.0, tenths=5000, roll=90.0, heave=1.0, **position)
    packets = [ping([np.zeros(2, np.uint8)], latitude=1.0, longitude=1.0), logged]
    for more, latitude, late in (([], 2.0, 0.25), ([raw], 3.0, None)):
        with written(tmp_path / "a.xtf", [(2, 100.0, 1, 0)], packets + more) as file:
            found = file.navigation()
            assert np.degrees(found.latitude.values).tolist() == pytest.approx([latitude])
            seconds = float(found.time[0])
            assert seconds - files.START == pytest.approx(late) if late else seconds % 1 == pytest.approx(0.5)
            if more:
                attitude = file.attitude()
                assert attitude["roll"].values[0] == pytest.approx(np.pi / 2) and attitude.heave.values[0] == -1


def test_positions_in_metres_are_northing_and_easting(tmp_path):
    """A file in a projection; a date that does not exist gives no time."""
    pings = [ping([np.zeros(2, np.uint8)], latitude=5.4e6, longitude=3e5)]
    with written(tmp_path / "a.xtf", [(2, 100.0, 1, 0)], pings, navigation_units=0) as file:
        found = file.read("starboard")
        assert found.northing.values[0] == 5.4e6 and found.easting.values[0] == 3e5 and "latitude" not in found
        assert file.navigation().northing.values[0] == 5.4e6
    odd = packet(0, P.PING, b"", year=2023, month=13, day=40)
    with written(tmp_path / "a.xtf", [(2, 100.0, 1, 0)], [odd]) as file:
        assert np.isnan(file.datagrams.time).all() and file.check() == ()


def test_a_length_that_reaches_into_another_packet_costs_one_ping(tmp_path):
    """The packet whose length lies is left out, and the next is read although the length covers it."""
    one = ping([np.arange(4, dtype=np.uint8)])
    lying = bytearray(one)
    lying[10:14] = (len(one) + 40).to_bytes(4, "little")
    with written(tmp_path / "a.xtf", [(2, 100.0, 1, 0)], [one, bytes(lying), one, one]) as file:
        assert file.groups["starboard"] == 3
        (left_out,) = file.omissions
        assert left_out.offset == 1024 + len(one) and "no packet follows" in left_out.reason
    with written(tmp_path / "a.xtf", [(2, 100.0, 1, 0)], [one, bytes(40), one]) as file:
        assert file.groups["starboard"] == 2 and [part.offset for part in file.omissions] == [1024 + len(one)]


def test_zero_padding_after_the_samples_belongs_to_the_packet(tmp_path):
    """Packets are padded to 64 bytes."""
    body = files.record(P.PING_CHANNEL, samples=2) + b"\1\2" + bytes(62)
    with written(tmp_path / "a.xtf", [(2, 100.0, 1, 0)], [packet(0, P.PING, body, channels=1)] * 3) as file:
        assert file.read("starboard").amplitude.values.tolist() == [[1, 2]] * 3 and not file.omissions
