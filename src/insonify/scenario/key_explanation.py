"""Explanation of a key of a scenario: meaning, unit, range and default, as its model states and checks them.

The meaning is the docstring under the field, which has the unit of each number in brackets; range and default are those
that pydantic reports.
"""

import ast
import inspect
import itertools
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import BaseModel

from insonify.value_range import value_range

NAMES = {
    "kind": "Kind of this group of keys.",
    "label": "Name of the object in labels and arrivals.",
    "law": "Name of the scattering law.",
    "receive": "Receiving array.",
    "shape": "Shape of the target.",
    "targets": "Targets: solids, meshes, things of the library and points.",
    "track": "Track of the platform, with the times of its pings.",
    "transmit": "Transmitting array.",
}
"""Descriptions of keys that name an alternative or an object, the same in every model."""
_UNIT = re.compile(r"\[([^\]]+)\]")
_LIMITS = {"minimum": "ge", "exclusiveMinimum": "gt", "maximum": "le", "exclusiveMaximum": "lt"}  # of JSON schema
_WORDS = {"None": "null", "True": "true", "False": "false"}  # of Python, and of a file


@dataclass(frozen=True, slots=True)
class KeyExplanation:
    """Explanation of one key."""

    meaning: str
    """Description, with the units of numbers in brackets."""
    units: tuple[str, ...]
    """Units of its numbers; empty for a key without any."""
    ranges: tuple[str, ...]
    """Ranges that are allowed: one for each unit, or one for all."""
    choices: tuple[str, ...]
    """Words that are allowed; empty for a key that takes any text, or none."""
    default: str
    """Value that a file without the key has, as the file would state it; empty where the key is needed."""

    @property
    def text(self) -> str:
        """The whole explanation: each range behind its unit, and the default at the end."""
        ranges = iter([f", {limits}" for limits in self.ranges if limits])
        text = _UNIT.sub(lambda unit: unit[0] + next(ranges, ""), self.meaning) if self.units else self.meaning
        stated = "" if not self.default or "default:" in text else f"; default {self.default}"
        return f"{text.rstrip('.')}{''.join(ranges)}{stated}."


def key_explanation(meaning: str, item: dict[str, Any], definitions: dict[str, Any]) -> KeyExplanation:
    """Explanation of a key.

    Args:
        meaning: Docstring of its field; empty where the model has none.
        item: Schema of its values as pydantic makes it, with limits by their names in JSON schema.
        definitions: Schemas of all models by their names.
    """
    meaning = re.sub(r"\b(None|True|False)\b", lambda word: _WORDS[word[0]], " ".join(meaning.split())).rstrip(".")
    numbers = list(_numbers(item))
    units = tuple(_UNIT.findall(meaning)) if numbers else ()
    distinct = list(dict.fromkeys(numbers))
    named = dict(enumerate(map(_shown_unit, units)))
    shown = [unit or named.get(number, "") for number, (_, unit) in enumerate(distinct)]
    ranges = tuple(value_range(dict(limits), unit) for (limits, _), unit in zip(distinct, shown, strict=True))
    if len(ranges) == 1 and ranges[0] and _is_list(item):
        ranges = (f"each {ranges[0]}",)
    if "const" in item:
        meaning = meaning if item["const"] in meaning else f"{meaning}: {item['const']}"
        return KeyExplanation(meaning, units, ranges, (item["const"],), "")
    default = _default(item, shown[0] if shown else "", definitions) if "default" in item else ""
    return KeyExplanation(meaning, units, ranges, tuple(_choices(item)), default)


def type_meaning(item: dict[str, Any], definitions: dict[str, Any]) -> str:
    """Description of the group of keys that a key holds; of several alternatives, of none.

    Args:
        item: Schema of the key's values.
        definitions: Schemas of all models by their names.
    """
    parts = [part["$ref"].rsplit("/", 1)[1] for part in (item, *item.get("anyOf", ())) if "$ref" in part]
    return str(definitions[parts[0]].get("description", "")).split("\n\n")[0] if len(parts) == 1 else ""


def field_descriptions(model: type) -> dict[str, str]:
    """First paragraph of the docstring under each field of a model or dataclass and of its base classes, by key.

    Args:
        model: The class; its source is read.
    """
    descriptions: dict[str, str] = {}
    for base in reversed(model.__mro__):
        body = _class_bodies(base.__module__).get(base.__name__, []) if base.__module__.startswith("insonify.") else []
        for field, below in itertools.pairwise(body):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(below, ast.Expr):
                text = ast.literal_eval(below.value) if isinstance(below.value, ast.Constant) else ""
                descriptions[_key(model, field.target.id)] = str(text).split("\n\n")[0]
    return descriptions


@cache
def _class_bodies(module: str) -> dict[str, list[ast.stmt]]:
    """Statements of each class of a module, by its name."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {node.name: node.body for node in tree.body if isinstance(node, ast.ClassDef)}


def _key(model: type, field: str) -> str:
    """Key of a field in a file."""
    fields = model.model_fields if issubclass(model, BaseModel) else {}
    return (fields[field].alias if field in fields else None) or field


def _numbers(item: dict[str, Any]) -> list[tuple[tuple[tuple[str, float], ...], str]]:
    """Limits and unit of each number of a value, list or row, in order."""
    if item.get("type") in ("number", "integer"):
        limits = [(name, item[keyword]) for keyword, name in _LIMITS.items() if keyword in item]
        return [(tuple(limits), _shown_unit(item.get("units", "")))]
    below = [*item.get("anyOf", ()), *item.get("prefixItems", ()), *([item["items"]] if "items" in item else [])]
    return [number for part in below for number in _numbers(part)]


def _choices(item: dict[str, Any]) -> Iterator[str]:
    """Words that a value may be, or that a list may hold."""
    if item.get("type") == "boolean":
        yield from ("true", "false")
    yield from item.get("enum", [item["const"]] if "const" in item else [])
    for part in (*item.get("anyOf", ()), *([item["items"]] if "items" in item else [])):
        yield from _choices(part)


def _is_list(item: dict[str, Any]) -> bool:
    """Return True if a value may be a list."""
    return any(part.get("type") == "array" for part in (item, *item.get("anyOf", ())))


def _shown_unit(unit: str) -> str:
    """A unit as it stands behind a number: without reference, and none for a ratio."""
    return "" if unit == "1" else unit.split(" re ")[0]


def _default(item: dict[str, Any], unit: str, definitions: dict[str, Any]) -> str:
    """Default of a key, as a file would state it; of a group of keys, the keys that differ from their own defaults."""
    default = item["default"]
    if isinstance(default, dict) and "$ref" in item:
        own = definitions[item["$ref"].rsplit("/", 1)[1]]["properties"]
        default = {key: value for key, value in default.items() if own[key].get("default", own) != value}
    is_quantity = isinstance(default, int | float | list) and not isinstance(default, bool) and default != []
    return _flow(default) + (f" {unit}" if unit and is_quantity else "")


def _flow(value: Any) -> str:
    """A plain value in the flow style of YAML."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {_flow(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_flow, value))}]"
    if isinstance(value, bool) or value is None:
        return _WORDS[str(value)]
    return f"{value:g}" if isinstance(value, float) else str(value) or '""'
