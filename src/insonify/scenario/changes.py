"""Changes of a scenario by the paths of its keys, checked and reported as those of a file are."""

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel

from insonify.diagnostics.diagnostic import Diagnostic
from insonify.diagnostics.python_values import as_typed, plain_model, record_typed
from insonify.diagnostics.yaml_source import Path, YamlSource, dotted
from insonify.scenario.parsing import parse_source
from insonify.scenario.unit_warnings import unit_warnings

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
    source = YamlSource(NAME, values=plain_model(model), lines={(): 0})
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
    path = (*path, last)
    source.written = {known: text for known, text in source.written.items() if known[: len(path)] != path}
    inside[key] = value
    record_typed(source, path, value)
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
    return plain_model(value, whole=True) if isinstance(value, BaseModel) else {}
