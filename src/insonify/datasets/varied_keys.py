"""Keys of a scenario that a data set varies: from `targets[mine].heading` to the paths of `Scenario.with_`."""

import re
from dataclasses import dataclass
from typing import Any

from insonify.diagnostics.diagnostic import nearest_word
from insonify.scenario.scenario import Scenario

_STEP = re.compile(r"([^.\[\]]+)|\[([^\[\]]*)\]|(\.)")


class UnknownItemError(ValueError):
    """A key that leads nowhere, with the nearest one."""


@dataclass(frozen=True, slots=True)
class VariedKey:
    """One value that varies."""

    key: str
    """Key as it was typed, with the index of each of several items that it means."""
    path: str
    """Path of the value: keys and list indices joined by dots."""


def varied_keys(scenario: Scenario, key: str) -> list[VariedKey]:
    """Values that a key means; several where `[*]` means all items of a list.

    Args:
        scenario: The scenario.
        key: Such as `surface.wind_speed`, `targets[mine].heading`, `targets[*].burial`, `seabed.relief[0].rms`.

    Raises:
        UnknownItemError: There is no such item.
    """
    steps = _steps(key)
    branches: list[tuple[str, list[str], Any]] = [("", [], scenario)]
    for step, in_brackets in steps:
        following = []
        for name, path, value in branches:
            if not in_brackets:
                inner = getattr(value, step, None) if not isinstance(value, tuple) else _item(value, step)
                following.append((f"{name}.{step}".lstrip("."), [*path, step], inner))
                continue
            for row in _rows(key, step, value):
                following.append((f"{name}[{row if step == '*' else step}]", [*path, str(row)], value[row]))
        branches = following
    return [VariedKey(name, ".".join(path)) for name, path, _ in branches]


def _steps(key: str) -> list[tuple[str, bool]]:
    """Steps of a key, and whether each stands in brackets."""
    matches = list(_STEP.finditer(key))
    if not matches or "".join(match.group() for match in matches) != key:
        raise UnknownItemError(f"{key!r} is no key; write it as in surface.wind_speed or targets[mine].heading")
    return [(match[1] or match[2], match[1] is None) for match in matches if not match[3]]


def _is_number(step: str) -> bool:
    """True of digits of ASCII, few enough of any list: there are other digits, such as a raised two."""
    return step.isascii() and step.isdigit() and len(step) < 10


def _item(values: tuple[Any, ...], step: str) -> Any:
    return values[int(step)] if _is_number(step) and int(step) < len(values) else None


def _rows(key: str, step: str, values: Any) -> list[int]:
    """Rows of a list that a step in brackets means: all, a number, or those of a label."""
    if not isinstance(values, tuple):
        raise UnknownItemError(f"{key}: [{step}] selects from a list, and there is none")
    if step == "*" and not values:
        raise UnknownItemError(f"{key}: the list is empty. Add an item to the scenario, or leave the key out")
    if step == "*":
        return list(range(len(values)))
    if _is_number(step):
        if int(step) >= len(values):
            raise UnknownItemError(f"{key}: there are {len(values)} items, counted from 0")
        return [int(step)]
    labels = [str(getattr(value, "label", "")) for value in values]
    rows = [row for row, label in enumerate(labels) if label == step]
    if not rows:
        near = nearest_word(step, labels)
        known = ", ".join(dict.fromkeys(filter(None, labels))) or "none"
        raise UnknownItemError(f"{key}: no item has the label {step!r}" + (f"; did you mean {near!r}?" if near else
                        f"; labels are {known}"))  # fmt: skip
    return rows
