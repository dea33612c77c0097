"""Plain values to frozen models, or to advice on every value that is wrong."""

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from insonify.diagnostics.diagnostic import ScenarioError
from insonify.diagnostics.validation_errors import validation_diagnostics, yaml_boolean_errors
from insonify.diagnostics.yaml_source import YamlSource

ModelT = TypeVar("ModelT", bound=BaseModel)


def parse_source(model: type[ModelT], source: YamlSource, folder: str | Path, *, recorded: bool = False) -> ModelT:
    """Parse a model from plain values; arguments as those of `load.parse_model`.

    Raises:
        ScenarioError: Every fault found in the values, those that the source has already included.
    """
    if source.values is None:
        raise ScenarioError(source.faults)
    source.faults += yaml_boolean_errors(model, source)
    try:
        parsed = model.model_validate(source.values, context={"folder": folder, "recorded": recorded})
    except ValidationError as error:
        raise ScenarioError([*source.faults, *validation_diagnostics(error, model, source)]) from None
    if source.faults:
        raise ScenarioError(source.faults)
    return parsed
