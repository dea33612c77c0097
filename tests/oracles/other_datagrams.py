"""Small files with the datagrams that are seldom: sensors, extra detections, those of earlier instruments, pulses."""

import numpy as np

from oracles import simrad_files
from oracles.instrument_files import START, all_datagram, all_parts, kmall_datagram, kmall_parts, record, xtf_parts

BEAMS = 4
COUNT = np.arange(BEAMS)


def kmall() -> bytes:
    """KMALL sensors: clock, position error, sound speed at the transducer, depth of two versions, heave, height."""
    p, sensor = kmall_parts, record(kmall_parts.SENSOR)
    speed = record(p.SPEED, 2, seconds=START + COUNT[:2], sound_speed=[1480.0, 1481.0], temperature=8.0, pressure=-9999)
    info = record(p.SPEED_INFO, count=2, sample_size=p.SPEED.itemsize)
    earlier = record(p.DEPTH_EARLIER, depth=12.5, scale=1.0)
    later = bytearray(kmall_datagram("#SDE", 1, sensor + record(p.DEPTH, depth=13.0, raw=12.0) + b"$DBT"))
    later[8] = 1
    return b"".join((
        kmall_datagram("#SCL", 0, sensor + record(p.CLOCK, offset=0.5, deviation=-8000) + b"$INZDA"),
        kmall_datagram("#SPE", 0, sensor + record(p.POSITION_ERROR, seconds=START, orientation=90.0, height=0.008)),
        kmall_datagram("#SVT", 0, info + speed),
        kmall_datagram("#SDE", 0, sensor + earlier), bytes(later),
        kmall_datagram("#CHE", 0, record(p.BODY, ping=7) + record(p.HEAVE, heave=-0.25)),
        kmall_datagram("#SHI", 0, sensor + bytes(8)), kmall_datagram("#SHI", 1, sensor + bytes(8)),
    ))  # fmt: skip


def kongsberg_all() -> bytes:
    """.all file of an earlier multibeam, then extra detections and datagrams of sensors."""
    p = all_parts
    head = {"beams": BEAMS, "heading": 9000, "sound_speed": 15000, "transducer_depth": 150, "sample_rate": 15000}
    beams = record(
        p.DEPTH_BEAM, BEAMS, down=1000 * COUNT - 500, starboard=COUNT - 2, level=-40, quality=0x80 * (COUNT % 2)
    )
    depth = record(p.DEPTH, **head, depth_step=2, step=10) + beams + b"\1"
    sectors = record(p.OLD_RANGE_SECTOR, tilt=-50, pulse_length=150, delay=20, frequency=300_000, bandwidth=800)
    ranges = record(p.OLD_RANGE_BEAM, BEAMS, angle=6000 - 3000 * COUNT, range=1200)
    old_ranges = record(p.OLD_RANGE, sectors=1, beams=BEAMS, sample_rate=1_500_000) + sectors + ranges + b"\0"
    images = record(p.OLD_IMAGE_BEAM, BEAMS, order=[1, -1, 1, -1], sample_count=COUNT, centre_sample=1)
    image = (
        record(p.OLD_IMAGE, beams=BEAMS, oblique_level=-25) + images + (-np.arange(COUNT.sum())).astype("i1").tobytes()
    )
    points = record(p.PROFILE_POINT_EARLIER, 2, depth=[0, 100], sound_speed=[14800, 14900])
    profile = record(p.PROFILE, date=20031114, seconds=1, count=2, resolution=10) + points
    extra = record(p.EXTRA_BEAM, 2, angle=[60.0, -60.0], down=9.0, level=-305, travel_time=0.02, sample_count=[0, 5])
    info = record(p.EXTRA, beams=2, classes=1, class_size=16, beam_size=p.EXTRA_BEAM.itemsize, reference_depth=1.5)
    messages = b"".join(record(p.NETWORK_ATTITUDE, elapsed=10 * n, roll=100 * n, message=3 + n) + bytes(3 + n)
                        for n in range(2))  # fmt: skip
    two = (2).to_bytes(2, "little")
    bodies = {
        "V": profile, "D": depth, "f": old_ranges, "S": image, "l": info + bytes(16) + extra + bytes(2 * (2 * 5 + 1)),
        "n": two + b"\0\0" + messages, "C": record(p.CLOCK, date=20231114, milliseconds=500, pps=1),
        "h": record(p.HEIGHT, height=4714), "H": two + record(p.HEADING, 2, elapsed=[0, 500], heading=9000) + b"\0",
        "G": two + record(p.SPEED, 2, elapsed=[0, 1], sound_speed=14807) + b"\0",
        "T": record(p.TIDE, tide=-120) + b"\0",
        "1": bytes(64), "J": two + record(p.TILT, 2, elapsed=[0, 100], tilt=-300) + b"\0",
        "E": record(p.SINGLE_BEAM, depth=1234),
    }  # fmt: skip
    return b"".join(all_datagram(kind, 1, body) for kind, body in bodies.items())


def xtf() -> bytes:
    """XTF soundings of QINSy, padded to 64 bytes, and bathymetry of a maker's own."""
    p = xtf_parts
    whole = record(p.FILE, format=123, system=1, navigation_units=3, bathymetry_channels=1).ljust(1024, b"\0")
    for ping in range(2):
        beams = record(p.MULTIBEAM_BEAM, BEAMS, beam=COUNT, travel_time=0.01 * (COUNT + 1),
                       beam_angle=20.0 * COUNT - 30, intensity=5.0, quality=3)  # fmt: skip
        head = np.frombuffer(record(p.PING, magic=0xFACE, kind=28, channels=BEAMS, year=2023, month=11, day=14,
                                    second=ping, ping=ping, sound_speed=1500.0, roll=2.0), p.PING).copy()  # fmt: skip
        size = -(-(p.PING.itemsize + len(beams)) // 64) * 64
        head["size"] = size
        whole += (head.tobytes() + beams).ljust(size, b"\0")
    packet = np.frombuffer(record(p.PACKET, magic=0xFACE, kind=68), p.PACKET).copy()
    packet["size"] = 64
    return whole + packet.tobytes().ljust(64, b"\0")


def ek80() -> bytes:
    """EK80 file whose channel of a sweep has a transmitted pulse in front of each echo, and a receiver of positions."""
    sensors = "".join(
        f'<Sensor Name="GPS {name}" X="1.5" Y="{-rank}" Z="-20"><Telegram Enabled="{on}"><Value Name="Latitude" '
        f'Priority="{rank}" /></Telegram></Sensor>' for name, rank, on in (("a", 2, 1), ("b", 1, 1), ("c", 0, 0))
    )  # fmt: skip
    head = simrad_files.configuration().replace(
        b"</Transducers></Configuration>",
        f"</Transducers><ConfiguredSensors>{sensors}</ConfiguredSensors></Configuration>".encode(),
    )
    head = head.replace(
        b'TransducerOffsetX="7.5"', b'TransducerOffsetX="7.5" TransducerOffsetY="1" TransducerOffsetZ="5"'
    )
    parts = [simrad_files.datagram(b"XML0", 0, head)]
    for ping in range(2):
        parts.append(simrad_files.datagram(b"XML0", ping, simrad_files.parameter("tone 4")))
        for kind in (b"RAW4", b"RAW3"):
            parts.append(
                simrad_files.datagram(kind, ping, simrad_files.samples("tone 4", ping + 5 * (kind == b"RAW4")))
            )
    parts.append(simrad_files.datagram(b"TAG0", 3, b"a note\0\0"))
    return b"".join(parts)


OTHERS = {".kmall": kmall, ".all": kongsberg_all, ".xtf": xtf, ".raw": ek80}
"""Writer of a file with seldom datagrams of each format that has them, by its suffix."""
