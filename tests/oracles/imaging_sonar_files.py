"""Small files of Oculus and ARIS, written from the published layouts."""

import struct
import zlib

import numpy as np

BEAMS, RANGES = 6, 4


def oculus_ping(number: int, *, version: int = 1, width: int = 1, gain: bool = False) -> bytes:
    """Message with an image: counts are range, beam and ping in digits of ten; the gain of range r is r + 1."""
    fire = struct.pack("<5B4d", 2, 1, 25, 127, 0x19 | (4 if gain else 0), 2.0, 50.0, 1500.0, 35.0)
    sizes_at = (bytes(36), struct.pack("<3d", 90.0, -5.0, 10.0), struct.pack("<d", 7.5), bytes(16))
    extra, attitude, clock, spare = sizes_at if version == 2 else (b"", b"", struct.pack("<I", 75), b"")
    water = struct.pack("<IIddd", number, 0, 2.1e6, 12.0, 1e-300)
    head = 16 + len(fire) + len(extra) + len(water) + len(attitude) + 8 + len(clock) + 13 + len(spare) + 12
    rows = b"".join(
        (struct.pack("<f", r + 1) if gain else b"")
        + b"".join((100 * r + 10 * b + number).to_bytes(2, "little")[:1].ljust(width, b"\1") for b in range(BEAMS))
        for r in range(RANGES)
    )
    start, size = head + 2 * BEAMS, len(rows)
    body = fire + extra + water + attitude + struct.pack("<d", 1500.0) + clock
    body += struct.pack("<BdHH", width - 1, 0.01, RANGES, BEAMS) + spare
    body += struct.pack("<III", start, size, start + size)
    body += struct.pack(f"<{BEAMS}h", *(1000 * np.arange(BEAMS) - 2500)) + rows
    return oculus_message(0x23, body, version=version)


def oculus_message(kind: int, body: bytes, *, version: int = 1) -> bytes:
    """One message."""
    return struct.pack("<HHHHHIH", 0x4F53, 77, 0, kind, version, len(body), 0) + body


def oculus_counts(number: int, width: int = 1) -> np.ndarray:
    """Counts of the image, shape (beam, range)."""
    first = (100 * np.arange(RANGES) + 10 * np.arange(BEAMS)[:, None] + number) & 255
    return first + sum(256**digit for digit in range(1, width))


def oculus() -> bytes:
    """Three messages with images, in which one of another kind stands."""
    other = oculus_message(0x80, b"a log")
    return oculus_ping(0) + other + oculus_ping(1, version=2, width=2, gain=True) + oculus_ping(2, width=4)


def oculus_log() -> bytes:
    """Log with the images of `oculus`, of which one is compressed, and another item."""
    parts = [struct.pack("<II16sHHIqd", 0x11223344, 48, b"Oculus", 1, 0, 0, 0, 1.7e9)]
    for row, (kind, payload, packed) in enumerate(
        [(10, oculus_ping(0), False), (1, b"settings", False), (10, oculus_ping(1, version=2, gain=True), True)]
    ):
        stored = struct.pack(">I", len(payload)) + zlib.compress(payload) if packed else payload
        item = struct.pack("<IIHHIdHHII", 0xAABBCCDD, 40, kind, 0, 0, 1.7e9 + row, packed, 0, len(payload), len(stored))
        parts.append(item + bytes(4) + stored)
    return b"".join(parts)


def aris_counts(frame: int, beams: int = 48, samples: int = 5) -> np.ndarray:
    """Counts of a frame, shape (sample, beam)."""
    return ((np.arange(samples)[:, None] * beams + np.arange(beams) + frame) % 256).astype(np.uint8)


def aris(frames: int = 3, *, mode: int = 1, beams: int = 48, ordered: bool = True) -> bytes:
    """Frames of five samples."""
    parts = [b"DDF\x05" + bytes(1020)]
    for frame in range(frames):
        head, counts = bytearray(1024), aris_counts(frame, beams)
        if not ordered:  # the transmission p of n receives on its channel c the beam order[c] * n + p
            order = [10, 2, 14, 6, 8, 0, 12, 4, 11, 3, 15, 7, 9, 1, 13, 5]
            shots = beams // 16
            counts = np.concatenate([counts[:, [beam * shots + shot for beam in order]] for shot in range(shots)])
        for place, kind, value in (
            (0, "I", frame), (4, "Q", 1_600_000_000_500_000 + frame), (12, "4s", b"DDF\x05"), (68, "I", 24),
            (160, "f", 90.0), (164, "f", -2.0), (172, "d", 45.0), (180, "d", 5.0), (224, "f", 9.0), (248, "f", -2.25),
            (436, "I", mode), (440, "I", 1), (444, "I", 12), (452, "I", 14), (464, "f", 1436.0), (468, "I", 5),
            (476, "I", 4600), (484, "I", 2), (488, "I", 1098), (516, "I", int(ordered)),
        ):  # fmt: skip
            struct.pack_into("<" + kind, head, place, value)
        parts += [bytes(head), counts.tobytes()]
    return b"".join(parts)
