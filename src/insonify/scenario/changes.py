"""Changes of a scenario by the paths of its keys, checked and reported as those of a file are."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any, Literal, TypeVar, get_origin

import numpy as np
from pydantic import BaseModel

from insonify.scenario.diagnostic import Diagnostic
from insonify.scenario.load import parse_source
from insonify.scenario.unit_warnings import unit_warnings
from insonify.scenario.yaml_source import Path, YamlSource, dotted

ModelT = TypeVar("ModelT", bound=BaseModel)
NAME = "scenario"
"""Name of the scenario in messages."""


def with_changes(model: ModelT, changes: Mapping[str, object]) -> tuple[ModelT, list[Diagnostic]]:
    """Copy of a model with some of its values replaced, validated as a whole.

    Args:
        model: The model, such as a scenario; it stays as it is.
        changes: New values by path: keys and list indices joined by dots, such as "targets.0.position". Values are
            those of a file ("6 m/s"), plain Python values, arrays, or models.

    Returns:
        The new model, and warnings about numbers without a unit that were probably meant in another one.

    Raises:
        ScenarioError: A path leads nowhere, or a value is refused; every fault with its path and the fix.
    """
    source = YamlSource(NAME, values=_plain(model), lines={(): 0})
    source.faults = [fault for path, value in changes.items() if (fault := _put(source, model, path, as_typed(value)))]
    return parse_source(type(model), source, ""), unit_warnings(type(model), source)


def _put(source: YamlSource, model: BaseModel, dotted_path: str, value: object) -> Diagnostic | None:
    """Set a value among plain values; a fault where its path leads into something without keys."""
    *parents, last = [int(step) if step.isdecimal() else step for step in dotted_path.split(".")]
    inside: Any = source.values
    path: Path = ()
    for step in parents:
        if fault := _path_error(inside, path, step, dotted_path):
            return fault
        path = (*path, step)
        if isinstance(inside, dict) and inside.get(str(step)) is None:
            inside[str(step)] = _default(model, path)
        inside = inside[step if isinstance(inside, list) else str(step)]
    if fault := _path_error(inside, path, last, dotted_path):
        return fault
    key = last if isinstance(inside, list) else str(last)
    _forget(source, (*path, last))
    inside[key] = value
    record_typed(source, (*path, last), value)
    return None


def _path_error(inside: Any, path: Path, step: str | int, dotted_path: str) -> Diagnostic | None:
    """The fault of a step that a value cannot take: a key of no group, an index beyond a list."""
    key = dotted(path) or NAME
    if isinstance(inside, dict):
        return None
    if not isinstance(inside, list):
        return Diagnostic(
            NAME, 0, dotted_path, f"{key} is {inside!r}, which has no keys", fix=f"Change {key} as a whole"
        )
    if not isinstance(step, int):
        return Diagnostic(NAME, 0, dotted_path, f"{key} is a list", fix=f"Give an index, such as {key}.0")
    if step >= len(inside):
        has = f"indices 0 to {len(inside) - 1}" if inside else "no entries"
        return Diagnostic(NAME, 0, dotted_path, f"{key} has {has}", fix=f"Change {key} as a whole to add one")
    return None


def _default(model: BaseModel, path: Path) -> Any:
    """Plain values of a group of keys or a list that was left out, or a new group where there is none."""
    value: Any = model
    for step in path:
        value = value[step] if isinstance(step, int) and isinstance(value, tuple) else getattr(value, str(step), None)
    if isinstance(value, tuple):
        return list(value)
    return _plain(value, whole=True) if isinstance(value, BaseModel) else {}


def _plain(model: BaseModel, *, whole: bool = False) -> dict[str, Any]:
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
        return _plain(value) if isinstance(dumped, dict) else dumped
    if isinstance(value, tuple) and isinstance(dumped, list) and len(value) == len(dumped):
        return [_written(one, plain) for one, plain in zip(value, dumped, strict=True)]
    return dumped


def as_typed(value: object) -> Any:
    """A value given in Python as a file would have it.

    Args:
        value: A plain value, array, path or model, or a list or mapping of them.
    """
    if isinstance(value, BaseModel):
        return _plain(value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): as_typed(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [as_typed(inner) for inner in value]
    return str(value) if isinstance(value, PurePath) else value


def _forget(source: YamlSource, path: Path) -> None:
    for known in [known for known in source.written if known[: len(path)] == path]:
        del source.written[known]


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
