"""Claims: the examples in docstrings give what they show, and every public class and function has one."""

import doctest
import inspect
import shutil
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import insonify
from datasets.small_dataset import write_small

SOURCE = Path(__file__).parents[1] / "src"
WITH_EXAMPLES = [
    ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")
    for path in sorted(SOURCE.rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]
PACKAGES = (
    "insonify", "insonify.cli", "insonify.comparison", "insonify.engines", "insonify.engines.fast_reverberation",
    "insonify.engines.terrain_occlusion", "insonify.engines.tracer", "insonify.formats.instruments", "insonify.ocean",
    "insonify.plotting", "insonify.processing", "insonify.propagation", "insonify.propagation.surface_reflection",
    "insonify.real_time", "insonify.records", "insonify.scattering", "insonify.scene", "insonify.scene.terrain",
    "insonify.sonar", "insonify.sonar.track",
)  # fmt: skip
"""Packages in whose `__all__` every class and function has an example."""


def public_items(package):
    """Classes and functions of a package's `__all__` by name."""
    module = import_module(package)
    items = {name: inspect.unwrap(getattr(module, name)) for name in module.__all__}
    return {name: item for name, item in items.items() if inspect.isclass(item) or inspect.isroutine(item)}


def names_of_examples():
    """Names that the example of each public item may use without import: those of its package, insonify and np."""
    names = {}
    for package in PACKAGES:
        module = import_module(package)
        used = {} if package == "insonify" else {name: getattr(module, name) for name in module.__all__}
        for item in public_items(package).values():
            names.setdefault(f"{item.__module__}.{item.__qualname__}", {"insonify": insonify, "np": np}).update(used)
    return names


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_of_docstrings_hold(name, tmp_path, monkeypatch):
    """Every example of a module, run in a folder with a scenario of `insonify new` and the file of a data set."""
    shutil.copy(SOURCE / "insonify/scenario/templates/sidescan.yaml", tmp_path)
    write_small(tmp_path)
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    names = names_of_examples()
    for example in doctest.DocTestFinder(exclude_empty=True).find(import_module(name)):
        example.globs = dict(names.get(example.name, example.globs))
        runner.run(example)
    assert runner.tries and not runner.failures


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_class_and_function_has_an_example(package):
    """Engineers see at least one use, with its result, of all that a package exports."""
    assert not [name for name, item in public_items(package).items() if ">>> " not in (item.__doc__ or "")]
