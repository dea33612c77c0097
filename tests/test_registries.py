"""Claims about what others add in one file: each such file is registered, and each registration has its file."""

import inspect
import re
from importlib import import_module
from pathlib import Path

import pytest

from insonify.comparison.measure import Measure
from insonify.comparison.registry import MEASURES, measures
from insonify.formats.instruments.instrument_file import InstrumentFile
from insonify.formats.instruments.open_instrument import READERS
from insonify.studies import open_questions, real_recordings

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "insonify"


def classes_in(folder, protocol):
    """`module.Class` of every class below a folder of the package that states that it is of a protocol."""
    for path in sorted((SOURCE / folder).glob("*.py")):
        module = import_module(f"insonify.{folder.replace('/', '.')}.{path.stem}")
        for name, kind in inspect.getmembers(module, inspect.isclass):
            if kind.__module__ == module.__name__ and issubclass(kind, protocol) and not inspect.isabstract(kind):
                yield f"{path.stem}.{name}"


def test_every_instrument_file_is_registered_once():
    """A subclass of `InstrumentFile` in a file of its own and one line in `READERS` make a format."""
    assert sorted(READERS) == sorted(classes_in("formats/instruments", InstrumentFile))


def test_every_measure_is_registered_once():
    """A subclass of `Measure` in a file of its own and one line in `MEASURES` make a measure of a comparison."""
    assert sorted(MEASURES) == sorted(classes_in("comparison", Measure)) and len(measures()) == len(MEASURES)


def test_every_study_is_a_section_of_a_page():
    """A file with `evaluate` and `section` is run by one of the two pages."""
    pages = inspect.getsource(open_questions) + inspect.getsource(real_recordings)
    studies = [
        path.stem for path in (SOURCE / "studies").glob("*.py") if re.search(r"^def section\(", path.read_text(), re.M)
    ]
    assert len(studies) >= 5
    for study in studies:
        assert f"{study}.section(" in pages and f"{study}.evaluate(" in pages, study


def table_rows():
    """Rows of the table of CONTRIBUTING.md: the thing, and every path that its row names."""
    for line in (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if line.startswith("| ") and len(cells) == 3 and "new ..." not in line:
            yield cells[0], [path for path in re.findall(r"`([\w./<>-]+)`", line) if "/" in path or ".py" in path]


@pytest.mark.parametrize(
    ("thing", "paths"), list(table_rows()), ids=lambda value: value if isinstance(value, str) else ""
)
def test_the_table_of_new_things_names_files_that_are_there(thing, paths):
    """Each path of a row exists, from the root of the project or from the package; `<name>` stands for any file."""
    assert paths, thing
    for path in paths:
        pattern = re.sub(r"<[^>]*>", "*", path)
        found = any(list(folder.glob(pattern)) for folder in (ROOT, SOURCE, SOURCE.parent))
        assert found or list(SOURCE.glob(f"**/{pattern}")), (thing, path)
