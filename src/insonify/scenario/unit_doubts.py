"""Numbers typed without a unit that were probably meant in another one: degrees for radians, kilohertz for hertz."""

from pydantic import BaseModel

from insonify.scenario.advice import Advice
from insonify.scenario.asked import find
from insonify.scenario.source import Path, Source, dotted
from insonify.units import unit_doubt


def unit_doubts(model: type[BaseModel], source: Source) -> list[Advice]:
    """Warnings about bare numbers of a file that are implausible in SI, one for each.

    Args:
        model: What the file describes.
        source: The file; only values in `source.written` are looked at.

    Returns:
        Advice with file, line and key; empty where all is plausible.
    """
    doubts = ((path, _doubt(model, source, path)) for path in source.written)
    return [Advice(source.name, source.line(path), dotted(path), doubt) for path, doubt in doubts if doubt]


def _doubt(model: type[BaseModel], source: Source, path: Path) -> str:
    """Warning about one value; empty where its number is plausible."""
    value = source.value(path)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return ""
    _, expected = find(model, source.values, path)
    for dimension in dict.fromkeys(kind.dimension for kind in expected):
        # hertz are usual in the motion of platforms
        if dimension == "angle" or (dimension == "frequency" and path[0] == "sonar"):
            return unit_doubt(source.written[path], dimension)
    return ""
