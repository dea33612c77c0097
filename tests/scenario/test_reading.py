"""Reading a scenario file: every value keeps its line, every word its meaning, and nothing is passed over."""

import math
from pathlib import Path

import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from insonify.scenario.diagnostic import Diagnostic, ScenarioError, nearest_word
from insonify.scenario.expected_type import find
from insonify.scenario.load import load_scenario, parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.scenario.yaml_source import dotted, plain_value, read
from oracles.scenes import nominal, point

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


def test_advice_is_one_line_and_ends_like_a_sentence():
    """Line breaks and runs of blanks go; a full stop is set once; a file without lines has none."""
    diagnostic = Diagnostic("a.yaml", 3, "x.0.y", "5 m\n is   out of range", "1 to 2 m", "Did you mean 5 cm?", "pier")
    assert str(diagnostic) == "a.yaml:3: x.0.y (pier): 5 m is out of range (1 to 2 m). Did you mean 5 cm?"
    assert str(Diagnostic("a.yaml", 0, "", "there is no such file.")) == "a.yaml: there is no such file."


@given(st.lists(st.tuples(st.integers(0, 99), WORDS), min_size=1, max_size=6))
def test_faults_come_in_the_order_of_the_file(places):
    """Whatever the order in which they are found."""
    error = ScenarioError([Diagnostic("f", line, field, "bad") for line, field in places])
    assert [(fault.line, fault.field) for fault in error.faults] == sorted(places)
    assert len(str(error).split("\n")) == len(places)


@given(st.lists(st.text("abcdefghij_", min_size=5, max_size=12), min_size=1, max_size=6, unique=True), st.data())
def test_a_known_word_with_a_letter_too_few_is_found_again(known, data):
    """The word itself always; with its last letter lost, some known word at least; in capitals as well."""
    word = data.draw(st.sampled_from(known))
    assert nearest_word(word, known) == word and nearest_word(word.upper(), known) == word
    assert nearest_word(word[:-1], known) in known and nearest_word(word, [word.upper()]) == word.upper()
    assert nearest_word("0123456789", known) is None


def test_a_key_has_the_units_and_limits_of_its_model():
    """Units, limits and kinds come from the models: a length in m, an angle, a frequency above zero, a list of 3."""
    values = nominal().model_dump(mode="json")

    def expected_kinds(dots):
        loc = tuple(int(step) if step.isdigit() else step for step in dots.split("."))
        path, found = find(Scenario, values, loc)
        assert dotted(path) == dots
        return [choice for choice in found if choice.kind is not type(None)]

    assert (
        expected_kinds("seabed.depth")[0].description() == "a length in m"
        and expected_kinds("seabed.depth")[0].dimension == "length"
    )
    assert any(choice.units == "Hz" for choice in expected_kinds("sonar.pulse.frequency"))
    assert expected_kinds("track.position.2")[0].units == "m"
    assert expected_kinds("seed")[0].limits == {"ge": 0.0, "lt": 2.0**63}
    assert expected_kinds("field")[0].description() == "one of coherent, incoherent"


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {
            "targets": [point(3.0, 60, 15), point(-3.0, 70, 12, label="other")],
            "paths": {"edge_diffraction": "knife-edge", "jitter": 0.1},
        },
        {"water": {"profile": [[0, 1510], [8, 1510.25], [14, 1490.1], [20, 1490]], "smoothing": 0.5}},
        {"seabed": {"scattering": {"law": "jackson", "sediment": "coarse sand"}, "reflection": "coarse sand"}},
        {"track": {"motion": {"roll": {"rms": 0.01, "period": 5}}, "pings": 3}},
        {"sonar": {"sides": ["port", "starboard"]}},
    ],
)
@pytest.mark.filterwarnings("ignore")
def test_writing_and_reading_is_the_identity_and_writing_is_settled(changes, tmp_path):
    """A scenario from its own YAML is equal to it, from text and from a file, and is written to the same bytes."""
    scenario = nominal(**changes)
    text = to_yaml(scenario)
    again = parse_model(Scenario, text)
    assert again == scenario and to_yaml(again) == text
    file = tmp_path / "written.yaml"
    file.write_text("\ufeff" + text.replace("\n", "\r\n"), encoding="utf-8", newline="")  # as an editor may save it
    assert load_scenario(file) == scenario


@pytest.mark.parametrize(
    ("key", "typed", "si"),
    [
        ("duration", "200 us", 2e-4),
        ("duration", "0.2 ms", 2e-4),
        ("frequency", "0.1 MHz", 1e5),
        ("frequency", "100 kHz", 1e5),
    ],
)
def test_units_change_the_writing_and_not_the_meaning(key, typed, si):
    """The same pulse in any unit is the same scenario."""
    values = yaml.safe_load(to_yaml(nominal()))
    values["sonar"]["pulse"][key] = typed
    scenario = parse_model(Scenario, yaml.safe_dump(values))
    assert getattr(scenario.sonar.pulse, key) == pytest.approx(si, rel=1e-15)


@pytest.mark.parametrize(
    ("field", "typed"),
    [
        ("seabed.depth", "-20 m"), ("seabed.depth", "-2000 cm"),
        ("sonar.mounting.bearing", "90"), ("track.heading", "45"),
        ("water.sound_speed", "-1500"), ("sonar.receive.length", "-1.5"), ("sonar.pulse.duration", "-0.2 ms"),
    ],
)  # fmt: skip
def test_what_advice_offers_is_accepted(field, typed):
    """Whatever writes what the advice offers is not advised again about that place."""
    values = yaml.safe_load(to_yaml(nominal()))
    *steps, last = [int(step) if step.isdigit() else step for step in field.split(".")]

    def faults(text):
        place = values
        for step in steps:
            place = place[step]
        place[last] = text
        try:
            parse_model(Scenario, yaml.safe_dump(values))
        except ScenarioError as error:
            return [fault for fault in error.faults if fault.field == field]
        return []

    (fault,) = faults(yaml.safe_load(typed))
    offered = fault.fix.removeprefix("Did you mean ").removeprefix("Depths are positive downwards; write ").rstrip("?.")
    assert offered and typed not in (offered,)
    assert faults(offered) == []


def test_a_file_without_an_end_is_refused():
    """A device is read up to the most that a scenario has."""
    with pytest.raises(ScenarioError, match="more than 64 MB"):
        load_scenario("/dev/zero")
