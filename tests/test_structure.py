"""Claims about the structure of the package: private modules stay in their package, names are importable."""

import ast
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src"
FILES = {
    ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted((SOURCE / "insonify").rglob("*.py"))
}


@cache
def imported_modules(path):
    """Dotted names that a file imports, those for type checking included."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def package_of(name):
    """The package that a module belongs to; a package belongs to itself."""
    return name if FILES[name].name == "__init__.py" else name.rsplit(".", 1)[0]


def test_private_modules_are_imported_within_their_package_only():
    """A module with a leading underscore belongs to its folder and to the folders below."""
    private = {name for name in FILES if any(part.startswith("_") for part in name.split(".")) and "__" not in name}
    assert len(private) > 50
    trespasses = [
        (name, target)
        for name, path in FILES.items()
        for target in imported_modules(path) & private
        if not f"{package_of(name)}.".startswith(f"{target.rsplit('.', 1)[0]}.")
    ]
    assert trespasses == []


def test_no_module_is_imported_by_a_text_that_the_contract_does_not_see():
    """Names that packages load on demand are their own; a module of another package has an import statement."""
    hidden = [
        (name, ast.unparse(node))
        for name, path in FILES.items()
        if "import_module" in (text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module")
        if isinstance(node.args[0], ast.Constant) and str(node.args[0].value).startswith("insonify.")
        if not str(node.args[0].value).startswith(f"{package_of(name)}.")
    ]
    assert hidden == []


def import_graph():
    """For each module the modules of the package that it imports, those for type checking included."""
    return {name: {t for t in imported_modules(path) if t in FILES and t != name} for name, path in FILES.items()}


def circles(graph):
    """Sets of modules that import one another, directly or by way of others."""
    order, low, stack, found = {}, {}, [], []

    def visit(node):
        order[node] = low[node] = len(order)
        stack.append(node)
        for below in sorted(graph[node]):
            if below not in order:
                visit(below)
                low[node] = min(low[node], low[below])
            elif below in stack:
                low[node] = min(low[node], order[below])
        if low[node] == order[node]:
            at = stack.index(node)
            group = stack[at:]
            del stack[at:]
            if len(group) > 1:
                found.append(sorted(group))

    for node in sorted(graph):
        if node not in order:
            visit(node)
    return found


@pytest.mark.parametrize(
    ("graph", "expected"),
    [
        ({"a": {"b"}, "b": {"c"}, "c": set()}, []),
        ({"a": {"b"}, "b": {"a"}}, [["a", "b"]]),
        ({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}, [["a", "b", "c"]]),
        ({"a": {"b"}, "b": {"a"}, "c": {"d"}, "d": {"c"}}, [["a", "b"], ["c", "d"]]),
    ],
)
def test_circles_are_found(graph, expected):
    """Of two, of three, several; a chain has none."""
    assert circles(graph) == expected


def test_no_modules_import_one_another():
    """Not for type checking alone, either; packages that load their names on demand apart."""
    graph = import_graph()
    eager = {name: {t for t in below if FILES[t].name != "__init__.py"} for name, below in graph.items()}
    assert circles(eager) == []


PUBLIC = ("ocean", "scattering", "scene", "sonar", "records", "propagation", "processing", "formats", "plotting")


@pytest.mark.parametrize("name", PUBLIC)
def test_public_names_of_packages_exist(name):
    """Every name in `__all__` can be imported, and has a docstring or is plain data."""
    package = import_module(f"insonify.{name}")
    for public in getattr(package, "__all__", ()):
        value = getattr(package, public)
        assert value is not None
        assert not callable(value) or value.__doc__
