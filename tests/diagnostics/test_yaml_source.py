"""Reading a YAML file: every value keeps its line, every word its meaning, and nothing is passed over."""

import math
from pathlib import Path

import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from insonify.diagnostics.yaml_source import plain_value, read

WORDS = st.text("abcdefgh", min_size=1, max_size=6).map(lambda word: "x" + word)
PLAIN = st.integers(-(10**9), 10**9) | st.floats(allow_nan=False, allow_infinity=False, width=32) | WORDS
TREES = st.recursive(
    PLAIN, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=3), max_leaves=12
)


def one_per_line(tree, depth=0):
    """YAML with each key, and each item of a list, on a line of its own."""
    pad = "  " * depth
    if isinstance(tree, dict) and tree:
        return "\n".join(f"{pad}{key}:{below(value, depth)}" for key, value in tree.items())
    return "\n".join(f"{pad}-{below(value, depth)}" for value in tree)


def below(value, depth):
    """A value after its key: on the same line, or indented beneath it."""
    if isinstance(value, dict | list):
        return f"\n{one_per_line(value, depth + 1)}" if value else f" {'{}' if isinstance(value, dict) else '[]'}"
    return f" {value!r}" if not isinstance(value, str) else f" {value}"


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(WORDS, TREES, min_size=1, max_size=4))
def test_every_value_is_found_again_on_its_own_line(tree):
    """Keys stand on the line that is reported, and the text of each plain value stands there as it was typed."""
    text = one_per_line(tree)
    source, rows = read(text, "a.yaml"), text.split("\n")
    assert source.values == tree and not source.faults
    for path, typed in source.written.items():
        row = rows[source.line(path) - 1]
        assert row.endswith(f" {typed}") and plain_value(typed) == source.value(path)
        if isinstance(path[-1], str):
            assert row.strip(" -").startswith(f"{path[-1]}:")


@given(st.dictionaries(WORDS, PLAIN, min_size=1, max_size=4), WORDS, st.integers(0, 5))
def test_what_is_not_in_the_file_has_the_line_of_what_is_around_it(tree, stranger, deeper):
    """For something missing, the file points to the nearest thing that it holds."""
    source = read("title: x\nouter:\n" + one_per_line(tree, 1), "a.yaml")
    assume(stranger not in tree)
    assert source.line(("outer", stranger, *range(deeper))) == source.line(("outer",)) == 2
    assert source.line((stranger,)) == 1


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_number_means_what_python_means(number):
    """However many digits, with or without an exponent, and both signs."""
    for typed in (repr(number), f"{number:.17e}", f"{number:+.17E}"):
        assert plain_value(typed) == number and isinstance(plain_value(typed), float | int)


@given(st.integers(-(10**30), 10**30))
def test_whole_numbers_stay_whole(number):
    """A seed of thirty digits loses none of them."""
    assert plain_value(str(number)) == number and type(plain_value(str(number))) is int


@pytest.mark.parametrize("typed", ["0x10", "1_000", "1:30", "1e", "e3", "--1", "1.2.3", "½", "0b1", "2026-01-01", "5m"])
def test_what_is_no_decimal_number_is_text(typed):
    """No sexagesimals, no hexadecimals, no dates."""
    assert plain_value(typed) == typed


def test_the_few_words_of_yaml_go_in_any_case_and_quotes_make_them_text():
    """Yes, OFF and ~ have a meaning, "Yes" has none."""
    assert [plain_value(word) for word in ("Yes", "OFF", "~", "Null", "TRUE")] == [True, False, None, None, True]
    assert math.isnan(plain_value(".NaN")) and plain_value("-.INF") == -math.inf
    source = read("a: 'yes'\nb: \"12\"\nc: |\n  1e3\nd: no\n", "a.yaml")
    assert source.values == {"a": "yes", "b": "12", "c": "1e3\n", "d": False}


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("a: 1\nb:\n\t- 2\n", 3, "Indent with spaces, not tabs"),
        ("a: &x 1\nb: *x\n", 2, "write the value out"),
        ("a: 1\nb: [1, 2\n", 3, "not YAML at column"),
        ("a: 1\nb: 2\na: 3\n", 3, "key 'a' is here twice (first on line 1). Delete one of them."),
        ("a: 1\nb: {c: 1, c: 2}\n", 2, "key 'c' is here twice (first on line 2)"),
        ("a:\n  [1, 2]: 3\n", 2, "a key must be one word"),
        ("a: 1\nb: !secret 3\n", 2, "the tag !secret has no meaning here"),
        ("", 1, "the file is empty. Start from a template: insonify new NAME."),
        ("# only a comment\n", 1, "the file is empty"),
        ("a: \x00\n", 1, "Save it as UTF-8 text"),
        ("[" * 1200, 1, "nested too deeply"),
    ],
)
def test_bad_writing_is_reported_with_its_line(text, line, message):
    """One fault each: the file, the line, and what to do."""
    (fault,) = read(text, "a.yaml").faults
    assert fault.line == line and str(fault).startswith(f"a.yaml:{line}: ") and message in str(fault)


def test_our_reader_agrees_with_yaml_where_yaml_is_not_doubtful():
    """The templates, read by both: the same tree, but for numbers with exponents and words with units."""
    for name in ("nominal", "sidescan"):
        text = (Path(__file__).parents[2] / f"src/insonify/scenario/templates/{name}.yaml").read_text(encoding="utf-8")
        assert read(text, name).values == yaml.safe_load(text)
