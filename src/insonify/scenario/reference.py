"""Reference of the scenario file as Markdown: a table of the keys of each group, from the models themselves."""

import re
from collections.abc import Iterator
from typing import Any

from insonify.scenario.key_explanation import KeyExplanation
from insonify.scenario.schema import SCENARIO, explanations, plain_schema

INTRODUCTION = """# Keys of a scenario file

Every key of a scenario file, from the models that check it; made by `insonify schema -o docs/reference/scenario.md`.
`insonify new NAME` writes a file with comments to start from, `insonify schema` the same explanations for editors.

A number is in the unit of its row, or a text with a unit of its own: 0.2 or "20 cm", 1.57 or "90 deg", 100000 or
"100 kHz". Ranges are in the unit of the row; a range with "each" is that of every number of a list. A default is the
value without the key; of a group of keys, `{}` stands for their own defaults. Of several groups at one key `kind`,
`shape` or `law` selects one: kind and shape are needed there, a law may be left out.
"""
_TAGS = ("kind", "shape", "law")


def scenario_reference() -> str:
    """The reference page: every group of keys, in the order of the file.

    Example:
        >>> print(scenario_reference().splitlines()[0])
        # Keys of a scenario file
    """
    schema = plain_schema()
    parts = {SCENARIO: schema, **schema["$defs"]}
    explained = explanations(schema)
    holders = _holders(parts)
    sections = [INTRODUCTION]
    for name, keys in holders.items():
        title = (
            "The file" if name == SCENARIO else f"`{'`, `'.join(dict.fromkeys(keys))}`{_selection(name, keys, parts)}"
        )
        rows = [_row(key, parts[name], explained[name][key]) for key in parts[name]["properties"]]
        about = " ".join(parts[name].get("description", "").split("\n\n")[0].split())
        heading = f'<a id="{name}"></a>\n\n## {title}\n\n{about}\n'
        sections.append(
            "\n".join([heading, "| key | unit | range | default | description |", "|---|---|---|---|---|", *rows, ""])
        )
    return "\n".join(sections)


def _holders(parts: dict[str, Any]) -> dict[str, dict[str, tuple[str, ...]]]:
    """Keys that hold each model, with the alternatives there, in the order of the file."""
    holders: dict[str, dict[str, tuple[str, ...]]] = {SCENARIO: {}}

    def visit(name: str, path: str) -> None:
        for key, item in parts[name]["properties"].items():
            where = f"{path}.{key}" if path else key
            held = tuple(dict.fromkeys(_models(item)))
            for below in held:
                is_new = where not in holders.setdefault(below, {})
                holders[below][where] = held
                if is_new and key != "receiver_track":  # its groups are those of `track`
                    visit(below, where)

    visit(SCENARIO, "")
    return holders


def _models(item: Any) -> Iterator[str]:
    """Names of the models that a value or a list may hold, in order."""
    if isinstance(item, list):
        for part in item:
            yield from _models(part)
    elif isinstance(item, dict):
        if "$ref" in item:
            yield item["$ref"].rsplit("/", 1)[1]
        for key in ("anyOf", "oneOf", "items", "prefixItems"):
            yield from _models(item.get(key))


def _selection(name: str, keys: dict[str, tuple[str, ...]], parts: dict[str, Any]) -> str:
    """The key that selects a model among its alternatives, as the end of a heading; empty where there are none."""
    for held in keys.values():
        if len(held) > 1 and (tag := _tag(name, parts)):
            return f", `{tag}`"
    return ""


def _tag(name: str, parts: dict[str, Any]) -> str:
    """The key that distinguishes a model from its alternatives, with its value."""
    keys = parts[name]["properties"]
    for tag in _TAGS:
        if tag in keys and (words := keys[tag].get("enum", [keys[tag].get("const")])) != [None]:
            return f"{tag}: {', '.join(words)}"
    return ""


def _row(key: str, part: dict[str, Any], explanation: KeyExplanation) -> str:
    """Row of the table for one key."""
    item = part["properties"][key]
    meaning = re.sub(r" ?\[[^\]]+\]", "", explanation.meaning) if explanation.units else explanation.meaning
    links = [f"[{name}](#{name})" for name in dict.fromkeys(_models(item))]
    values = [*explanation.ranges, *(explanation.choices if "const" not in item else ()), *links]
    default = "needed" if key in part.get("required", ()) else f"`{explanation.default}`" if explanation.default else ""
    cells = (f"`{key}`", ", ".join(dict.fromkeys(explanation.units)), "; ".join(values), default, f"{meaning}.")
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
