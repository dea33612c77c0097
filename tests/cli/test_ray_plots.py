"""`insonify show --rays` draws rays of a profile or a scenario, and refuses mistakes with their fix."""

from pathlib import Path
from typing import Any

import pytest

from insonify.cli import main
from insonify.cli.arguments import InputError
from insonify.cli.ray_plots import show_rays
from insonify.scenario.template import template_text


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """What would be drawn, and how."""
    calls: list[dict[str, Any]] = []
    monkeypatch.setattr(
        "insonify.plotting.rays", lambda profile, out, **how: calls.append({"profile": profile, "out": out, **how})
    )
    return calls


@pytest.fixture
def cast(tmp_path: Path) -> Path:
    """A measured profile."""
    file = tmp_path / "cast.csv"
    file.write_text("depth,speed\n0,1510\n8,1510\n14,1490\n20,1490\n")
    return file


@pytest.fixture
def scenario(tmp_path: Path, cast: Path) -> Path:
    """The nominal scene in the water of that profile."""
    text = template_text("nominal")
    file = tmp_path / "harbour.yaml"
    file.write_text(text.replace("sound_speed: 1500 m/s", f"profile: {cast.name}"), encoding="utf-8")
    return file


def test_a_profile_needs_the_start_of_its_rays(drawn: list[dict[str, Any]], cast: Path) -> None:
    """With a depth they are drawn to 200 m or as far as given; without, the message has a depth to copy."""
    show_rays(str(cast), Path("x.png"), source_depth="11 m")
    show_rays(str(cast), Path("x.png"), source_depth="11", farthest="0.3 km")
    assert [(call["source_depth"], call["water_depth"], call["max_range"]) for call in drawn] == [
        (11.0, 20.0, 200.0), (11.0, 20.0, 300.0),
    ]  # fmt: skip
    with pytest.raises(InputError, match="Write --source-depth '10 m'"):
        show_rays(str(cast), Path("x.png"))


def test_a_scenario_has_its_sonar_and_its_range(drawn: list[dict[str, Any]], scenario: Path) -> None:
    """Rays start at the sonar, end where the window ends, and bounce as often as its paths."""
    show_rays(str(scenario), Path("x.png"))
    (call,) = drawn
    assert (call["source_depth"], call["water_depth"], call["bounces"]) == (11.0, 20.0, 2)
    assert call["max_range"] == pytest.approx(1510 * 0.24 / 2)
    assert call["title"] == "Nominal scene" and call["profile"].speed.max() == 1510


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (["cast.csv", "--source-depth", "33 m"], "--source-depth 33 m: not in the water; give a depth from 0 to 20 m"),
        (["cast.csv", "--source-depth", "33 kHz"], "'kHz' is not a unit of length"),
        (["cast.csv", "--source-depth", "3 m", "--range", "-1 m"], "give a distance above 0"),
        (["none.csv", "--source-depth", "3 m"], "none.csv: there is no such file"),
        (["sea"], "--rays draws a sound-speed profile"),
        (["harbour.zarr"], "--rays draws a sound-speed profile"),
    ],
)
def test_a_mistake_is_reported_with_the_fix(
    cast: Path, words: list[str], advice: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One message on stderr, exit code 2, no picture."""
    monkeypatch.chdir(cast.parent)
    assert main(["show", *words, "--rays", "-o", "x.png"]) == 2
    assert advice in capsys.readouterr().err
    assert not Path("x.png").exists()


def test_options_of_rays_want_rays(cast: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A source depth means nothing to a picture of the profile alone."""
    assert main(["show", str(cast), "--source-depth", "3 m", "-o", str(cast.parent / "x.png")]) == 2
    assert "add --rays" in capsys.readouterr().err


def test_a_scenario_is_drawn_and_what_belongs_to_a_recording_is_refused(
    scenario: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The bed from above and the beam from the side; with --ping, the way to a recording."""
    out = scenario.parent / "x.png"
    assert main(["show", str(scenario), "-o", str(out)]) == 0
    assert out.read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    assert main(["show", str(scenario), "--ping", "0", "-o", str(out)]) == 2
    assert "insonify run" in capsys.readouterr().err


def test_rays_of_a_scenario_make_a_picture(scenario: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From file to file."""
    out = scenario.parent / "rays.png"
    assert main(["show", str(scenario), "--rays", "-o", str(out)]) == 0
    assert out.stat().st_size > 30_000 and str(out) in capsys.readouterr().out
