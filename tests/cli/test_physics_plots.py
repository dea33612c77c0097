"""`show` distinguishes a sediment, a profile and a sea from a recording, and refuses mistakes with their fix."""

from pathlib import Path

import pytest

from insonify.cli.arguments import InputError
from insonify.cli.physics_plots import show_physics


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, object, dict[str, object]]]:
    """What would be drawn: which picture, of what, how."""
    calls: list[tuple[str, object, dict[str, object]]] = []
    for name in ("sediment", "laws", "sea", "absorption"):
        monkeypatch.setattr(f"insonify.plotting.{name}", lambda *a, _name=name, **how: calls.append((_name, a[0], how)))
    return calls


def show(what: str, **how: float) -> bool:
    """As the command line does."""
    return show_physics(what, Path("out.png"), **{"frequency": 100e3, "wind": 7.0, **how})


@pytest.mark.parametrize(
    ("what", "name"),
    [("medium sand", "medium sand"), ("Medium Sand", "medium sand"), ("sediment:clay", "clay"), ("rock", "rock"),
     ("sediment: 1.5 phi", "grain size 1.5 phi"), ("sediment:-1 phi", "grain size -1 phi"),
     ("sediment:6", "grain size 6 phi")],
)  # fmt: skip
def test_a_sediment_goes_by_name_or_grain_size(drawn: list, what: str, name: str) -> None:
    """Words in any case, or a number of phi behind `sediment:`."""
    assert show(what, frequency=50e3)
    ((picture, bed, how),) = drawn
    assert (picture, bed.name, how) == ("sediment", name, {"frequency": 50e3})


def test_several_sediments_share_an_axis(drawn: list) -> None:
    """Names between commas are compared."""
    assert show("rock, medium sand,clay")
    ((picture, beds, _),) = drawn
    assert picture == "laws" and [bed.name for bed in beds] == ["rock", "medium sand", "clay"]


@pytest.mark.parametrize(("what", "wind"), [("sea", 7.0), ("sea:12 m/s", 12.0), ("sea: 10 kn", 10 * 1852 / 3600)])
def test_a_sea_has_a_wind(drawn: list, what: str, wind: float) -> None:
    """Its own, with a unit, or the one of the option."""
    assert show(what)
    assert drawn[0][0] == "sea" and drawn[0][2]["wind_speed"] == pytest.approx(wind)


def test_absorption_goes_by_its_name(drawn: list) -> None:
    """One word draws the absorption of typical waters."""
    assert show("absorption")
    assert [call[0] for call in drawn] == ["absorption"]


@pytest.mark.parametrize("what", ["harbour.zarr", "out/sand", "run.7", "folder/sea"])
def test_everything_else_may_be_a_recording(drawn: list, what: str) -> None:
    """Names with a folder or a suffix are left to recordings."""
    assert not show(what)
    assert drawn == []


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("absorbtion", "did you mean absorption"),
        ("nonsense", r"did you mean .*silt"),
        ("no such thing at all", r"medium sand.*sea or absorption"),
        ("sand", r"fine sand.* or .*\?"),
    ],
)
def test_a_word_that_is_nothing_is_reported_with_the_nearest(drawn: list, what: str, message: str) -> None:
    """A misspelt picture is reported with the names of all."""
    with pytest.raises(InputError, match=message):
        show(what)
    assert drawn == []


def test_a_grain_size_needs_no_keyword(drawn: list) -> None:
    """The words 1.5 phi can only be a grain size, alone or among names."""
    assert show("1.5 phi")
    assert show("clay, 2 phi")
    assert [call[0] for call in drawn] == ["sediment", "laws"]


def test_what_lies_on_disk_is_a_recording(drawn: list, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder called clay is not a sediment; `sediment:clay` still is."""
    monkeypatch.chdir(tmp_path)
    Path("clay").mkdir()
    assert not show("clay")
    assert show("sediment:clay")


@pytest.mark.parametrize(
    ("what", "advice"),
    [
        ("medum sand", "did you mean medium sand"),
        ("sand", "did you mean"),
        ("sediment:xyzzy", "not a known sediment; the known ones are rough rock"),
        ("sediment:99 phi", "grain size is 99"),
        ("rock, medum sand", "did you mean medium sand"),
        ("sea:12 kHz", "sea:12 kHz: 'kHz' is not a unit of speed"),
        ("sea:windy", "sea:windy: 'windy' is not a speed"),
        ("sea:0 m/s", "give a wind above 0"),
        ("sea:-3 m/s", "give a wind above 0"),
        ("sea:500 m/s", "up to 60 m/s"),
        ("none.csv", "none.csv: there is no such file"),
    ],
)
def test_a_mistake_is_reported_with_the_fix(drawn: list, what: str, advice: str) -> None:
    """Bad names, sizes, winds and files: one message, nothing drawn."""
    with pytest.raises(InputError, match="(?s)" + advice.replace("(", r"\(")):
        show(what)
    assert drawn == []


@pytest.mark.parametrize("frequency", [0.0, -1.0, float("nan"), float("inf")])
def test_no_frequency_no_picture(drawn: list, frequency: float) -> None:
    """Sound has a frequency above 0."""
    with pytest.raises(InputError, match="--frequency"):
        show("clay", frequency=frequency)
    assert drawn == []


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("depth,speed\n0,1500\n10,abc\n", "line 3, column 2 (speed)"),
        ("depth,speed\n10,1500\n0,1490\n", "line 3, column 1 (depth)"),
        ("depth,speed\n0,1500\n10,15\n", "line 3, column 2 (speed)"),
        ("depth,taste\n0,1500\n10,1500\n", "line 1, column 2"),
        ("", "line 1: the file is empty"),
    ],
)
def test_a_broken_profile_is_reported_with_its_location(tmp_path: Path, text: str, place: str) -> None:
    """File, line and column, and no picture."""
    file, out = tmp_path / "probe.csv", tmp_path / "out.png"
    file.write_text(text)
    with pytest.raises(InputError) as error:
        show_physics(str(file), out, frequency=1e5, wind=7.0)
    assert f"{file}, {place}" in str(error.value)
    assert not out.exists()


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("depth,speed\n0,1500\n10,1490\n", {"temperature": None, "salinity": None}),
        ("depth;temperature;salinity\nm;degC;g/kg\n0;18;34\n10;9;35\n", {"temperature": [18, 9], "salinity": [34, 35]}),
        ("# cast 7\nDepth [m],speed,Temperature (degC)\n0,1500,18\n\n10,1490,9\n", {"temperature": [18, 9]}),
        ("depth,speed,temperature\n0,1500,18\n10,1490,\n", {"temperature": None}),
    ],
)
def test_a_profile_is_drawn_with_what_was_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, columns: dict[str, list[float] | None]
) -> None:
    """Temperature and salinity come along where every knot has them."""
    arguments: dict[str, object] = {}
    monkeypatch.setattr("insonify.plotting.profile", lambda column, out, **how: arguments.update(how, column=column))
    file = tmp_path / "probe.csv"
    file.write_text(text)
    assert show_physics(str(file), tmp_path / "out.png", frequency=1e5, wind=7.0)
    assert {name: arguments[name] for name in columns} == columns
    assert arguments["column"].depth.tolist() == [0, 10] and arguments["title"] == "probe.csv"


def test_a_profile_makes_a_picture(tmp_path: Path) -> None:
    """From file to file."""
    file, out = tmp_path / "probe.csv", tmp_path / "out.png"
    file.write_text("depth,temperature,salinity\n0,18,34\n10,17,34\n40,9,35\n")
    assert show_physics(str(file), out, frequency=1e5, wind=7.0)
    assert out.stat().st_size > 10_000
