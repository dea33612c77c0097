"""Claims about odd but undamaged files of each format.

They are read as far as they go, and what is left out is listed.
"""

import struct

import numpy as np
import pytest

from insonify import open_instrument
from insonify.formats.instruments.navigation_text import navigation_log
from oracles import imaging_sonar_files, simrad_files
from oracles import instrument_files as files

A, K, X = files.all_parts, files.kmall_parts, files.xtf_parts


def opened(tmp_path, suffix, content):
    """A file with this content, open."""
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    return open_instrument(path)


def xtf_ping(second, samples, kind=0):
    """A sonar packet of one starboard channel."""
    body = files.record(X.PING_CHANNEL, samples=samples, time_duration=0.04) + bytes(2 * samples)
    head = np.frombuffer(files.record(X.PING, magic=0xFACE, kind=kind, year=2023, month=11, day=14 + second // 86400,
                                      hour=second // 3600 % 24, minute=second // 60 % 60, second=second % 60,
                                      channels=1, sound_speed=750.0), X.PING).copy()  # fmt: skip
    head["size"] = X.PING.itemsize + len(body)
    return head.tobytes() + body


def ping(suffix, second, samples=4):
    """One ping of each format, so many seconds after the first, with so many samples."""
    if suffix == ".kmall":
        rows = files.record(K.WATER_RX, beams=1, beam_size=16, sample_rate=4e4)
        beam = files.record(K.WATER_BEAM, sample_count=samples) + bytes(samples)
        body = files.record(K.PARTITION, count=1, number=1) + files.record(K.BODY) + files.record(
            K.WATER_TX, sector_size=16) + rows + beam  # fmt: skip
        return files.kmall_datagram("#MWC", second, body)
    if suffix == ".all":
        beam = files.record(A.WATER_BEAM, sample_count=samples) + bytes(samples)
        body = files.record(A.WATER, parts=1, part=1, beams=1, sample_rate=1_500_000) + beam + b"\0"
        return files.all_datagram("k", second % 65536, body, milliseconds=1000 * second)
    if suffix == ".xtf":
        return xtf_ping(second, samples)
    if suffix == ".raw":
        return simrad_files.datagram(b"RAW3", second, simrad_files.samples("tone 4", 0, samples))
    message = imaging_sonar_files.oculus_ping(0)
    if not samples:
        at = len(message) - imaging_sonar_files.RANGES * imaging_sonar_files.BEAMS
        places = at - 2 * imaging_sonar_files.BEAMS - 12
        sizes = (places - 4, "<H", 0), (places + 4, "<I", 0)  # number of ranges, size of the image
        changed = bytearray(message[:at])
        struct.pack_into("<I", changed, 10, len(changed) - 16)
        for place, kind, value in sizes:
            struct.pack_into(kind, changed, place, value)
        message = bytes(changed)
    if suffix == ".oculus":
        item = struct.pack("<IIHHIdHHII", 0xAABBCCDD, 40, 10, 0, 0, 1.7e9 + second, 0, 0, len(message), len(message))
        return item + bytes(4) + message
    head, whole = 1024 + 5 * 48, bytearray(imaging_sonar_files.aris(1)[1024:])
    struct.pack_into("<Q", whole, 4, 1_600_000_000_000_000 + second * 1_000_000)
    struct.pack_into("<I", whole, 468, 5 if samples else 0)
    return bytes(whole[: head if samples else 1024])


def opening(suffix):
    """What stands in front of the pings."""
    if suffix == ".xtf":
        channels = np.zeros(6, X.CHANNEL)
        channels["kind"][0], channels["sample_size"][0], channels["frequency"][0] = 2, 2, 600.0
        head = files.record(X.FILE, format=123, system=1, sonar_channels=1, navigation_units=3)
        return head + channels.tobytes()
    if suffix == ".raw":
        return simrad_files.datagram(b"XML0", 0, simrad_files.configuration())
    return {".oculus": imaging_sonar_files.oculus_log()[:48], ".aris": imaging_sonar_files.aris(0)}.get(suffix, b"")


SUFFIXES = (".kmall", ".all", ".xtf", ".raw", ".oculus", ".aris")
UNKNOWN = {
    ".kmall": lambda: files.kmall_datagram("#QQQ", 0, bytes(40)), ".all": lambda: files.all_datagram("z", 0, bytes(41)),
    ".xtf": lambda: xtf_ping(0, 4, kind=150), ".raw": lambda: simrad_files.datagram(b"QQQ7", 0, bytes(40)),
    ".oculus": lambda: ping(".oculus", 0).replace(b"\x23\x00\x01\x00", b"\x99\x00\x01\x00", 1),
}  # fmt: skip


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("jump", [-3600, 90_000])
def test_a_clock_that_jumps_is_reported_and_every_ping_is_read(suffix, jump, tmp_path):
    """An hour back, a day ahead: pings keep their order and times, and the jump is listed with its byte."""
    times = [7200, 7201, 7201 + jump, 7202 + jump]
    pings = [ping(suffix, time) for time in times]
    with opened(tmp_path, suffix, opening(suffix) + b"".join(pings)) as file:
        (group,) = file.groups
        read = file.read(group)
        np.testing.assert_allclose(np.diff(read.time), np.diff(times), atol=1e-4)
        (omission,) = file.clock_jumps
        assert (
            omission.offset == len(opening(suffix)) + len(pings[0] + pings[1])
            and f"{abs(jump)}.000 s" in omission.reason
        )
        assert file.check() == ()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_pings_of_no_samples_stand_between_others_or_are_reported(suffix, tmp_path):
    """Echoes of zero samples are pings of NaN; an image without a row is none, and is listed."""
    content = opening(suffix) + ping(suffix, 0) + ping(suffix, 1, samples=0) + ping(suffix, 2)
    with opened(tmp_path, suffix, content) as file:
        (group,) = file.groups
        read, left_out = file.read(group), file.check()
    if suffix in (".oculus", ".aris"):
        assert read.sizes["ping"] == 2 and len(left_out) == 1 and " 0 " in left_out[0].reason
        assert left_out[0].offset == len(opening(suffix) + ping(suffix, 0))
        return
    assert read.sizes["ping"] == 3 and left_out == ()
    name = next(name for name in ("level", "amplitude", "voltage") if name in read)
    assert np.isnan(read[name].values[1]).all() and np.isfinite(read[name].values[[0, 2]]).any()


@pytest.mark.parametrize("suffix", UNKNOWN)
def test_unknown_datagrams_are_counted_and_passed_over(suffix, tmp_path):
    """Two of a kind that no description has, between pings."""
    other = UNKNOWN[suffix]()
    content = opening(suffix) + ping(suffix, 0) + other + other + ping(suffix, 1)
    with opened(tmp_path, suffix, content) as file:
        (group,) = file.groups
        assert file.read(group).sizes["ping"] == 2
        (omission,) = file.check()
        assert omission.offset == len(opening(suffix) + ping(suffix, 0))
        assert omission.reason.endswith("unknown kind of datagram, 2 of them")


@pytest.mark.parametrize("suffix", [".kmall", ".all", ".raw", ".oculus"])
def test_a_file_without_attitude_or_positions_is_read(suffix, tmp_path):
    """Nothing is made up: no series, an empty navigation log, and pings as ever."""
    with opened(tmp_path, suffix, opening(suffix) + ping(suffix, 0) + ping(suffix, 1)) as file:
        assert file.attitude() is None and file.navigation() is None and not file.sensors()
        assert file.check() == () and next(iter(file.groups.values())) == 2
        if suffix == ".oculus":
            assert navigation_log(file) == ""
