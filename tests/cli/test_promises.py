"""Interfaces for scripts: exit codes, stdout and stderr, and files that exist or not."""

import re
import warnings
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify import cli
from insonify.cli import app, main
from insonify.cli.arguments import (
    PICTURES,
    InputError,
    parse_ping_range,
    parse_quantity,
    require_choice,
    require_time,
    require_writable,
)
from insonify.cli.progress import pace, progress, resumed_note
from insonify.diagnostics.diagnostic import Diagnostic, ScenarioError
from insonify.formats.zarr_store import StoreError
from insonify.scenario.load import load_scenario
from insonify.units import UNITS


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@given(st.integers(1, 40), st.integers(0, 45), st.integers(0, 45))
def test_a_range_is_a_slice_or_is_refused_with_what_there_is(count, start, stop):
    """Each of a:b, a:, :b and a means what it means to a Python list; what is empty or reaches beyond is refused."""
    numbers = list(range(count))
    typed = {f"{start}:{stop}": slice(start, stop), f"{start}:": slice(start, None), f":{stop}": slice(stop)}
    for text, part in {**typed, f"{start}": slice(start, start + 1)}.items():
        meant = numbers[part]
        last = stop if text.endswith(str(stop)) and ":" in text else start + 1 if ":" not in text else count
        if meant and last <= count:
            assert list(parse_ping_range(text, count)) == meant
        else:
            with pytest.raises(InputError, match=f"--pings {text}: .*there are pings 0 to {count - 1}$"):
                parse_ping_range(text, count)


@pytest.mark.parametrize("dimension", UNITS)
@pytest.mark.parametrize("option", ["--time", "--range"])
def test_every_unit_is_understood_and_none_of_another_dimension(dimension, option):
    """Two of a unit are twice its size; a unit of something else is refused with those that would do."""
    for unit, size in UNITS[dimension].items():
        assert parse_quantity(f"2 {unit}", dimension, option) == pytest.approx(2 * size, rel=1e-15)
        for other in UNITS:
            if unit not in UNITS[other]:
                with pytest.raises(InputError, match=rf"^{option} 2 {unit}: '{unit}' is not a unit of {other}"):
                    parse_quantity(f"2 {unit}", other, option)


@given(st.floats(0, 0.5), st.floats(0.001, 0.5), st.floats(-1, 300))
def test_a_time_is_taken_when_it_is_held_and_milliseconds_are_offered_when_they_fit(first, length, when):
    """The three cases are exactly: inside, outside though it would fit in milliseconds, outside for good."""
    held = (first, first + length)
    if held[0] <= when <= held[1]:
        require_time(repr(when), when, held, "--time")
        return
    with pytest.raises(InputError) as caught:
        require_time(repr(when), when, held, "--time")
    assert ("did you mean" in str(caught.value)) == (held[0] <= when / 1e3 <= held[1])
    with pytest.raises(InputError) as caught:
        require_time(f"{when!r} s", when, held, "--time")
    assert "did you mean" not in str(caught.value) and "the recording holds" in str(caught.value)


def test_a_picture_needs_a_kind_and_a_folder(tmp_path):
    """Suffixes in any case; a missing folder is reported with the command that makes it."""
    for suffix in PICTURES:
        require_writable(tmp_path / f"a{suffix}", "-o")
        require_writable(tmp_path / f"a{suffix.upper()}", "-o")
    for name in ("a", "a.jpg", "a.png.txt"):
        with pytest.raises(InputError, match=r"not a picture; end its name in \.png, \.pdf, \.svg"):
            require_writable(tmp_path / name, "-o")
    with pytest.raises(InputError, match=f"Make it first: mkdir -p {tmp_path / 'no'}$"):
        require_writable(tmp_path / "no" / "a.png", "-o")
    require_choice("tvg20", ("none", "tvg20"), "--gain")
    with pytest.raises(InputError, match=r"Choose one of none, tvg20$"):
        require_choice("zzz", ("none", "tvg20"), "--gain")


FAULT = Diagnostic("a.yaml", 3, "x", "bad")
ENDS = {
    "advice": (ScenarioError([FAULT]), 2, "a.yaml:3: x: bad.\n"),
    "store": (StoreError("full of other things"), 2, "full of other things\n"),
    "words": (InputError("--x: no"), 2, "--x: no\n"),
    "place": (PermissionError(13, "denied", "out.zarr"), 2, "out.zarr"),
    "folder": (IsADirectoryError(21, "is a folder", "a.yaml"), 2, "a.yaml"),
    "ours": (ZeroDivisionError("division by zero"), 1, "the run failed: ZeroDivisionError: division by zero ("),
    "disk": (OSError(28, "No space left"), 1, "INSONIFY_TRACEBACK=1"),
    "value": (ValueError("of ours"), 1, "the run failed: ValueError: of ours"),
    "key": (KeyboardInterrupt(), 1, app.INTERRUPTED + "\n"),
}


@pytest.mark.parametrize("name", ENDS)
def test_each_end_of_a_command_has_its_code(name, monkeypatch, capsys):
    """What was typed is wrong: 2; the run went wrong: 1; words on stderr only, and no traceback."""
    error, code, message = ENDS[name]

    def load(_path):
        raise error

    monkeypatch.setattr("insonify.scenario.load.load_scenario", load)
    monkeypatch.delenv("INSONIFY_TRACEBACK", raising=False)
    assert main(["check", "a.yaml"]) == code
    out, err = capsys.readouterr()
    assert out == "" and message in err and "Traceback" not in err


def test_details_are_shown_on_request(monkeypatch):
    """With INSONIFY_TRACEBACK the error itself comes through, but never for a wrong input."""
    monkeypatch.setenv("INSONIFY_TRACEBACK", "1")
    monkeypatch.setattr("insonify.scenario.load.load_scenario", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["check", "a.yaml"])
    assert main(["check"]) == 2


def test_a_warning_is_reported_once_in_a_run_and_again_in_the_next(monkeypatch, capsys):
    """One line each, whatever line breaks it has, and the way Python warns is put back."""
    before = warnings.showwarning

    def load(_path):
        for _ in range(3):
            with warnings.catch_warnings():
                warnings.simplefilter("always")
                warnings.warn("the sea\n   is rough", UserWarning, stacklevel=1)
        raise InputError("enough")

    monkeypatch.setattr("insonify.scenario.load.load_scenario", load)
    for _ in range(2):
        assert main(["check", "a.yaml"]) == 2
        assert capsys.readouterr().err == "warning: the sea is rough\nenough\n"
    assert warnings.showwarning is before


@pytest.mark.parametrize("name", ["harbour", "harbour.yaml", "a b", "yes", "12", 'with "hi"', "Häfen", "null"])
def test_any_name_makes_a_scenario_of_that_name(here, name, capsys):
    """The file is NAME.yaml, its title is the name as text, and it is right as it stands."""
    assert main(["new", name]) == 0
    file = Path(capsys.readouterr().out.rstrip("\n"))
    assert file.name == (name if name.endswith(".yaml") else f"{name}.yaml")
    assert load_scenario(file).title == name.removesuffix(".yaml")
    assert [path.name for path in here.iterdir()] == [file.name]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["new", "x", "--template", "sidscan"], "Did you mean sidescan?"),
        (["new", "x", "--template", "qqq"], "Choose one of coherent-sidescan, echosounder, forward-looking"),
        (["new", "no/x"], "cannot be written"),
        (["check", "gone.yaml"], "there is no such file. Start from a template: insonify new NAME."),
        (["run", "gone.yaml", "-o", "x.zarr"], "gone.yaml: there is no such file"),
        (["show", "gone.zarr", "-o", "x.png"], "gone.zarr"),
        (["show", "sea", "-o", "x.gif"], "not a picture"),
        (["show", "sea", "-o", "no/x.png"], "mkdir -p no"),
        (["show", "sea", "-o", "/proc/x.png"], "-o /proc/x.png: "),
        (["show", "sea", "-o", "/dev/full/x.png"], "there is no folder /dev/full"),
        (["paper", "--figure", "10", "-o", "/proc/x"], "-o /proc/x: no folder can be made there"),
        (["show", "sea", "-o", "x.png", "--wind", "7 kHz"], "--wind 7 kHz: 'kHz' is not a unit of speed"),
        (["show", "sea", "-o", "x.png", "--frequency", "0 Hz"], "not a frequency"),
        (["show", "sea", "-o", "x.png", "--range", "9 m"], "--range is for rays; add --rays"),
        (["show", "x.zarr", "-o", "x.png", "--ping", "0", "--ground"], "Leave one or the other out"),
        (["explain", "gone.zarr", "--time", "3 furlongs"], "--time 3 furlongs"),
        (["explain", "gone.zarr", "--time", "3 ms"], "gone.zarr"),
        (["paper", "--figure", "99"], "choose from 1, 2"),
        (["paper", "--figure", "x"], "--figure"),
        (["demo", "multibeem"], "Did you mean multibeam?"),
        (["chekc", "x"], "chekc"),
    ],
)
def test_wrong_words_are_reported_and_leave_nothing(here, words, message, capsys):
    """Exit code 2, the fix on stderr, nothing on stdout, nothing on disk."""
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == "" and message in " ".join(err.split()) and not list(here.iterdir())


@given(st.integers(1, 10**6), st.floats(1e-3, 1e6))
def test_a_pace_is_never_a_small_number(steps, seconds):
    """Whichever unit is reported, the number is at least one, and is the rate or its inverse."""
    number, unit = pace(steps, seconds, "ping").split(" ")
    rate = steps / seconds
    assert float(number) >= 1 and unit in ("s/ping", "pings/s")
    assert float(number) == pytest.approx(rate if unit == "pings/s" else 1 / rate, rel=6e-3)


@given(st.integers(1, 50), st.data())
def test_what_was_there_is_reported_once_and_only_if_there_was_any(total, data):
    """A run that begins with nothing reports nothing; one that goes on states how much was there, once."""
    done = data.draw(st.integers(0, total))
    messages = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("insonify.cli.progress.typer.echo", lambda line, err: messages.append((line, err)))
        for quiet in (True, False):
            with progress(quiet) as on_ping:
                for step in range(done, total + 1):
                    on_ping(step, total)
    assert messages == ([(resumed_note(done, total, "ping"), True)] if done else [])
    assert ("nothing was left to do" in resumed_note(total, total, "ping")) and resumed_note(0, 2, "p").startswith("0")


def test_no_words_at_all_are_followed_by_help(capsys):
    """Every command is named, with a line on what it does."""
    main([])
    messages = "".join(capsys.readouterr())
    for command in ("new", "check", "run", "show", "explain", "paper", "demo"):
        assert re.search(rf"^\s+{command}\s+\w", messages, re.MULTILINE)
    assert cli.main is main
