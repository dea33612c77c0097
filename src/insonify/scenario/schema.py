"""JSON schema of the scenario file, for editors: every key with its description, unit, range and default.

It is made of the models: types, limits and defaults as pydantic reports them, descriptions from the docstrings of the
fields. Quantities are numbers in SI or strings with a unit. Shorthands that the models complete (one relief instead of
a list, a law without its name) are accepted too, so the schema refuses nothing that `insonify check` accepts.
"""

import ast
import inspect
import itertools
import textwrap
from typing import Any

from pydantic import BaseModel, BeforeValidator

from insonify.scenario.scenario import Scenario
from insonify.scene.shape_library import PRESETS
from insonify.units import UNITS

DIALECT = "https://json-schema.org/draft/2020-12/schema"
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
OTHER_FORM = {"type": ["array", "object", "string", "null"]}
"""Schema of a value in a shorthand that its model completes."""
_LIMITS = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}
_NUMBER = r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"


def json_schema() -> dict[str, Any]:
    """The schema of a scenario as plain values, for `json.dump`.

    Example:
        >>> json_schema()["$defs"]["Seabed"]["properties"]["depth"]["description"]  # doctest: +ELLIPSIS
        'Depth of ... [m], 0.1 to 12000 m; default 20 m.'
    """
    schema = Scenario.model_json_schema()
    models = {model.__name__: model for model in _models(Scenario)}
    for name, part in {**schema["$defs"], "Scenario": schema}.items():
        descriptions = field_descriptions(models[name]) if name in models else {}
        for key, item in part.get("properties", {}).items():
            item.pop("title", None)
            text = descriptions.get(key, "") or NAMES.get(key, "") or _type_description(item, schema["$defs"])
            item["description"] = _with_range(text, item)
            if name in models and _has_shorthand(models[name], key) and not _unit(item):
                part["properties"][key] = {"description": item.pop("description"), "anyOf": [item, OTHER_FORM]}
    profile, library = schema["$defs"]["ScenarioProfile"], schema["$defs"]["LibraryTarget"]
    schema["$defs"]["ScenarioProfile"] = {"anyOf": [profile, {"type": ["array", "string"]}]}
    library["properties"]["shape"] |= {"enum": ["library", *PRESETS]}  # the name of a preset may stand for both keys
    library["properties"]["shape"].pop("const")
    library["required"].remove("name")
    return {"$schema": DIALECT, **_completed(schema)}


def field_descriptions(model: type[BaseModel]) -> dict[str, str]:
    """First paragraph of the docstring under each field of a model and of its base classes.

    Args:
        model: The model; its source is read.
    """
    descriptions: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if not (issubclass(base, BaseModel) and base.__module__.startswith("insonify.")):
            continue
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(base))).body
        body = tree.body if isinstance(tree, ast.ClassDef) else []
        for field, below in itertools.pairwise(body):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(below, ast.Expr):
                text = ast.literal_eval(below.value) if isinstance(below.value, ast.Constant) else ""
                descriptions[field.target.id] = " ".join(str(text).split("\n\n")[0].split())
    return descriptions


def _models(model: type[BaseModel]) -> set[type[BaseModel]]:
    """A model and all models that its fields may hold."""
    from insonify.model import Model

    models, stack = {model}, list(Model.__subclasses__())
    while stack:
        below = stack.pop()
        models.add(below)
        stack += below.__subclasses__()
    return models


def _has_shorthand(model: type[BaseModel], key: str) -> bool:
    """Return True if a field of a model completes a shorthand before it is validated."""
    notes = model.model_fields[key].metadata if key in model.model_fields else []
    return any(isinstance(note, BeforeValidator) for note in notes)


def _is_title(key: str, value: Any) -> bool:
    """Return True if an entry is pydantic's title of a part, rather than a property of that name."""
    return key == "title" and isinstance(value, str)


def _type_description(item: dict[str, Any], definitions: dict[str, Any]) -> str:
    """Description of the group of keys that a key holds; of several alternatives, of none."""
    parts = [part["$ref"].rsplit("/", 1)[1] for part in (item, *item.get("anyOf", ())) if "$ref" in part]
    return str(definitions[parts[0]].get("description", "")).split("\n\n")[0] if len(parts) == 1 else ""


def _unit(item: dict[str, Any]) -> str:
    """Unit of a quantity after a space; empty for anything else."""
    return next((f" {part['units']}" for part in (item, *item.get("anyOf", ())) if part.get("units")), "")


def _with_range(text: str, item: dict[str, Any]) -> str:
    """A description with limits and default, in the unit of the key."""
    parts: list[dict[str, Any]] = [item, *item.get("anyOf", ())]
    number = next((part for part in parts if part.get("type") in ("number", "integer")), {})
    unit = _unit(item)
    low, high = number.get("ge", number.get("minimum")), number.get("le", number.get("maximum"))
    above, below = (number.get(a, number.get(b)) for a, b in (("gt", "exclusiveMinimum"), ("lt", "exclusiveMaximum")))
    text = " ".join(text.split()).rstrip(".")
    if low is not None and high is not None:
        text += f", {low:g} to {high:g}{unit}"
    else:
        bounds = ((low, "at least"), (above, "above"), (high, "at most"), (below, "below"))
        text += "".join(f", {words} {bound:g}{unit}" for bound, words in bounds if bound is not None)
    default = item.get("default")
    if isinstance(default, str | int | float) and default != "":
        shown = str(default).lower() if isinstance(default, bool) else f"{default:g}" if unit else str(default)
        text += f"; default {shown}{unit}"
    return f"{text}."


def _completed(item: Any) -> Any:
    """The schema with strings beside quantities, lists beside single values, and open alternatives."""
    if isinstance(item, list):
        return [_completed(part) for part in item]
    if not isinstance(item, dict):
        return item
    done = {
        key: _completed(value) for key, value in item.items() if key != "discriminator" and not _is_title(key, value)
    }
    if "oneOf" in done:
        done["anyOf"] = done.pop("oneOf")
    if done.get("type") == "number":
        return _quantity(done)
    if done.get("type") == "array":
        return _shorthand(done)
    return done


def _quantity(item: dict[str, Any]) -> dict[str, Any]:
    """A number in SI, or a string of a number and a unit of its dimension."""
    unit = item.pop("units", "")
    number: dict[str, Any] = {"type": "number"} | {
        _LIMITS.get(key, key): item.pop(key) for key in (*_LIMITS, *_LIMITS.values()) if key in item
    }
    units = next((list(known) for known in UNITS.values() if unit in known), [unit] if unit else [])
    if not unit:
        return {**item, **number}
    spelt = "|".join(name.replace("/", r"\/") for name in units)
    text = {"type": "string", "pattern": rf"^\s*{_NUMBER}\s*({spelt}|dB.*)?\s*$"}
    return {**{key: value for key, value in item.items() if key != "type"}, "anyOf": [number, text]}


def _shorthand(item: dict[str, Any]) -> dict[str, Any]:
    """A list, or what the models complete to one: a single item, a range of angles, a file."""
    lists = {key: item[key] for key in item if key not in ("description", "default", "minItems")}
    rest: dict[str, Any] = {key: item[key] for key in ("description", "default") if key in item}
    single = [lists["items"]] if "items" in lists else []
    return {**rest, "anyOf": [lists, *single, {"type": ["object", "string", "null"]}]}
