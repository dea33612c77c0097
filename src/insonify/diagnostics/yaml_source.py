"""A scenario file as it was written: values with their lines.

A plain YAML reader keeps no line numbers, takes the last of two equal keys without an error, and reads
`1e3` as text and `1:30` as ninety. Here the syntax tree is read instead of the values:
numbers are decimal, everything else that is not a number is text, and ambiguous
values are reported.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import yaml

from insonify.diagnostics.diagnostic import Diagnostic

Path = tuple[str | int, ...]
"""The path from the top of a file to one value: keys and list indices."""

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_WORDS: dict[str, object] = {"null": None, "~": None, "": None, ".nan": math.nan}
_WORDS |= {sign + ".inf": float(sign + "inf") for sign in ("", "+", "-")}
_WORDS |= {word: truth for truth, words in ((True, "true yes on"), (False, "false no off")) for word in words.split()}


@dataclass(slots=True)
class YamlSource:
    """One file, read: plain values, and where and how each of them was written."""

    name: str
    """The file's name, as messages print it."""
    values: Any = None
    """Dictionaries, lists, text, numbers; None where the file could not be read."""
    lines: dict[Path, int] = field(default_factory=dict)
    """Line of each value (of its key, inside a mapping), counted from 1."""
    written: dict[Path, str] = field(default_factory=dict)
    """The text of each plain value, as it was typed."""
    faults: list[Diagnostic] = field(default_factory=list)
    """Errors of the YAML text itself, before any value has a meaning."""
    is_call: bool = False
    """True for the arguments of a call in Python, which has no lines."""

    def line(self, path: Path) -> int:
        """Line of a value, or of the nearest thing around it that the file does contain."""
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 1)

    def advice_to_add(self, name: str) -> str:
        """Advice on a key that is missing."""
        return f"Give {name}=..." if self.is_call else f"Add a line '{name}: ...'"

    def value(self, path: Path) -> Any:
        """The value that stands at a path."""
        value = self.values
        for step in path:
            value = value[step]
        return value

    def show(self, path: Path, value: object) -> str:
        """A value as it was typed; lists and mappings in one short line."""
        if path in self.written:
            return self.written[path] or "''"
        try:
            text = yaml.safe_dump(value, default_flow_style=True, width=10_000).split("\n")[0]
        except yaml.YAMLError:  # an object of Python
            text = " ".join(repr(value).split())
        return text if len(text) <= 60 else text[:57] + "..."


class _Loader(yaml.SafeLoader):
    """Stops at an alias: a value that stands elsewhere has no line of its own."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.composer.ComposerError(None, None, "found an alias (*name); write the value out", mark)
        return super().compose_node(parent, index)


def read(text: str, name: str) -> YamlSource:
    """The values of a YAML text with their lines; faults of writing are listed, not raised.

    Args:
        text: The whole file.
        name: Name of it in messages, such as "harbour.yaml".
    """
    source = YamlSource(name)
    try:
        node = yaml.compose(text, _Loader)
        source.values = None if node is None else _value(node, (), source)
    except yaml.MarkedYAMLError as error:
        source.faults.append(_syntax(error, name))
    except yaml.YAMLError as error:  # a character that no YAML file may hold
        source.faults.append(
            Diagnostic(name, 1, "", f"not YAML: {str(error).splitlines()[0]}", fix="Save it as UTF-8 text")
        )
    except RecursionError:
        source.faults.append(Diagnostic(name, 1, "", "not a scenario: it is nested too deeply"))
    else:
        if source.values is None:
            fix = "Start from a template: insonify new NAME"
            source.faults.append(Diagnostic(name, 1, "", "the file is empty", fix=fix))
    return source


def _syntax(error: yaml.MarkedYAMLError, name: str) -> Diagnostic:
    mark = error.problem_mark or error.context_mark
    line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
    problem = error.problem or error.context or "unreadable"
    fix = "Indent with spaces, not tabs" if "'\\t'" in problem else ""
    return Diagnostic(name, line, "", f"not YAML at column {column}: {problem}", fix=fix)


def _value(node: yaml.Node, path: Path, source: YamlSource) -> Any:
    source.lines.setdefault(path, node.start_mark.line + 1)
    if isinstance(node, yaml.MappingNode):
        return dict(_entries(node, path, source))
    if isinstance(node, yaml.SequenceNode):
        return [_value(item, (*path, index), source) for index, item in enumerate(node.value)]
    assert isinstance(node, yaml.ScalarNode)  # the only kind that is left
    source.written[path] = node.value
    if node.tag.startswith("!"):
        fault = Diagnostic(source.name, source.line(path), dotted(path), f"the tag {node.tag} has no meaning here")
        source.faults.append(fault)
    return _scalar(node)


def _entries(node: yaml.MappingNode, path: Path, source: YamlSource) -> Iterator[tuple[str, Any]]:
    first: dict[str, int] = {}
    for key_node, value_node in node.value:
        line = key_node.start_mark.line + 1
        if not isinstance(key_node, yaml.ScalarNode):
            source.faults.append(Diagnostic(source.name, line, dotted(path), "a key must be one word"))
            continue
        key = str(key_node.value)
        if key in first:
            problem = f"key {key!r} is here twice (first on line {first[key]})"
            source.faults.append(Diagnostic(source.name, line, dotted((*path, key)), problem, fix="Delete one of them"))
            continue
        first[key] = line
        source.lines[(*path, key)] = line
        yield key, _value(value_node, (*path, key), source)


def _scalar(node: yaml.ScalarNode) -> object:
    """Text, unless it was typed bare and is a decimal number or one of YAML's few words."""
    text = str(node.value)
    return text if node.style in ("'", '"', "|", ">") else plain_value(text)


def plain_value(text: str) -> object:
    """Meaning of a bare word of a scenario file: a number, one of YAML's few words, or itself."""
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    if not _NUMBER.fullmatch(text):
        return text
    is_whole = text.lstrip("+-").isdecimal() and len(text) < 300
    return int(text) if is_whole else float(text)


def dotted(path: Path) -> str:
    """A path as a person writes it: targets.0.position."""
    return ".".join(str(step) for step in path)
