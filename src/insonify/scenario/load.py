"""From a scenario file to the frozen nouns, or to advice on every line that is wrong."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from pydantic import BaseModel, ValidationError

from insonify.scenario.advice import Advice, ScenarioError
from insonify.scenario.source import Source, read
from insonify.scenario.unit_doubts import unit_doubts
from insonify.scenario.verdict import advise, strays
from insonify.validity import PhysicsWarning

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

Model = TypeVar("Model", bound=BaseModel)


def load_scenario(path: str | Path) -> Scenario:
    """The scenario that a YAML file describes.

    Args:
        path: The file.

    Raises:
        ScenarioError: Every fault found in the file, one line each.
    """
    from insonify.scenario.scenario import Scenario

    return load(Scenario, path)


def load(model: type[Model], path: str | Path) -> Model:
    """A noun from the YAML file that describes it.

    Args:
        model: The noun's class.
        path: The file.

    Raises:
        ScenarioError: Every fault found in the file, one line each.
    """
    source = read(_text(Path(path)), str(path))
    noun = _parsed(model, source, Path(path).parent)
    for doubt in unit_doubts(model, source):
        warnings.warn(str(doubt), PhysicsWarning, stacklevel=3)
    return noun


def parse(
    model: type[Model], text: str, *, name: str = "scenario", folder: str | Path = "", recorded: bool = False
) -> Model:
    """A noun from a YAML text.

    Args:
        model: The noun's class.
        text: The YAML.
        name: What messages call the text.
        folder: Where the files stand that it names by relative paths; the working directory by default.
        recorded: True: the text is that of a recording. It was simulated, so whether its parts fit is not asked again.

    Raises:
        ScenarioError: Every fault found in the text, one line each.
    """
    return _parsed(model, read(text, name), Path(folder), recorded=recorded)


def _parsed(model: type[Model], source: Source, folder: Path, *, recorded: bool = False) -> Model:
    if source.values is None:
        raise ScenarioError(source.faults)
    source.faults += strays(model, source)
    noun, faults = _validated(model, source, {"folder": folder, "recorded": recorded})
    if noun is None or source.faults:
        raise ScenarioError([*source.faults, *faults])
    return noun


def _validated(model: type[Model], source: Source, context: dict[str, object]) -> tuple[Model | None, list[Advice]]:
    try:
        return model.model_validate(source.values, context=context), []
    except ValidationError as error:
        return None, advise(error, model, source)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        fault = Advice(str(path), 0, "", f"not text: byte {error.start} is not UTF-8", fix="Save it as UTF-8 text")
    except FileNotFoundError:
        fault = Advice(str(path), 0, "", "there is no such file", fix="Start from a template: insonify new NAME")
    except OSError as error:
        fault = Advice(str(path), 0, "", f"cannot be read: {error.strerror}")
    raise ScenarioError([fault])
