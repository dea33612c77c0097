"""Sizes that compressed chunks declare, compared with those of their array before memory is allocated.

A chunk of a few kilobytes may unpack to terabytes. Its first bytes give the size, and the description of its array
gives the size that it must have.
"""

HEAD = 18
"""Longest header of a compressed chunk up to its size [bytes]."""
_ZSTD = b"\x28\xb5\x2f\xfd"


def require_declared_size(content: bytes, size: int) -> None:
    """Refuse a compressed chunk that unpacks to more than its array has in a chunk.

    Args:
        content: The chunk, or its first `HEAD` bytes, compressed by zstd or blosc.
        size: Size of a chunk of the array [bytes].

    Raises:
        ValueError: The chunk declares no size, or a larger one.
    """
    if content[:4] == _ZSTD and len(content) > 5:
        # RFC 8878, 3.1.1.1: descriptor, window unless in a single segment, dictionary, size
        is_single, width = content[4] >> 5 & 1, (0, 2, 4, 8)[content[4] >> 6]
        width, begin = width or is_single, 6 - is_single + (0, 1, 2, 4)[content[4] & 3]
        declared = int.from_bytes(content[begin : begin + width], "little") + 256 * (width == 2) if width else -1
    else:  # header of blosc: version, version of the codec, flags, size of a number, size
        declared = int.from_bytes(content[4:8], "little") if content[:1] in (b"\1", b"\2") else -1
    if declared < 0:
        raise ValueError("it declares no size")
    if declared > size:
        raise ValueError(f"it declares {declared} bytes, and a chunk has {size}")
