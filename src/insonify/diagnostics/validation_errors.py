"""Errors of pydantic's validator as diagnostics on a scenario file or a call.

The validator reports types, once for each alternative of a union. Here each mistake becomes one
diagnostic: the value as it was written, the range in the unit that was written, and
the nearest permitted word.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from insonify.diagnostics.diagnostic import Diagnostic, nearest_word
from insonify.diagnostics.expected_type import ExpectedType, find
from insonify.diagnostics.yaml_source import Path, YamlSource, dotted
from insonify.units import UNITS, si
from insonify.value_range import value_range

_NUMBER_AND_UNIT = re.compile(r"^([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)$")
_RANGE = {"greater_than", "greater_than_equal", "less_than", "less_than_equal"}
_UNKNOWN = {"extra_forbidden", "unexpected_keyword_argument"}
_MISSING = {"missing", "missing_argument"}


@dataclass(frozen=True, slots=True)
class _Finding:
    """One error of the validator, and its position in the file."""

    kind: str
    path: Path
    expected: tuple[ExpectedType, ...]
    value: Any
    context: dict[str, Any]
    message: str

    @property
    def is_about_kind(self) -> bool:
        """True: the error only states that this alternative is of another kind of value."""
        return self.kind.endswith(("_type", "_parsing")) or self.kind == "int_from_float"


def validation_diagnostics(error: ValidationError, model: type[BaseModel], source: YamlSource) -> list[Diagnostic]:
    """One advice per mistake that the validator found in a file."""
    items = [single for item in error.errors(include_url=False) for single in _unfolded(item)]
    findings = [_finding(item, model, source) for item in items]
    reported = {(fault.field, fault.line) for fault in source.faults}
    advice = []
    for path in dict.fromkeys(finding.path for finding in findings):
        at_path = [finding for finding in findings if finding.path == path]
        is_reported_below = any(other.path[: len(path)] == path and other.path != path for other in findings)
        if is_reported_below and all(finding.is_about_kind for finding in at_path):
            continue
        if (dotted(path), source.line(path)) not in reported and not _is_misspelt_elsewhere(at_path, findings):
            advice += _one_line(at_path, findings, source)
    return advice


def yaml_boolean_errors(model: type[BaseModel], source: YamlSource) -> list[Diagnostic]:
    """Every yes, no, on or off that stands where a number or a word is expected, and every .nan and .inf.

    Python counts truths as 1 and 0, and some models hold text or laws of their own: the validator
    alone would let them pass.
    """
    advice = []
    for path in source.written:
        value = source.value(path)
        if not isinstance(value, bool) and not (isinstance(value, float) and not math.isfinite(value)):
            continue
        _, expected = find(model, source.values, path)
        _, about = find(model, source.values, path[:-1])
        if isinstance(path[-1], str) and all(path[-1] not in group.keys for group in about):
            continue  # an unknown key: that is reported instead
        if isinstance(value, float):
            problem = f"{source.written[path]} is not a finite number"
            advice.append(_advice(path, source, problem, _allowed(expected)))
        elif expected and all(choice.kind is not bool for choice in expected):
            kinds = _either_of(expected)
            problem = f"{source.written[path]} means {str(value).lower()} in YAML; it should be {kinds}"
            fix = "Put quotes around it" if any(choice.kind is str for choice in expected) else ""
            advice.append(_advice(path, source, problem, fix=fix))
    return advice


def _unfolded(item: Any) -> list[Any]:
    """A complaint that holds several field_error faults, as one complaint for each of them."""
    if item["type"] != "field_error":
        return [item]
    return [item | {"ctx": {"path": path, "shown": shown}} for path, shown in item["ctx"]["errors"]]


def _finding(item: Any, model: type[BaseModel], source: YamlSource) -> _Finding:
    context = dict(item.get("ctx", {}))
    loc = tuple(item["loc"])
    if item["type"] == "field_error":
        steps = [int(step) if step.isdecimal() else step for step in str(context["path"]).split(".") if step]
        loc = (*loc, *steps)
    path, expected = find(model, source.values, loc)
    return _Finding(item["type"], path, tuple(expected), item["input"], context, item["msg"])


def _is_misspelt_elsewhere(at_path: list[_Finding], findings: list[_Finding]) -> bool:
    """A missing key that stands in the file under a misspelt name is one mistake, not two."""
    if at_path[0].kind not in _MISSING:
        return False
    *parent, name = at_path[0].path
    strangers = [f.path[-1] for f in findings if f.kind in _UNKNOWN and list(f.path[:-1]) == parent]
    return any(nearest_word(str(stranger), [str(name)]) for stranger in strangers)


def _one_line(at_path: list[_Finding], findings: list[_Finding], source: YamlSource) -> list[Diagnostic]:
    field_error = [finding for finding in at_path if finding.kind == "field_error"]
    if field_error:  # each is a mistake of its own
        return [_advice(finding.path, source, str(finding.context["shown"])) for finding in field_error]
    specific = [finding for finding in at_path if not finding.is_about_kind]
    if not specific:
        return [_type_error_message(at_path, source)]
    first = min(specific, key=lambda finding: finding.kind == "value_error")
    return [_diagnostic(first, source)]


def _advice(path: Path, source: YamlSource, problem: str, allowed: str = "", fix: str = "") -> Diagnostic:
    return Diagnostic(source.name, source.line(path), dotted(path), problem, allowed, fix, _label(path, source))


def _label(path: Path, source: YamlSource) -> str:
    """The label that the author gave to the thing that a value belongs to; empty where there is none, and in a call."""
    if source.is_call:
        return ""
    for end in range(len(path), 0, -1):
        label = source.written.get((*path[:end], "label"), "")
        if label and path[end:] != ("label",):
            return label
    return ""


def _diagnostic(finding: _Finding, source: YamlSource) -> Diagnostic:
    kind, path = finding.kind, finding.path
    typed = source.show(path, finding.value)
    if kind in _MISSING:
        return _missing(finding, source)
    if kind in _UNKNOWN:
        return _unknown_key(finding, source)
    if kind in _RANGE or (kind == "int_parsing_size" and any(expected.limits for expected in finding.expected)):
        return _out_of_range(finding, source)
    if kind in ("literal_error", "enum", "union_tag_invalid", "union_tag_not_found"):
        return _unknown_choice(finding, source)
    if kind == "finite_number":
        return _advice(path, source, f"{typed} is not a finite number", _allowed(finding.expected))
    if kind in ("too_short", "too_long"):
        fix = next((expected.fix for expected in finding.expected if expected.fix), "") if kind == "too_long" else ""
        return _advice(path, source, f"{typed} has {len(finding.value)} values", _kinds([finding]), fix)
    if kind == "value_error":
        return _refused(finding, source)
    return _advice(path, source, f"{typed}: {finding.message}")


def _missing(finding: _Finding, source: YamlSource) -> Diagnostic:
    *parent, name = finding.path
    if isinstance(name, int):
        return _advice(tuple(parent), source, f"value {name + 1} is missing", fix=f"Write {_kinds([finding])} there")
    return _advice(finding.path, source, f"missing; it should be {_kinds([finding])}", fix=source.advice_to_add(name))


def _unknown_key(finding: _Finding, source: YamlSource) -> Diagnostic:
    name = finding.path[-1]
    known = list(dict.fromkeys(key for expected in finding.expected for key in expected.keys))
    meant = nearest_word(str(name), known)
    if meant:
        return _advice(finding.path, source, f"unknown key '{name}'; did you mean '{meant}'?")
    return _advice(finding.path, source, f"unknown key '{name}'", f"known here: {', '.join(known)}" if known else "")


def _unknown_choice(finding: _Finding, source: YamlSource) -> Diagnostic:
    expected = finding.context.get("expected", finding.context.get("expected_tags", ""))
    choices = re.findall(r"'([^']*)'", str(expected))
    path, typed = finding.path, source.show(finding.path, finding.value)
    if "discriminator" in finding.context:
        key = finding.context["discriminator"].strip("'")
        path, typed = (*path, key), str(finding.context.get("tag", ""))
        choices = choices or sorted({tag for expected in finding.expected for tag in expected.tags(key)})
        if finding.kind == "union_tag_not_found":
            fix = source.advice_to_add(key)
            return _advice(path, source, "missing; it should be one of " + ", ".join(choices), fix=fix)
    meant = nearest_word(typed, choices)
    fix = f"Did you mean '{meant}'?" if meant else ""
    return _advice(path, source, f"'{typed}' is not known here", f"one of {', '.join(choices)}", fix)


def _refused(finding: _Finding, source: YamlSource) -> Diagnostic:
    """Message of a field's or a model's own check, or a better sentence where it was about a unit."""
    typed = source.show(finding.path, finding.value)
    quantity = next((expected for expected in finding.expected if expected.dimension), None)
    if quantity is not None and isinstance(finding.value, str) and not _si(typed, quantity):
        units = list(UNITS[quantity.dimension])
        unit = re.sub(r"^[-+.\deE\s]*", "", typed)
        meant = next((name for name in units if name.lower() == unit.lower()), None)
        fix = f"Did you mean {meant}?" if meant else ""
        problem = f"{typed} is not {quantity.description().split(' in ')[0]}; use {', '.join(units)}"
        return _advice(finding.path, source, problem, fix=fix)
    message = str(finding.context.get("error", finding.message))
    is_plain = finding.path in source.written
    return _advice(finding.path, source, message if not is_plain or typed in message else f"{typed}: {message}")


def _type_error_message(at_path: list[_Finding], source: YamlSource) -> Diagnostic:
    first = at_path[0]
    typed = source.show(first.path, first.value)
    if first.value is None:
        return _advice(first.path, source, f"has no value; it should be {_kinds(at_path)}")
    if isinstance(first.value, int | float) and all(expected.kind is str for expected in first.expected):
        return _advice(first.path, source, f"{typed} is read as a number", fix=f'Write "{typed}", with quotes')
    where = "" if first.path else "the file holds "
    return _advice(first.path, source, f"{where}{typed} where {_kinds(at_path)} should be")


def _kinds(findings: list[_Finding]) -> str:
    expected = [choice for finding in findings for choice in finding.expected if choice.kind is not type(None)]
    return _either_of(expected) or "something else"


def _either_of(expected: Sequence[ExpectedType]) -> str:
    """Kinds of value in words; groups that one key distinguishes by that key alone: all keys are a paragraph."""
    groups = [choice for choice in expected if choice.keys]
    tag = next((key for key in groups[0].keys if all(one.tags(key) for one in groups)), "") if len(groups) > 1 else ""
    if not tag:
        return " or ".join(dict.fromkeys(choice.description() for choice in expected))
    known = ", ".join(dict.fromkeys(word for one in groups for word in sorted(one.tags(tag))))
    others = [choice.description() for choice in expected if not choice.keys]
    return " or ".join(dict.fromkeys([f"a group of keys ({tag}: one of {known}; and what belongs to it)", *others]))


def _si(typed: str, expected: ExpectedType) -> float | None:
    """The SI number behind what was typed, or None."""
    try:
        value = si(typed, expected.dimension)
    except ValueError:
        return None
    return value if isinstance(value, float) else None


def _out_of_range(finding: _Finding, source: YamlSource) -> Diagnostic:
    expected = next((choice for choice in finding.expected if choice.limits), ExpectedType(float))
    typed = source.show(finding.path, finding.value).strip()
    match = _NUMBER_AND_UNIT.match(typed)
    if match is None:
        return _advice(finding.path, source, f"{typed} is out of range", value_range(expected.limits, expected.units))
    number, unit = match.groups()
    shown = f"{number} {unit or expected.units}".strip()
    size = UNITS.get(expected.dimension, {}).get(unit or expected.units, 1.0)
    limits = {name: bound / size for name, bound in expected.limits.items()}
    fix = _better(float(number), unit, limits, expected, finding.path)
    return _advice(finding.path, source, f"{shown} is out of range", value_range(limits, unit or expected.units), fix)


def _allowed(expected: Sequence[ExpectedType]) -> str:
    """The range of a number in its SI unit; empty where none is known."""
    return next((value_range(choice.limits, choice.units) for choice in expected if choice.limits), "")


def _fits(value: float, limits: dict[str, float]) -> bool:
    above = value >= limits.get("ge", value) and value > limits.get("gt", value - 1)
    return above and value <= limits.get("le", value) and value < limits.get("lt", value + 1)


def _better(number: float, unit: str, limits: dict[str, float], expected: ExpectedType, path: Path) -> str:
    """Probable intention: the other sign, or the same number with a unit."""
    only_sign = limits.get("ge", limits.get("gt", -1)) >= 0 or limits.get("le", limits.get("lt", 1)) <= 0
    if only_sign and _fits(-number, limits):
        why = "Depths are positive downwards; write" if "depth" in str(path[-1:]) else "Did you mean"
        return f"{why} {-number:g} {unit or expected.units}".strip() + ("" if why.endswith("write") else "?")
    for guess, size in UNITS.get(expected.dimension, {}).items():
        # the km of 0.001 km is never left out
        is_handy = abs(number) >= (1.0 if size > 1 else 0.1)
        if not unit and is_handy and _fits(number * size, limits):
            return f"Did you mean {number:g} {guess}?"
    return ""
