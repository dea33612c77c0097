"""Type that is expected at a position in the scenario: units, limits, choices, keys.

Everything is read from the models themselves, so that a message can never disagree with
the check that it explains.
"""

import dataclasses
import types
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, Self, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel

from insonify.diagnostics.yaml_source import Path
from insonify.units import UNITS


@dataclass(frozen=True, slots=True)
class ExpectedType:
    """One of the kinds of value that a position accepts."""

    kind: Any
    """A plain type, a model, or a generic such as tuple[float, ...]."""
    notes: tuple[Any, ...] = ()
    """Metadata of the type: units and limits."""

    @property
    def units(self) -> str:
        """Name of its SI unit; empty for a bare number."""
        return self._schema_extra("units")

    @property
    def fix(self) -> str:
        """Advice on a list that is too long; empty where its model has none."""
        return self._schema_extra("fix")

    @property
    def dimension(self) -> str:
        """Its dimension, a key of `insonify.units.UNITS`; empty where it has none."""
        return next((name for name, units in UNITS.items() if self.units in units), "")

    @property
    def limits(self) -> dict[str, float]:
        """Those of ge, gt, le, lt that bound it, in SI."""
        notes = [inner for note in self.notes for inner in (*getattr(note, "metadata", ()), note)]
        pairs = [(name, getattr(note, name, None)) for note in notes for name in ("ge", "gt", "le", "lt")]
        return {name: float(bound) for name, bound in pairs if isinstance(bound, int | float)}

    @property
    def keys(self) -> "dict[str, list[ExpectedType]]":
        """Expected types of each key of a model; empty for other types."""
        return _keys(self.kind) if isinstance(self.kind, type) else {}

    def _schema_extra(self, word: str) -> str:
        extras = (getattr(note, "json_schema_extra", None) for note in self.notes)
        return next((str(extra[word]) for extra in extras if isinstance(extra, dict) and word in extra), "")

    def item(self, index: int) -> list[Self]:
        """Expected types of one item of a list; empty where it is not a list."""
        inner = get_args(self.kind)
        if get_origin(self.kind) not in (tuple, list) or not inner:
            return []
        if inner[-1] is Ellipsis or get_origin(self.kind) is list:
            return list(self.unfold(inner[0]))
        return list(self.unfold(inner[index])) if 0 <= index < len(inner) else []

    @property
    def mapped(self) -> list[Self]:
        """Expected types of the values of a mapping with free keys; empty for other types."""
        return list(self.unfold(get_args(self.kind)[1])) if get_origin(self.kind) is dict else []

    def tags(self, key: str = "") -> set[str]:
        """Words that distinguish a model from its alternatives: its kind, shape or law."""
        keys = [self.keys.get(key, [])] if key else self.keys.values()
        choices = [
            expected.kind for alternatives in keys for expected in alternatives if get_origin(expected.kind) is Literal
        ]
        return {str(word) for choice in choices for word in get_args(choice)}

    @classmethod
    def unfold(cls, annotation: Any, notes: tuple[Any, ...] = ()) -> Iterator[Self]:
        """The plain alternatives behind an annotation, each with its own notes."""
        if get_origin(annotation) is Annotated:
            inner, *more = get_args(annotation)
            yield from cls.unfold(inner, (*notes, *more))
        elif get_origin(annotation) in (Union, types.UnionType):
            for choice in get_args(annotation):
                yield from cls.unfold(choice, notes)
        else:
            yield cls(annotation, notes)

    def description(self) -> str:
        """The kind of value in words: "a length in m", "a list of 3", "one of box, point"."""
        inner = get_args(self.kind)
        if self.kind is not type(None) and self._schema_extra("words"):
            return self._schema_extra("words")
        if get_origin(self.kind) is Literal:
            return f"one of {', '.join(str(choice) for choice in inner)}"
        if get_origin(self.kind) in (tuple, list):
            is_open = not inner or inner[-1] is Ellipsis or get_origin(self.kind) is list
            return "a list" if is_open else f"a list of {len(inner)}"
        if self.keys:
            return f"a group of keys ({', '.join(self.keys)})"
        if self.units:
            return f"{_a(self.dimension or 'level')} in {self.units}"
        plain = {float: "a number", int: "a whole number", str: "text", bool: "true or false", type(None): "nothing"}
        return plain.get(self.kind, "another kind of value")


@cache
def _keys(kind: type) -> dict[str, list[ExpectedType]]:
    """Kinds of value that each key of a model or a dataclass accepts; empty for any other type."""
    if issubclass(kind, BaseModel):
        return {
            name: list(ExpectedType.unfold(field.annotation, (field,))) for name, field in kind.model_fields.items()
        }
    if dataclasses.is_dataclass(kind):
        hints = get_type_hints(kind, include_extras=True)
        return {f.name: list(ExpectedType.unfold(hints[f.name])) for f in dataclasses.fields(kind) if f.init}
    return {}


def _a(name: str) -> str:
    return f"an {name}" if name[0] in "aeiou" else f"a {name}"


def find(model: type[BaseModel], values: Any, loc: Path) -> tuple[Path, list[ExpectedType]]:
    """The position in a file that a validation error means, and the types expected there.

    Args:
        model: Model that the file describes.
        values: The file's plain values.
        loc: Location as the validator gives it: besides keys and indices it names
            the alternative of a union that it had in mind.

    Returns:
        Path of keys and indices only, and the alternatives of what may stand there.
    """
    path: Path = ()
    expected = [ExpectedType(model)]
    for step, ahead in zip(loc, (*loc[1:], None), strict=False):
        models = [choice for choice in expected if choice.keys]
        chosen = [choice for choice in models if step in choice.tags()]
        # where a word names an alternative and a key of it alike, the next step decides, a key known or in the file
        besides = values if isinstance(values, dict) else {}
        if any(step in choice.keys and ahead not in (*choice.keys, *besides) for choice in chosen):
            chosen = []
        if isinstance(step, int):
            expected = [inner for choice in expected for inner in choice.item(step)]
            if not isinstance(values, list):  # one value, standing for a list of one
                continue
        elif len(models) > 1 and chosen:
            expected = chosen
            continue
        elif any(step in choice.keys for choice in models):
            expected = [inner for choice in models for inner in choice.keys.get(step, [])]
        elif isinstance(values, dict) and step in values:
            # a value of a mapping, or a key that none of them has
            expected = [inner for choice in expected for inner in choice.mapped] or models
        else:
            continue
        path = (*path, step)
        values = _inside(values, step)
    return path, expected


def _inside(values: Any, step: str | int) -> Any:
    try:
        return values[step]
    except (KeyError, IndexError, TypeError):
        return None
