"""Positions in NMEA 0183 sentences, as sensors send them to an instrument."""

import math
from typing import NamedTuple

from insonify.formats.instruments.columns import DEGREE


class Fix(NamedTuple):
    """One position."""

    latitude: float
    """Positive north [rad]."""
    longitude: float
    """Positive east [rad]."""
    quality: int
    """Quality of the fix: 1 autonomous, 2 differential, 4 kinematic with fixed, 5 with float ambiguities."""


def position(sentence: str) -> Fix | None:
    """Position of a GGA sentence; None for another, an invalid one, or one whose checksum is wrong.

    Args:
        sentence: From "$" on, with or without checksum.
    """
    body, _, checksum = sentence.strip("\0\r\n ").removeprefix("$").partition("*")
    if checksum and checksum[:2].upper() != f"{_checksum(body):02X}":
        return None
    fields = body.split(",")
    if len(fields) < 7 or fields[0][2:] != "GGA" or not fields[6].isdecimal() or fields[6] == "0":
        return None
    latitude, longitude = _angle(fields[2], fields[3], "NS", 90), _angle(fields[4], fields[5], "EW", 180)
    if math.isnan(latitude) or math.isnan(longitude):
        return None
    return Fix(latitude, longitude, int(fields[6][:2]))


def _checksum(body: str) -> int:
    total = 0
    for letter in body:
        total ^= ord(letter) & 255
    return total


def _angle(text: str, hemisphere: str, sides: str, limit: int) -> float:
    """Angle [rad] written as degrees and minutes "ddmm.mmm", NaN for what is none."""
    try:
        value = float(text)
    except ValueError:
        return math.nan
    if hemisphere not in tuple(sides) or not 0 <= value <= 100 * limit:
        return math.nan
    degrees = value // 100
    return DEGREE * (degrees + (value - 100 * degrees) / 60) * (1 if hemisphere == sides[0] else -1)
