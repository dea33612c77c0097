"""Template scenarios: commented scenario files, one for each kind of sonar."""

from importlib.resources import files

from insonify.diagnostics.diagnostic import nearest_word
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario

_FOLDER = files("insonify.scenario") / "templates"


def template_names() -> tuple[str, ...]:
    """Names of the templates, sorted."""
    return tuple(sorted(file.name.removesuffix(".yaml") for file in _FOLDER.iterdir() if file.name.endswith(".yaml")))


def template_text(name: str) -> str:
    """Text of a template's scenario file, with its comments.

    Args:
        name: One of `template_names()`.

    Raises:
        ValueError: There is no such template.
    """
    known = template_names()
    if name not in known:
        meant = nearest_word(str(name), known)
        advice = f"did you mean {meant!r}?" if meant else f"give one of {', '.join(known)}"
        raise ValueError(f"there is no template {name!r}; {advice}")
    return (_FOLDER / f"{name}.yaml").read_text(encoding="utf-8")


def load_template(name: str) -> Scenario:
    """Scenario of a template, to be changed and simulated.

    Args:
        name: nominal, sidescan, coherent-sidescan, forward-looking, multibeam, interferometric, synthetic-aperture or
            echosounder, as of `insonify new NAME --template`.

    Raises:
        ValueError: There is no such template.

    Example:
        >>> scenario = insonify.load_template("forward-looking").with_({"seabed.depth": 12.0})
        >>> scenario.seabed.depth, scenario.field
        (12.0, 'coherent')
    """
    return parse_model(Scenario, template_text(name), name=f"{name}.yaml")
