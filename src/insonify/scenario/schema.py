"""JSON schema of the scenario file, for editors: every key with its description, unit, range and default.

It is made of the models: types, limits and defaults as pydantic reports them, descriptions from the docstrings of the
fields. Quantities are numbers in SI or strings with a unit. Shorthands that the models complete (one relief instead of
a list, a law without its name) are accepted too, so the schema refuses nothing that `insonify check` accepts, but for
numbers without a unit in quotes.
"""

import dataclasses
from collections.abc import Iterator
from typing import Any, get_args, get_type_hints

from pydantic import BaseModel

from insonify.ocean.profile_file import QUANTITIES
from insonify.scenario.key_explanation import NAMES, KeyExplanation, field_descriptions, key_explanation, type_meaning
from insonify.scenario.scenario import Scenario
from insonify.scene.shape_library import PRESETS
from insonify.units import UNITS

DIALECT = "https://json-schema.org/draft/2020-12/schema"
SCENARIO = "Scenario"
"""Name of the model of the whole file."""
_LIMITS = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}
_NUMBER = r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"
_COLUMNS = {
    "temperature": "Temperature at the knots [degC]: with the salinity, instead of the speed; left out beside a speed.",
    "salinity": "Salinity at the knots [g/kg]: with the temperature, instead of the speed; left out beside a speed.",
}
"""Descriptions of columns of a profile from which speeds are computed, so that no field has them."""


def json_schema() -> dict[str, Any]:
    """The schema of a scenario as plain values, for `json.dump`.

    Example:
        >>> json_schema()["$defs"]["Seabed"]["properties"]["depth"]["description"]  # doctest: +ELLIPSIS
        'Depth of ... [m], 0.1 to 12000 m; default 20 m.'
    """
    schema = plain_schema()
    definitions = schema["$defs"]
    for part in (schema, *definitions.values()):
        if "description" in part:
            part["description"] = part["description"].partition("\n\nExample:")[0]  # Python's, not a file's
    for name, keys in explanations(schema).items():
        for key, explanation in keys.items():
            (schema if name == SCENARIO else definitions[name])["properties"][key]["description"] = explanation.text
    definitions["ScenarioProfile"] = _profile_forms(definitions["ScenarioProfile"])
    library = definitions["LibraryTarget"]
    library["required"] = ["shape", *(key for key in library["required"] if key != "name")]
    library["properties"]["shape"] = {"description": library["properties"]["shape"]["description"]}
    library["anyOf"] = [  # the name of a preset may stand for both keys
        {"properties": {"shape": {"const": "library"}}, "required": ["name"]},
        {"properties": {"shape": {"enum": list(PRESETS)}, "name": False}},
    ]
    return {"$schema": DIALECT, **_completed(schema)}


def plain_schema() -> dict[str, Any]:
    """Pydantic's schema, with limits by their names in JSON schema and the columns of a profile that no field has."""
    schema = _named_limits(Scenario.model_json_schema())
    columns = schema["$defs"]["ScenarioProfile"]["properties"]
    for name in _COLUMNS:
        units, low, high = QUANTITIES[name]
        number = {"type": "number", "units": next(iter(units)), "minimum": low, "maximum": high}
        columns[name] = {"type": "array", "items": number}
    return schema


def explanations(schema: dict[str, Any]) -> dict[str, dict[str, KeyExplanation]]:
    """Explanation of each key of a plain schema, by the names of model and key."""
    definitions = schema["$defs"]
    models = {model.__name__: model for model in _models(Scenario)}
    explained = {}
    for name, part in {SCENARIO: schema, **definitions}.items():
        meanings = NAMES | _COLUMNS | field_descriptions(models[name])
        explained[name] = {
            key: key_explanation(meanings.get(key) or type_meaning(item, definitions), item, definitions)
            for key, item in part["properties"].items()
        }
    return explained


def _models(kind: Any, found: set[type] | None = None) -> set[type]:
    """A model or dataclass, and all that its fields may hold."""
    found = set() if found is None else found
    if isinstance(kind, type) and kind not in found and (issubclass(kind, BaseModel) or dataclasses.is_dataclass(kind)):
        found.add(kind)
        for below in _field_types(kind):
            _models(below, found)
    for below in get_args(kind):
        _models(below, found)
    return found


def _field_types(kind: type) -> Iterator[Any]:
    """Types of the fields of a model or dataclass, those of shorthands included."""
    if not issubclass(kind, BaseModel):
        yield from get_type_hints(kind).values()
        return
    for field in kind.model_fields.values():
        yield field.annotation
        yield from (getattr(note, "json_schema_input_type", None) for note in field.metadata)


def _named_limits(item: Any) -> Any:
    """A schema with the names that JSON schema has for limits, where pydantic writes its own."""
    if isinstance(item, list):
        return [_named_limits(part) for part in item]
    if not isinstance(item, dict):
        return item
    is_number = item.get("type") in ("number", "integer")
    return {_LIMITS.get(key, key) if is_number else key: _named_limits(value) for key, value in item.items()}


def _profile_forms(profile: dict[str, Any]) -> dict[str, Any]:
    """A sound-speed profile as columns, rows, or the name of a table."""
    keys = profile["properties"]
    row = {"type": "array", "prefixItems": [keys[name]["items"] for name in ("depth", "speed")],
           "minItems": 2, "maxItems": 2}  # fmt: skip
    complete = [["depth", "speed"], ["depth", "temperature", "salinity"], ["file"]]
    columns = profile | {"anyOf": [{"required": names} for names in complete]}
    del columns["required"]
    return {"anyOf": [columns, {"type": "array", "items": row, "minItems": 2}, {"type": "string", "minLength": 1}]}


def _is_title(key: str, value: Any) -> bool:
    """Return True if an entry is pydantic's title of a part, rather than a property of that name."""
    return key == "title" and isinstance(value, str)


def _completed(item: Any) -> Any:
    """The schema with strings beside quantities, and with open alternatives that are selected by one key."""
    if isinstance(item, list):
        return [_completed(part) for part in item]
    if not isinstance(item, dict):
        return item
    done = {
        key: _completed(value)
        for key, value in item.items()
        if key not in ("discriminator", "fix", "words") and not _is_title(key, value)
    }
    if "oneOf" in done:
        done["anyOf"] = done.pop("oneOf")
        if "discriminator" in item:
            done["required"] = [item["discriminator"]["propertyName"]]
    return _quantity(done) if done.get("type") == "number" else done


def _quantity(number: dict[str, Any]) -> dict[str, Any]:
    """A number in SI, or a string of a number and a unit of its dimension where the model reads one."""
    unit = number.pop("units", "")
    units = next((list(known) for known in UNITS.values() if unit in known), [])
    written = f"({'|'.join(units)})?".replace("/", r"\/") if units else ""
    if unit == "dB/m":
        written = r"(dB)?\s*\/\s*k?m"
    elif unit.startswith("dB"):
        written = r"(dB([\s\/].*)?)?"
    if not written:
        return number
    notes: dict[str, Any] = {key: number.pop(key) for key in ("description", "default") if key in number}
    text = {"type": "string", "pattern": rf"^\s*{_NUMBER}\s*{written}\s*$"}
    return {**notes, "anyOf": [number, text]}
