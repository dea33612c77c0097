"""Messages of ping-protocol, by which Blue Robotics' sonars are read.

Source: ping-protocol, message definitions of version 1.0 (docs.bluerobotics.com/ping-protocol): two start bytes,
lengths and numbers in little-endian order, the sum of all bytes as a check.
"""

import struct
from collections.abc import Iterator
from itertools import accumulate
from typing import NamedTuple

START = b"BR"
HEADER = struct.Struct("<2sHHBB")
CHECKSUM = struct.Struct("<H")

ACK, NACK, DEVICE_INFORMATION, PROTOCOL_VERSION, GENERAL_REQUEST, SET_ANY_DEVICE_ID = 1, 2, 4, 5, 6, 100


class Message(NamedTuple):
    """One message."""

    number: int
    """Message number of the protocol: the kind of its content."""
    payload: bytes
    source: int = 0
    """Number of the device that it comes from; 0 of a computer."""
    destination: int = 0


def packed(message: Message) -> bytes:
    """Bytes of a message, with header and checksum.

    Args:
        message: The message.
    """
    head = HEADER.pack(START, len(message.payload), message.number, message.source, message.destination)
    body = head + message.payload
    return body + CHECKSUM.pack(sum(body) & 0xFFFF)


def messages(datagram: bytes) -> Iterator[Message]:
    """The whole messages in a datagram; what is cut short, or has a wrong checksum, is passed over.

    Args:
        datagram: Bytes as received.
    """
    start, sums = 0, [0, *accumulate(datagram)]  # once: a hostile datagram has a header at every second byte
    while (start := datagram.find(START, start)) >= 0 and start + HEADER.size + CHECKSUM.size <= len(datagram):
        _, length, number, source, destination = HEADER.unpack_from(datagram, start)
        end = start + HEADER.size + length
        is_whole = end + CHECKSUM.size <= len(datagram)
        if is_whole and CHECKSUM.unpack_from(datagram, end)[0] == (sums[end] - sums[start]) & 0xFFFF:
            yield Message(number, datagram[start + HEADER.size : end], source, destination)
            start = end + CHECKSUM.size
        else:
            start += 1
