"""A mistyped scenario gets a message with position, problem, limits and fix."""

import pickle
import re
from typing import Annotated, Literal, Self

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, model_validator

from insonify.diagnostics.diagnostic import Diagnostic, ScenarioError, nearest_word
from insonify.model import Decibels, Hertz, Metres, Model, Radians, Seconds, field_error
from insonify.scenario.load import load, parse_model


class Bed(Model):
    depth: Annotated[Metres, Field(ge=0.1, le=12_000)]
    reflection: Annotated[float, Field(ge=-1, le=1)] | Literal["medium sand"] = 0.35


class Crate(Model):
    shape: Literal["box"] = "box"
    label: str = ""
    size: tuple[Metres, Metres, Metres]
    base_depth: Metres | None = None


class Buoy(Model):
    shape: Literal["point"] = "point"
    strength_db: Annotated[Decibels, Field(lt=100)]


class Harbour(Model):
    title: str = ""
    seabed: Bed
    targets: tuple[Annotated[Crate | Buoy, Field(discriminator="shape")], ...] = ()
    bandwidth: Annotated[Hertz, Field(gt=0)] = 20e3
    bearing: Annotated[Radians, Field(ge=-6.3, le=6.3)] = 0.0
    steer: Radians | tuple[Radians, ...] = 0.0
    window: tuple[Seconds, Seconds] = (0.0, 0.24)
    pings: Annotated[int, Field(ge=1)] = 1
    compress: bool = False
    field: Literal["coherent", "incoherent"] = "coherent"

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.window[1] <= self.window[0]:
            raise ValueError("window stops before it starts.\nSwap its values.")
        for row, target in enumerate(self.targets):
            if isinstance(target, Crate) and target.base_depth and target.base_depth > self.seabed.depth:
                advice = f"is below the seabed ({self.seabed.depth:g} m). Write {self.seabed.depth:g} m or less."
                raise field_error(f"targets.{row}.base_depth", f"{target.base_depth:g} m", advice)
        return self


GOOD = "seabed: {depth: 20 m}\n"

MISTAKES = {
    # what is typed: the line of the reply
    "seabed:\n  depth: -20 m": "2: seabed.depth: -20 m is out of range (0.1 to 12000 m). "
    "Depths are positive downwards; write 20 m.",
    "seabed:\n  depth: 20 kHz": "2: seabed.depth: 20 kHz is not a length; use m, km, cm, mm, ft.",
    "seabed: {depth: 20 KM}": "1: seabed.depth: 20 KM is not a length; use m, km, cm, mm, ft. Did you mean km?",
    "seabed: {depth: 20 km}": "1: seabed.depth: 20 km is out of range (0.0001 to 12 km).",
    "seabed:\n\n  dept: 20": "3: seabed.dept: unknown key 'dept'; did you mean 'depth'?",
    "seabed: {depth: deep}": "1: seabed.depth: deep is not a length; use m, km, cm, mm, ft.",
    "seabed: {depth: .nan}": "1: seabed.depth: .nan is not a finite number (0.1 to 12000 m).",
    "seabed: {depth: -.inf}": "1: seabed.depth: -.inf is not a finite number (0.1 to 12000 m).",
    "seabed: {depth: 1e999 m}": "1: seabed.depth: 1e999 m is not a finite number (0.1 to 12000 m).",
    "seabed: {depth: no}": "1: seabed.depth: no means false in YAML; it should be a length in m.",
    "seabed: {depth: }": "1: seabed.depth: has no value; it should be a length in m.",
    "seabed: {depth: [20]}": "1: seabed.depth: [20] where a length in m should be.",
    "seabed: {}": "1: seabed.depth: missing; it should be a length in m. Add a line 'depth: ...'.",
    "seabed: 20 m": "1: seabed: 20 m where a group of keys (depth, reflection) should be.",
    "title: x": "1: seabed: missing; it should be a group of keys (depth, reflection). Add a line 'seabed: ...'.",
    "seabed: {depth: 20, reflection: medium snd}": "1: seabed.reflection: 'medium snd' is not known here "
    "(one of medium sand). Did you mean 'medium sand'?",
    "seabed: {depth: 20, reflection: 2}": "1: seabed.reflection: 2 is out of range (-1 to 1).",
    GOOD + "targets:\n- {shape: bux, size: [1, 2, 3]}": "3: targets.0.shape: 'bux' is not known here "
    "(one of box, point). Did you mean 'box'?",
    GOOD + "targets:\n- {size: [1, 2, 3]}": "3: targets.0.shape: missing; it should be one of box, point. "
    "Add a line 'shape: ...'.",
    GOOD + "targets:\n- shape: box\n  size: [1, 2]": "4: targets.0.size: value 3 is missing. "
    "Write a length in m there.",
    GOOD
    + "targets:\n- {shape: box, size: [1, 2, 3, 4]}": "3: targets.0.size: [1, 2, 3, 4] has 4 values (a list of 3).",
    GOOD + "targets:\n- {shape: point, strength_db: 3 V}": "3: targets.0.strength_db: 3 V: "
    "'V' is not a unit of level; use dB.",
    GOOD + "targets:\n- {shape: point, strength_db: 120}": "3: targets.0.strength_db: 120 dB is out of range "
    "(below 100 dB).",
    GOOD + "targets:\n- shape: box\n  size: [1, 2, 3]\n  base_depth: 25 m": "5: targets.0.base_depth: 25 m is below "
    "the seabed (20 m). Write 20 m or less.",
    GOOD + "targets:\n- {shape: box, label: pier, size: [1, 2, 3 s]}": "3: targets.0.size.2 (pier): 3 s is not "
    "a length; use m, km, cm, mm, ft.",
    GOOD + "targets:\n- {shape: box, label: 3, size: [1, 2, 3]}": "3: targets.0.label: 3 is read as a number. "
    'Write "3", with quotes.',
    GOOD + "targets: {a: 1}": "2: targets: {a: 1} where a list should be.",
    GOOD + "bandwidth: 0": "2: bandwidth: 0 Hz is out of range (above 0 Hz).",
    GOOD + "bearing: 90": "2: bearing: 90 rad is out of range (-6.3 to 6.3 rad). Did you mean 90 deg?",
    GOOD + "bearing: 400 deg": "2: bearing: 400 deg is out of range (-360.963 to 360.963 deg).",
    GOOD + "steer: [1 deg, 2 m]": "2: steer.1: 2 m is not an angle; use rad, deg, mrad.",
    GOOD + "window: [2 ms, 1 ms]": "1: window stops before it starts. Swap its values.",
    GOOD + "pings: 0": "2: pings: 0 is out of range (1 or more).",
    GOOD + "pings: .nan": "2: pings: .nan is not a finite number (1 or more).",
    GOOD + "title: .inf": "2: title: .inf is not a finite number.",
    "seabed: {depth: 0.001}": "1: seabed.depth: 0.001 m is out of range (0.1 to 12000 m).",
    GOOD + "pings: -1e30": "2: pings: -1e30 is out of range (1 or more).",
    GOOD + "targets: [x]": "2: targets.0: x where a group of keys (shape: one of box, point; and what belongs to it) "
    "should be.",
    GOOD + "bandwidth: ''": "2: bandwidth: '' is not a frequency; use Hz, kHz, MHz.",
    GOOD + "pings: 1.5": "2: pings: 1.5 where a whole number should be.",
    GOOD + "compress: 3": "2: compress: 3 where true or false should be.",
    GOOD + "field: coherant": "2: field: 'coherant' is not known here (one of coherent, incoherent). "
    "Did you mean 'coherent'?",
    GOOD + "title: 12": '2: title: 12 is read as a number. Write "12", with quotes.',
    GOOD + "compres: off": "2: compres: unknown key 'compres'; did you mean 'compress'?",
    GOOD + "title: off": "2: title: off means false in YAML; it should be text. Put quotes around it.",
    GOOD + "pings: 1\npings: 2": "3: pings: key 'pings' is here twice (first on line 2). Delete one of them.",
    GOOD + "? [a]\n: 2": "2: a key must be one word.",
    GOOD + "pings: !int 2": "2: pings: the tag !int has no meaning here.",
    "": "1: the file is empty. Start from a template: insonify new NAME.",
    "# nothing but words": "1: the file is empty. Start from a template: insonify new NAME.",
    "seabed:\n\tdepth: 20": "2: not YAML at column 1: found character '\\t' that cannot start any token. "
    "Indent with spaces, not tabs.",
    "seabed: depth: 20": "1: not YAML at column 14: mapping values are not allowed here.",
    "seabed: &bed {depth: 20}\ntitle: *bed": "2: not YAML at column 8: found an alias (*name); write the value out.",
    "seabed: \x00": "1: not YAML: unacceptable character #x0000: special characters are not allowed. "
    "Save it as UTF-8 text.",
    "[" * 3000: "1: not a scenario: it is nested too deeply.",
}


def lines(text: str) -> list[str]:
    """Messages about a file that holds this text, without the file's name."""
    with pytest.raises(ScenarioError) as caught:
        parse_model(Harbour, text, name="harbour.yaml")
    return [line.removeprefix("harbour.yaml:") for line in str(caught.value).splitlines()]


@pytest.mark.parametrize("typed", MISTAKES, ids=lambda typed: repr(typed)[1:60])
def test_one_mistake_gets_one_line_with_the_fix(typed: str) -> None:
    """File, line, field, value, allowed range, fix."""
    assert lines(typed) == [MISTAKES[typed]]


def test_all_mistakes_are_reported_at_once_in_the_order_of_the_file() -> None:
    """All errors of a file are reported together."""
    messages = lines("seabed: {depht: 20}\npings: 0\nfield: strong\npings: 1\nsteer: [.nan]")
    assert [line.split(":")[0] for line in messages] == ["1", "2", "3", "4", "5"]


def test_advice_carries_its_parts() -> None:
    """A program can request file, line and field without reading the sentence."""
    with pytest.raises(ScenarioError) as caught:
        parse_model(Harbour, "seabed:\n  depth: -20 m", name="harbour.yaml")
    (fault,) = caught.value.faults
    assert (fault.file, fault.line, fault.field) == ("harbour.yaml", 2, "seabed.depth")
    assert (fault.allowed, fault.fix) == ("0.1 to 12000 m", "Depths are positive downwards; write 20 m")


@pytest.mark.parametrize("typed", ["1e3", "1.0E+3", "1000", "+1000.", "1000 m", "1 km", "'1000'"])
def test_a_number_is_a_number_however_it_is_typed(typed: str) -> None:
    """YAML 1.1 reads 1e3 as text; here it is a thousand."""
    assert parse_model(Harbour, f"seabed: {{depth: {typed}}}").seabed.depth == 1000


@pytest.mark.parametrize("typed", ["1:30", "0x10", "1_0", "2020-01-01"])
def test_what_only_yaml_takes_for_a_number_is_refused(typed: str) -> None:
    """1:30 is not ninety metres."""
    assert "is not a length" in lines(f"seabed: {{depth: {typed}}}")[0]


def test_a_leading_zero_does_not_make_a_number_octal() -> None:
    """010 is ten."""
    assert parse_model(Harbour, "seabed: {depth: 010}").seabed.depth == 10


def test_a_file_that_cannot_be_read_is_advice_too(tmp_path) -> None:
    """Absent, a folder, or not text at all."""
    binary = tmp_path / "picture.yaml"
    binary.write_bytes(b"\x89PNG\xff")
    for path, problem in ((tmp_path / "no.yaml", "no such file"), (tmp_path, "cannot be read"), (binary, "not text")):
        with pytest.raises(ScenarioError, match=f"^{re.escape(str(path))}: .*{problem}"):
            load(Harbour, path)


def test_nearest_word_is_near_or_nothing() -> None:
    """A guess helps only where it is good."""
    assert nearest_word("Dept", ["depth", "title"]) == "depth"
    assert nearest_word("xyzzy", ["depth", "title"]) is None


def test_contradictions_read_well_in_python_too() -> None:
    """The same check, reached without a file, still names the place."""
    with pytest.raises(ValueError, match=r"targets\.0\.base_depth: 25 m is below the seabed"):
        Harbour(seabed={"depth": 20}, targets=[{"shape": "box", "size": [1, 1, 1], "base_depth": 25}])


def test_an_error_reaches_another_process():
    """With all its faults."""
    error = ScenarioError([Diagnostic("bay.yaml", 3, "track", "is missing"), Diagnostic("bay.yaml", 1, "seed", "-1")])
    copied = pickle.loads(pickle.dumps(error))
    assert copied.faults == error.faults and str(copied) == str(error)


def test_advice_is_one_line_and_ends_like_a_sentence():
    """Line breaks and runs of blanks go; a full stop is set once; a file without lines has none."""
    diagnostic = Diagnostic("a.yaml", 3, "x.0.y", "5 m\n is   out of range", "1 to 2 m", "Did you mean 5 cm?", "pier")
    assert str(diagnostic) == "a.yaml:3: x.0.y (pier): 5 m is out of range (1 to 2 m). Did you mean 5 cm?"
    assert str(Diagnostic("a.yaml", 0, "", "there is no such file.")) == "a.yaml: there is no such file."


@given(st.lists(st.tuples(st.integers(0, 99), st.text("abcdefgh", min_size=1)), min_size=1, max_size=6))
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
