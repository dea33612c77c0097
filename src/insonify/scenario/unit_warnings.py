"""Numbers typed without a unit that were probably meant in another one: degrees for radians, kilohertz for hertz."""

from pydantic import BaseModel

from insonify.diagnostics.diagnostic import Diagnostic
from insonify.diagnostics.expected_type import find
from insonify.diagnostics.yaml_source import Path, YamlSource, dotted
from insonify.units import unit_warning


def unit_warnings(model: type[BaseModel], source: YamlSource) -> list[Diagnostic]:
    """Warnings about bare numbers of a file that are implausible in SI, one for each.

    Args:
        model: Model that the file describes.
        source: The file; only values in `source.written` are looked at.

    Returns:
        Diagnostic with file, line and key; empty where all is plausible.
    """
    caveats = ((path, _unit_warning(model, source, path)) for path in source.written)
    return [Diagnostic(source.name, source.line(path), dotted(path), doubt) for path, doubt in caveats if doubt]


def _unit_warning(model: type[BaseModel], source: YamlSource, path: Path) -> str:
    """Warning about one value; empty where its number is plausible."""
    value = source.value(path)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return ""
    _, expected = find(model, source.values, path)
    for dimension in dict.fromkeys(kind.dimension for kind in expected):
        # hertz are usual in the motion of platforms
        if dimension == "angle" or (dimension == "frequency" and path[0] == "sonar"):
            return unit_warning(source.written[path], dimension)
    return ""
