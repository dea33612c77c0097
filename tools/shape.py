"""The size of the code: lengths of files and functions, numbers of parameters, missing docstrings.

The limits below are the project's own; this script prints the figures of the tree and, if one
is exceeded, where.
"""

import ast
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

FILE_BARS = (180, 400, 600)
"""Lines of a source file: median, 90th percentile, longest."""
FUNCTION_BARS = (12, 45, 100)
"""Lines of a function without its docstring: median, 90th percentile, longest."""
PARAMETERS = 8
"""Parameters of a function, self and cls left out."""
WIDE_FUNCTIONS = 44
"""Largest number of functions with more parameters; to be lowered as they become fewer."""
TEST_SHARE = 0.72
"""Least number of test lines per source line."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True, slots=True)
class Measured:
    """A file or function, its location and its length."""

    where: str
    lines: int


@dataclass(frozen=True, slots=True)
class Shape:
    """Lengths of a tree, and the locations of missing explanations."""

    files: list[Measured]
    functions: list[Measured]
    wide: list[str]
    undocumented: list[str]
    test_lines: int

    @property
    def source_lines(self) -> int:
        """All lines of all source files."""
        return sum(file.lines for file in self.files)


def measure(root: Path) -> Shape:
    """The shape of the project in the directory `root` (its `src` and `tests`)."""
    files: list[Measured] = []
    functions: list[Measured] = []
    undocumented: list[str] = []
    wide: list[str] = []
    for path in sorted((root / "src").rglob("*.py")):
        text, name = path.read_text(encoding="utf-8"), path.relative_to(root).as_posix()
        tree = ast.parse(text, name)
        if text.strip():
            files.append(Measured(name, len(text.splitlines())))
        functions += [Measured(f"{name}:{f.lineno} {f.name}", _code_lines(f)) for f in _functions(tree)]
        wide += [f"{name}:{f.lineno} {f.name} ({n})" for f in _functions(tree) if (n := _parameters(f)) > PARAMETERS]
        undocumented += [f"{name}:{line}" for line in _undocumented(tree)]
    # A folder without __init__.py is invisible to the import contract.
    folders = sorted({path.parent for path in (root / "src").glob("*/**/*.py")})
    undocumented += [f"{f.relative_to(root)} has no __init__.py" for f in folders if not (f / "__init__.py").exists()]
    tests = 0
    for path in sorted((root / "tests").rglob("*.py")):
        text, name = path.read_text(encoding="utf-8"), path.relative_to(root).as_posix()
        tests += len(text.splitlines())
        idle = [f for f in _functions(ast.parse(text, name)) if f.name.startswith("test_") and not _asserts(f)]
        undocumented += [f"{name}:{f.lineno} {f.name} asserts nothing" for f in idle]
    return Shape(files, functions, wide, undocumented, tests)


def broken(shape: Shape) -> list[str]:
    """Every limit that the tree exceeds, one line each; empty if none."""
    lines = _too_long("file", shape.files, FILE_BARS)
    lines += _too_long("function", shape.functions, FUNCTION_BARS)
    lines += shape.undocumented
    if len(shape.wide) > WIDE_FUNCTIONS:
        found = ", ".join(shape.wide)
        lines.append(f"{len(shape.wide)} functions pass {PARAMETERS} parameters; at most {WIDE_FUNCTIONS} may: {found}")
    if shape.test_lines < TEST_SHARE * shape.source_lines:
        share = shape.test_lines / shape.source_lines
        lines.append(f"tests have {share:.2f} lines per source line; at least {TEST_SHARE} are required")
    return lines


def summary(shape: Shape) -> str:
    """The tree in one line."""
    share = shape.test_lines / max(shape.source_lines, 1)
    return (
        f"shape: {len(shape.files)} files {_spread(shape.files)}, {len(shape.functions)} functions "
        f"{_spread(shape.functions)} lines (median/90%/max), {len(shape.wide)} wide; "
        f"{len(shape.undocumented)} undocumented; tests/source {share:.2f}"
    )


def _functions(tree: ast.AST) -> Iterator[Function]:
    return (node for node in ast.walk(tree) if isinstance(node, Function))


def _asserts(test: Function) -> bool:
    """True: a test contains an assertion, or a call of a function whose name states that it asserts."""
    called = [ast.unparse(node.func) for node in ast.walk(test) if isinstance(node, ast.Call)]
    names = {name.rpartition(".")[2] for name in called}
    found = any(isinstance(node, ast.Assert) for node in ast.walk(test))
    return found or bool(names & {"raises", "warns", "fail"}) or any(name.startswith("assert_") for name in names)


def _parameters(function: Function) -> int:
    given = function.args
    names = [argument.arg for argument in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return len(names) - (names[:1] in (["self"], ["cls"]))


def _code_lines(function: Function) -> int:
    # The docstring is not counted: it belongs to the manual.
    docstring = function.body[0] if ast.get_docstring(function) is not None else None
    explained = docstring.end_lineno - docstring.lineno + 1 if docstring and docstring.end_lineno else 0
    return (function.end_lineno or function.lineno) - function.lineno + 1 - explained


def _undocumented(tree: ast.Module) -> Iterator[str]:
    """Line and complaint for each public name or kernel that lacks its docstring or its return type."""
    if tree.body and ast.get_docstring(tree) is None:
        yield "1 module has no docstring"
    for node, public in _definitions(tree.body, public=True):
        kernel = any("njit" in ast.unparse(decorator) for decorator in node.decorator_list)
        if (public or kernel) and ast.get_docstring(node) is None:
            yield f"{node.lineno} {node.name} has no docstring"
        if public and isinstance(node, Function) and node.returns is None:
            yield f"{node.lineno} {node.name} has no return type"


def _definitions(body: list[ast.stmt], *, public: bool) -> Iterator[tuple[Function | ast.ClassDef, bool]]:
    """Functions, classes and methods, each with whether a reader from outside can reach it."""
    for node in body:
        if isinstance(node, Function):
            yield node, public and not node.name.startswith("_")
        elif isinstance(node, ast.ClassDef):
            is_public = public and not node.name.startswith("_")
            yield node, is_public
            yield from _definitions(node.body, public=is_public)


def _too_long(what: str, things: list[Measured], bars: tuple[int, int, int]) -> list[str]:
    if not things:
        return []
    middle, most, all_of_them = bars
    by_length = sorted(things, key=lambda thing: -thing.lines)
    lines = [
        f"{t.where} is {t.lines} lines; no {what} may pass {all_of_them}" for t in by_length if t.lines > all_of_them
    ]
    if _percentile90(things) > most:
        above = ", ".join(f"{thing.where} ({thing.lines})" for thing in by_length if thing.lines > most)
        lines.append(f"more than 10 % of {what}s pass {most} lines: {above}")
    if median(thing.lines for thing in things) > middle:
        lines.append(f"the median {what} passes {middle} lines")
    return lines


def _percentile90(things: list[Measured]) -> int:
    lengths = sorted(thing.lines for thing in things)
    return lengths[math.ceil(0.9 * len(lengths)) - 1]


def _spread(things: list[Measured]) -> str:
    if not things:
        return "0/0/0"
    lengths = [thing.lines for thing in things]
    return f"{median(lengths):g}/{_percentile90(things)}/{max(lengths)}"


def main() -> int:
    """Print the shape of this project; 1 if a bar is broken."""
    shape = measure(Path(__file__).resolve().parent.parent)
    complaints = broken(shape)
    print(summary(shape))
    for complaint in complaints:
        print(f"  {complaint}")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
