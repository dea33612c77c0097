"""Claims about the words of the code: a class name that is used twice, a question and a replaced word are noticed."""

import ast
import importlib.util
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[1] / "tools" / "words.py"


@pytest.fixture
def words():
    """The tool as a module."""
    if not TOOL.is_file():
        pytest.skip("no tools here: an installation, not a checkout")
    spec = importlib.util.spec_from_file_location("words", TOOL)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_class_name_in_two_files_is_noticed(words):
    """Both places are given; a name of one place is not."""
    trees = {"a.py": ast.parse("class Beam: ...\nclass Pulse: ..."), "b.py": ast.parse("x = 1\nclass Beam: ...")}
    assert words.repeated_classes(trees) == ["a.py:1, b.py:2: class Beam"]


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ('def f():\n    """Which rows."""', 1), ('def f():\n    """Rows of a table."""', 0),
        ('class A:\n    x: int\n    """How many."""', 1), ('"""Whether it is."""', 1),
        ('x = 1\n"""Whatever else."""', 0),
        ('def f():\n    return "Which one?"', 0),
    ],
)  # fmt: skip
def test_docstrings_that_open_with_a_question_are_noticed(words, text, count):
    """Of modules, classes, functions and attributes; not of other strings, nor of longer words."""
    assert len(words.questions({"a.py": ast.parse(text)})) == count


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("told = 1", 1),
        ("x = is_heard(told_rows)", 2),
        ("# the meter is metres long", 0),
        ("answered", 1),
        ("Retold", 0),
        ("class HeardPulse: TOLD = 1", 2),
        ("the Place of one_way", 0),
    ],
)
def test_replaced_words_are_noticed_in_names_and_text(words, text, count):
    """In any case, between underscores and humps as well; parts of longer words are not."""
    assert len(words.replaced_words({"tests/a.py": text})) == count


def test_a_place_is_a_position_in_names_of_the_package_alone(words):
    """Prose and tests may have places; a two-way delay is the field's term."""
    text = "two_way, in_place = place, Place  # in its place"
    assert [len(words.replaced_words({name: text})) for name in ("src/a.py", "tests/a.py")] == [2, 0]


def test_a_count_above_its_bar_fails_and_one_below_requests_a_lower_bar(words, tmp_path, monkeypatch, capsys):
    """A project of one file with one question."""
    source = tmp_path / "src" / "a.py"
    source.parent.mkdir()
    source.write_text('"""What it is."""\n')
    for bar, result, message in ((0, 1, "src/a.py:1"), (1, 0, "(bar 1)"), (2, 1, "lower it")):
        monkeypatch.setattr(words, "BARS", {kind: bar if "question" in kind else 0 for kind in words.BARS})
        assert words.main(tmp_path, listed=False) == result
        assert message in capsys.readouterr().out
