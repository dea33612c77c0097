"""Claims about the words of the project: class names used twice or as words, questions, replaced words are noticed."""

import ast
import importlib.util
import re
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
        ('"""RaySpreads are left out."""', 1), ("# RaySpreads, and more", 1), ('"""One. RaySpreads of two."""', 1),
        ('"""Sum.\n\n    RaySpreads\n    are left out."""', 1), ('"""Args:\n    a: RaySpreads of both."""', 1),
        ('"""`RaySpreads` are left out."""', 0), ('"""Raises:\n    RaySpreads: never."""', 0),
        ('"""See x.RaySpreads as it is."""', 0), ('"""Sum.\n\n    >>> a: RaySpreads = f()\n    """', 0),
        ("x = 'RaySpreads are text'", 0), ('"""Pulse of one sonar."""', 0),
    ],
)  # fmt: skip
def test_class_names_are_no_words_of_sentences(words, text, count):
    """At the beginning of a sentence in docstrings and comments; a name without a hump may be any word."""
    trees = {"src/a.py": ast.parse("class RaySpreads: ...\nclass Pulse: ...")}
    assert len(words.class_names_as_words({"tests/a.py": text}, trees)) == count


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


def test_descriptions_name_their_value(words):
    """An argument and an attribute that begin with Of, in the package alone; a name of a description is enough."""
    text = '"""Sum.\n\n    Args:\n        n: Of rows.\n        m: Row of Of.\n"""\nx: int\n"""Of it."""\n'
    assert words.unnamed_values({"src/a.py": text, "tests/a.py": text}) == ["src/a.py:4: Of", "src/a.py:8: Of"]


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
        ("Bounces off it, and a bounce, offset", 1),
    ],
)
def test_replaced_words_are_noticed_in_names_and_text(words, text, count):
    """In any case, between underscores and humps as well; parts of longer words are not."""
    assert len(words.replaced_words({"tests/a.py": text})) == count


def test_a_place_is_a_position_in_names_of_the_package_alone(words):
    """Prose and tests may have places; a two-way delay is the field's term."""
    text = "two_way, in_place = place, Place  # in its place"
    assert [len(words.replaced_words({name: text})) for name in ("src/a.py", "tests/a.py")] == [2, 0]


def test_pages_and_scenarios_have_no_replaced_words(words, tmp_path, capsys):
    """One page of two, and a template, each with one word; the page about people is not read."""
    for name in ("README.md", "docs/a/b.md", "src/a.yaml", "CODE_OF_CONDUCT.md"):
        page = tmp_path / name
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text("Ask.\n")
    assert words.main(tmp_path, listed=False) == 1
    output = capsys.readouterr().out
    assert re.findall(r"  (\S+):1: Ask", output) == ["README.md", "docs/a/b.md", "src/a.yaml"]


def test_every_word_of_the_glossary_is_checked_where_it_states(words):
    """The words of its second table, in a test, in the package, and as the name of a value."""
    table = (TOOL.parents[1] / "docs" / "glossary.md").read_text(encoding="utf-8").split("| not | but | checked |")[1]
    rows = re.findall(r"^\| ([^|]+) \| [^|]+ \| (\w+) \|$", table, flags=re.MULTILINE)
    assert len(rows) == table.count("\n|") - 1 and {status for _, status in rows} >= {"everywhere", "names", "package"}
    for row, status in rows:
        for word in re.sub(r" \(.*\)", "", row).split(", "):
            found = [
                bool(words.replaced_words({name: text}))
                for name, text in (("tests/a.py", f"# {word}"), ("src/a.py", f"# {word}"), ("src/a.py", f"{word} = 1"))
                if " " not in word or text.startswith("#")
            ]
            expected = {"everywhere": [1, 1, 1], "package": [0, 1, 1], "names": [0, 0, 1], "nowhere": [0, 0, 0]}[status]
            assert found == expected[: len(found)], word


def test_a_count_above_its_bar_fails_and_one_below_requests_a_lower_bar(words, tmp_path, monkeypatch, capsys):
    """A project of one file with one question."""
    source = tmp_path / "src" / "a.py"
    source.parent.mkdir()
    source.write_text('"""What it is."""\n')
    for bar, result, message in ((0, 1, "src/a.py:1"), (1, 0, "(bar 1)"), (2, 1, "lower it")):
        monkeypatch.setattr(words, "BARS", {kind: bar if "question" in kind else 0 for kind in words.BARS})
        assert words.main(tmp_path, listed=False) == result
        assert message in capsys.readouterr().out
