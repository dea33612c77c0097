"""Small files of real instruments, written from the published layouts, and damage to them."""

import os
from pathlib import Path

import numpy as np

from insonify.formats.instruments import kmall_layouts as kmall_parts
from insonify.formats.instruments import kongsberg_all_layouts as all_parts
from insonify.formats.instruments import xtf_layouts as xtf_parts
from insonify.formats.instruments.instrument_file import MAX_OMISSIONS, InstrumentFile
from oracles import imaging_sonar_files, simrad_files

DATA = Path(os.environ.get("INSONIFY_DATA", Path(__file__).parents[3] / "shared" / "data"))
"""Folder of recordings of real instruments; tests on them are skipped without it."""
START = 1_700_000_000
BEAMS, SAMPLES, PINGS = 5, 4, 3


def record(layout: np.dtype, rows: int = 1, /, **fields: object) -> bytes:
    """Bytes of one record or of several, whose size field holds their own size."""
    made = np.zeros(rows, layout)
    if "size" in (layout.names or ()):
        made["size"] = layout.itemsize
    for name, value in fields.items():
        made[name] = value
    return made.tobytes()


def kmall_datagram(kind: str, seconds: float, body: bytes) -> bytes:
    """One datagram with its length at both ends."""
    size = kmall_parts.HEADER.itemsize + len(body) + 4
    whole, part = divmod(seconds, 1)
    version = {"#MRZ": 3, "#MWC": 2, "#SKM": 1, "#SVP": 1}.get(kind, 0)  # revision I
    head = record(kmall_parts.HEADER, size=size, kind=kind.encode(), version=version, model=2042, seconds=START + whole,
                  nanoseconds=round(part * 1e9))  # fmt: skip
    return head + body + size.to_bytes(4, "little")


def kmall_level(ping: int) -> np.ndarray:
    """Water column levels [half dB] of one ping, shape (beam, sample)."""
    return (np.arange(BEAMS * SAMPLES).reshape(BEAMS, SAMPLES) - 60 - ping).astype(np.int8)


def kmall() -> bytes:
    """KMALL file: text, attitude, position, profile, three pings of soundings and water column, an unknown kind."""
    parts, p = [], kmall_parts
    text = b"OSCV:Empty,EMXV:EM2042,SN=77,TRAI_TX1:X=-0.5;P=90.0"
    parts.append(kmall_datagram("#IIP", 0, (6 + len(text)).to_bytes(2, "little") + bytes(4) + text))
    text = b"Depth settings\nMax. depth: 40.0\n"
    parts.append(kmall_datagram("#IOP", 0, (6 + len(text)).to_bytes(2, "little") + bytes(4) + text))
    attitude = record(p.ATTITUDE, 4, seconds=START, nanoseconds=np.arange(4) * 250_000_000, roll=np.arange(4.0),
                      heave=0.25)  # fmt: skip
    info = record(p.ATTITUDE_INFO, count=4, sample_size=p.ATTITUDE.itemsize)
    parts.append(kmall_datagram("#SKM", 0, info + attitude))
    position = record(p.POSITION, seconds=START, latitude=45.0, longitude=200.0, speed=-1.0)
    parts.append(kmall_datagram("#SPO", 0, record(p.SENSOR) + position + b"$GPGGA"))
    points = record(p.PROFILE_POINT, 2, depth=[0.0, 10.0], sound_speed=[1480.0, 1490.0], salinity=-99.0)
    parts.append(kmall_datagram("#SVP", 0, record(p.PROFILE, count=2, seconds=START, latitude=45.0) + points))
    parts.append(kmall_datagram("#XYZ", 0, bytes(12)))
    for ping in range(PINGS):
        parts += [
            kmall_datagram(kind, ping, body)
            for kind, body in (("#MRZ", kmall_swath(ping)), ("#MWC", kmall_water(ping)))
        ]
    return b"".join(parts)


def kmall_swath(ping: int) -> bytes:
    """Body of an #MRZ datagram with one extra detection; beam b has b samples of the seabed image."""
    p, count = kmall_parts, np.arange(BEAMS + 1)
    head = record(p.PARTITION, count=1, number=1) + record(p.BODY, ping=100 + ping)
    about = np.frombuffer(record(p.PING, sectors=2, sector_size=p.SECTOR.itemsize, latitude=45.0, longitude=3.0,
                                 water_level=-1.0), p.PING).copy()  # fmt: skip
    about["size"] += 8  # fields of the revisions since H, which are skipped
    about = about.tobytes() + bytes(8)
    sectors = record(p.SECTOR, 2, frequency=[300e3, 320e3])
    rx = record(p.RX, soundings=BEAMS, extra=1, sounding_size=p.SOUNDING.itemsize, classes=1, class_size=4)
    soundings = record(p.SOUNDING, BEAMS + 1, angle=60.0 - 20 * count, down=8.0, absorption=80.0, sample_count=count)
    return head + about + sectors + rx + bytes(4) + soundings + (-np.arange(count.sum())).astype("<i2").tobytes()


def kmall_water(ping: int) -> bytes:
    """Body of an #MWC datagram with phases in hundredths of a degree; the last beam is one sample shorter."""
    p, level = kmall_parts, kmall_level(ping)
    body = record(p.PARTITION, count=1, number=1) + record(p.BODY, ping=100 + ping)
    body += record(p.WATER_TX, sectors=1, sector_size=p.WATER_SECTOR.itemsize, heave=0.5)
    body += record(p.WATER_SECTOR, frequency=300e3)
    body += record(p.WATER_RX, beams=BEAMS, beam_size=p.WATER_BEAM.itemsize, phase=2, tvg_exponent=30, sample_rate=4e4)
    for beam in range(BEAMS):
        samples = SAMPLES - (beam == BEAMS - 1)
        body += record(p.WATER_BEAM, angle=60.0 - 30 * beam, sample_count=samples, first_sample=beam)
        body += level[beam, :samples].tobytes() + np.full(samples, 9000, "<i2").tobytes()
    return body


def all_datagram(kind: str, counter: int, body: bytes, milliseconds: int = 1000) -> bytes:
    """One .all datagram with its checksum, of an even length as the format requests."""
    size = all_parts.HEADER.itemsize + len(body) + 3
    head = record(all_parts.HEADER, length=size - 4, stx=2, kind=kind.encode(), model=2040, date=20231114,
                  milliseconds=milliseconds, counter=counter, serial=200)  # fmt: skip
    return head + body + b"\x03" + (sum(head[5:] + body) & 0xFFFF).to_bytes(2, "little")


def kongsberg_all() -> bytes:
    """.all file: texts, attitude, position, profile, pings of soundings, ranges, seabed image and water column."""
    p, parts = all_parts, []
    parts.append(all_datagram("I", 0, b"\0\0WLZ=-2.5,SMH=77,S1X=0.5,S1R=90.0,P1D=0.1,"))
    parts.append(all_datagram("R", 0, record(p.RUNTIME, pulse_length=80, absorption=7765, power=-10)))
    attitude = record(p.ATTITUDE, 3, milliseconds=[0, 10, 20], roll=[-100, 0, 100], heave=25, yaw=9000)
    parts.append(all_datagram("A", 0, (3).to_bytes(2, "little") + attitude + b"\0"))
    parts.append(all_datagram("P", 0, record(p.POSITION, latitude=45 * 20_000_000, longitude=-30_000_000, speed=65535)))
    points = record(p.PROFILE_POINT, 2, depth=[0, 100], sound_speed=[14800, 14900])
    parts.append(
        all_datagram("U", 0, record(p.PROFILE, date=20231114, seconds=1, count=2, resolution=10) + points + b"\0")
    )
    parts.append(all_datagram("Z", 0, bytes(9)))
    count = np.arange(BEAMS)
    for ping in range(PINGS):
        beams = record(p.XYZ_BEAM, BEAMS, down=8.0, starboard=count - 2.0, level=-200, info=[0, 1, 0x80, 0x84, 1])
        parts.append(all_datagram("X", ping, record(p.XYZ, beams=BEAMS, transducer_depth=1.5) + beams + b"\0"))
        ranges = record(p.RANGE_BEAM, BEAMS, angle=6000 - 3000 * count, travel_time=0.01)
        head = record(p.RANGE, beams=BEAMS, sectors=1) + record(p.RANGE_SECTOR, frequency=3e5, absorption=7764)
        parts += [all_datagram("N", ping, head + ranges + b"\0")] if ping else []
        beams = record(p.IMAGE_BEAM, BEAMS, order=[1, -1, 1, -1, 1], sample_count=count, centre_sample=1)
        samples = (-np.arange(count.sum())).astype("<i2").tobytes()
        parts.append(all_datagram("Y", ping, record(p.IMAGE, beams=BEAMS, sample_rate=3e4) + beams + samples + b"\0"))
        parts += [all_datagram("k", ping, all_water(ping, part)) for part in (2, 1)]
    return b"".join(parts)


def all_water(ping: int, part: int) -> bytes:
    """Body of one of two water column datagrams of a ping, which hold three beams and two."""
    p, beams = all_parts, range(BEAMS)[:3] if part == 1 else range(BEAMS)[3:]
    body = record(
        p.WATER, parts=2, part=part, sectors=1, beams=len(beams), all_beams=BEAMS, sample_rate=1_500_000, heave=-25
    )
    body += record(p.WATER_SECTOR, frequency=30_000)
    for beam in beams:
        body += record(p.WATER_BEAM, angle=6000 - 3000 * beam, sample_count=SAMPLES) + kmall_level(ping)[beam].tobytes()
    return body + b"\0"


def xtf() -> bytes:
    """XTF file: port (from far to near) and starboard, attitude and notes packets; the first ping without position."""
    p = xtf_parts
    channels = record(p.CHANNEL, 6, kind=[1, 2, 0, 0, 0, 0], frequency=600.0, sample_format=0)
    channels = np.frombuffer(channels, p.CHANNEL).copy()
    channels["sample_size"] = 2
    whole = record(p.FILE, format=123, system=1, sonar=b"HDS", sonar_type=14, sonar_channels=2, navigation_units=3)
    whole += channels.tobytes()
    date = {"magic": 0xFACE, "year": 2023, "month": 11, "day": 14, "hour": 22}
    for ping in range(PINGS):
        body = b""
        for channel in range(2):
            about = record(p.PING_CHANNEL, channel=channel, samples=SAMPLES, slant_range=30.0, time_duration=0.04)
            body += about + xtf_samples(ping, channel)[:: 2 * channel - 1].tobytes()
        size, where = p.PING.itemsize + len(body) + 16, 45.0 * (ping > 0)
        head = np.frombuffer(record(p.PING, **date, second=ping, channels=2, sound_speed=750.0, speed=2.0, heave=0.5,
                                    latitude=where, longitude=where, ping=ping), p.PING).copy()  # fmt: skip
        head["size"] = size
        whole += head.tobytes() + body + bytes(16)
        whole += record(p.ATTITUDE, **date, kind=3, second=ping, milliseconds=500, roll=90.0, heave=0.5)
    packet = np.frombuffer(record(p.PACKET, magic=0xFACE, kind=99), p.PACKET).copy()
    packet["size"] = 64
    return whole + packet.tobytes() + bytes(50)


def xtf_samples(ping: int, channel: int) -> np.ndarray:
    """Counts of one channel from near to far."""
    return (1000 * ping + 100 * channel + np.arange(SAMPLES)).astype("<u2")


SYNTHETIC = {
    ".kmall": kmall, ".all": kongsberg_all, ".xtf": xtf, ".raw": simrad_files.ek80,
    ".oculus": imaging_sonar_files.oculus, ".aris": imaging_sonar_files.aris,
}  # fmt: skip
"""Writer of a small file of each format, by its suffix."""


def damaged(whole: bytes, random: np.random.Generator) -> bytes:
    """A file with flipped bits, cut off, with bytes cut out or doubled, or with a length that lies."""
    content, kind = bytearray(whole), random.integers(5)
    at, other = (int(where) for where in random.integers(len(content), size=2))
    if kind == 0:
        for where in random.integers(len(content), size=random.integers(1, 9)):
            content[where] ^= 1 << random.integers(8)
    elif kind == 1:
        del content[at:]
    elif kind == 2:
        del content[at : at + 1 + other % 64]
    elif kind == 3:
        content[at:at] = content[other : other + 200]
    else:
        lie = random.choice([0, 1, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF])
        width = int(random.choice([1, 2, 4]))
        content[at : at + width] = (int(lie) & (1 << 8 * width) - 1).to_bytes(width, "little")
    return bytes(content)


def require_survived(opened: InstrumentFile) -> None:
    """Read all that a damaged file has left, and require omissions to lie within it."""
    assert all(0 <= part.offset <= opened.path.stat().st_size and part.reason for part in opened.check())
    for group in opened.groups:
        opened.read(group, slice(2))
    assert len(opened.omissions) <= MAX_OMISSIONS + 1 and opened.clock_jumps is not None
