"""Values given in Python as a scenario file has them: plain, and with the text of each."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any, Literal, get_origin

import numpy as np
from pydantic import BaseModel

from insonify.diagnostics.yaml_source import Path, YamlSource


def as_typed(value: object) -> Any:
    """A value given in Python as a file would have it.

    Args:
        value: A plain value, array, path or model, or a list or mapping of them.
    """
    if isinstance(value, BaseModel):
        return plain_model(value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): as_typed(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [as_typed(inner) for inner in value]
    return str(value) if isinstance(value, PurePath) else value


def record_typed(source: YamlSource, path: Path, value: Any) -> None:
    """Note how each plain value was typed, for messages in the caller's own units.

    Args:
        source: Source that notes it.
        path: Position of the value.
        value: The value, from `as_typed`.
    """
    if isinstance(value, dict | list):
        for step, inner in value.items() if isinstance(value, dict) else enumerate(value):
            record_typed(source, (*path, step), inner)
        return
    source.written[path] = "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def plain_model(model: BaseModel, *, whole: bool = False) -> dict[str, Any]:
    """Values of a model as a file has them: those that were given, differ from their defaults, or name its kind.

    Args:
        model: The model.
        whole: True if values that were left out are written too.
    """
    dumped = model.model_dump(mode="json")
    names = [name for name in dumped if whole or name in model.model_fields_set or _is_needed(model, name)]
    return {name: _written(getattr(model, name, None), dumped[name]) for name in names}


def _is_needed(model: BaseModel, name: str) -> bool:
    """Return True if a value must be written though not given: it names a kind, or is no default."""
    field = type(model).model_fields.get(name)
    if field is None or get_origin(field.annotation) is Literal:
        return True
    return bool(getattr(model, name) != field.get_default(call_default_factory=True))


def _written(value: object, dumped: Any) -> Any:
    """A value in plain form: models without what was left out in them."""
    if isinstance(value, BaseModel):
        return plain_model(value) if isinstance(dumped, dict) else dumped
    if isinstance(value, tuple) and isinstance(dumped, list) and len(value) == len(dumped):
        return [_written(one, plain) for one, plain in zip(value, dumped, strict=True)]
    return dumped
