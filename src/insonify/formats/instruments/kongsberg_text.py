"""Installation and runtime parameters of Kongsberg multibeams, which are text, as settings."""

import re
from collections.abc import Iterator

from insonify.formats.instruments.columns import DEGREE
from insonify.formats.instruments.instrument_file import Setting

_METRES = re.compile(r"(I[PCS]?|[SP]\d|[DMN]S)?[XYZ]|S?WLZ")
_ANGLES = re.compile(r"(S\d)?[RPH]|[MN]S[RPG]|GCG")
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?")


def installation_settings(text: str, kind: str, offset: int) -> Iterator[Setting]:
    """Settings of an installation text such as "SN=25002,TRAI_TX1:X=-0.512;R=0.045".

    Lever arms (X forward, Y starboard, Z down) become metres, angles (R roll, P pitch, H heading) radians.

    Args:
        text: The text.
        kind: Kind of its datagram.
        offset: First byte of its datagram.
    """
    for entry in re.split(r"[,\n]+", text):
        device, colon, values = entry.strip().partition(":")
        if not colon or "=" not in values:
            device, values = "", entry.strip()
        for part in values.split(";"):
            name, equals, value = (word.strip() for word in part.partition("="))
            if equals and name and value:
                yield _setting(f"{device}.{name}" if device else name, name, value, (kind, offset))


def runtime_settings(text: str, kind: str, offset: int) -> Iterator[Setting]:
    """Settings of a runtime text with lines such as "Max angle Port: 60.0", under the headings that stand above them.

    Args:
        text: The text.
        kind: Kind of its datagram.
        offset: First byte of its datagram.
    """
    heading = ""
    for line in text.splitlines():
        name, colon, value = (word.strip() for word in line.partition(":"))
        if not colon:
            heading = name or heading
        elif value:
            yield _setting(f"{heading}.{name}" if heading else name, "", value, (kind, offset))


def _setting(name: str, field: str, value: str, source: tuple[str, int]) -> Setting:
    if not _NUMBER.fullmatch(value) or len(value) > 20:
        return Setting(name, value, "", *source)
    number = float(value) if "." in value else int(value)
    if _METRES.fullmatch(field):
        return Setting(name, float(number), "m", *source)
    if _ANGLES.fullmatch(field):
        return Setting(name, number * DEGREE, "rad", *source)
    return Setting(name, number, "1", *source)
