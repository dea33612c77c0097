"""Small files of real instruments, written from the published layouts, and damage to them."""

import os
from pathlib import Path

import numpy as np

from insonify.formats.instruments import kmall_layouts as kmall_parts
from insonify.formats.instruments.instrument_file import MAX_OMISSIONS, InstrumentFile

DATA = Path(os.environ.get("INSONIFY_DATA", Path(__file__).parents[3] / "shared" / "data"))
"""Folder of recordings of real instruments; tests on them are skipped without it."""
START = 1_700_000_000
BEAMS, SAMPLES, PINGS = 5, 4, 3


def record(layout: np.dtype, rows: int = 1, /, **fields: object) -> bytes:
    """Bytes of one record or of several, whose size field holds their own size."""
    made = np.zeros(rows, layout)
    if "size" in (layout.names or ()) and made["size"].dtype.kind == "u" and layout is not kmall_parts.HEADER:
        made["size"] = layout.itemsize
    for name, value in fields.items():
        made[name] = value
    return made.tobytes()


def kmall_datagram(kind: str, seconds: float, body: bytes) -> bytes:
    """One datagram with its length at both ends."""
    size = kmall_parts.HEADER.itemsize + len(body) + 4
    whole, part = divmod(seconds, 1)
    head = record(kmall_parts.HEADER, size=size, kind=kind.encode(), model=2042, seconds=START + whole,
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
    about = record(p.PING, sectors=2, sector_size=p.SECTOR.itemsize, latitude=45.0, longitude=3.0, water_level=-1.0)
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
    opened.soundings(slice(2))
    assert len(opened.omissions) <= MAX_OMISSIONS + 1 and opened.clock_jumps is not None
