"""The paper's figures 10-14 show the numbers that they must show."""

import csv
import json
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from insonify import paper
from insonify.paper import figure3, figure5, figure6, figure7, figure10, figure12, figure13
from insonify.paper.checked_numbers import CheckedNumber, write_numbers
from insonify.paper.nominal_scenario import nominal
from insonify.plotting import style
from insonify.scenario.template import template_text

LONG = {**dict.fromkeys((2, 3, 4, 5, 6, 7, 11, 13), pytest.mark.validate), **dict.fromkeys((1, 9, 10, 14), ())}
"""Marks of figures that take other than some seconds."""
PUBLISHED = Path(__file__).parents[1] / "published" / "paper_delays.csv"


def printed() -> list[dict[str, str]]:
    """The table of two-way delays."""
    lines = [line for line in PUBLISHED.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


def test_the_five_legs_take_the_time_that_images_require() -> None:
    """Figure 10: delays of a-e equal sqrt(r^2 + (z - z_image)^2) / c within 1e-9 s."""
    np.testing.assert_allclose(figure10.legs().delay, figure10.expected_delays(), rtol=0, atol=1e-9)


@pytest.mark.parametrize("row", printed(), ids=lambda row: row["pair"])
def test_the_fifteen_two_way_delays_are_those_printed(row: dict[str, str]) -> None:
    """Figure 10: each pair of legs to the seabed, and to the target's middle and top, to the printed microsecond."""
    delay = dict(zip("abcde", figure10.legs().delay * 1e3, strict=True))
    direct = 2 * delay["a"]
    there = delay[row["pair"][0]] + delay[row["pair"][1]]
    for column, point in enumerate(("seabed", "middle", "top")):
        measured = there[column] if row["pair"] == "aa" else there[column] - direct[column]
        assert measured == pytest.approx(float(row[point]), abs=0.6e-3)


def test_every_number_of_figure_10_holds() -> None:
    """Lengths, angles, one-way and two-way delays of three points."""
    rows = figure10.numbers()
    assert len(rows) == 3 * (5 * 3 + 15)
    assert all(row.holds is not False for row in rows)


@pytest.mark.parametrize("row", figure12.EXPECTED)
def test_reflections_fill_the_shadow(row: tuple[int, tuple[float, float]]) -> None:
    """Figure 12: contrast of a 6 m box with 0, 1 and 2 reflections, in both windows behind it."""
    expected, tolerance = figure12.EXPECTED[row]
    contrast = figure12.contrast(row[0], 6.0, row[1])
    assert contrast > expected if tolerance is None else contrast == pytest.approx(expected, abs=tolerance)


def test_sound_leaks_round_a_narrow_target() -> None:
    """Figure 12: direct paths behind the paper's 2 m box, 20.8 dB down: what the two-way beam receives beside it."""
    assert figure12.contrast(0, 2.0, figure12.LATE_WINDOW) == pytest.approx(20.8, abs=1.0)


def test_a_figure_that_there_is_not_is_refused(tmp_path: Path) -> None:
    """The message states what can be had, and nothing is written."""
    with pytest.raises(ValueError, match=r"figure 0, 99 is not available; choose from 1, 2, 3, .*, 13, 14"):
        paper.run([10, 0, 99], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def check(number: int, written: list[Path]) -> list[dict[str, Any]]:
    """The numbers of a figure that was drawn; whatever is expected of them has a source."""
    picture, numbers = written
    assert (picture.name, numbers.name) == (f"figure{number}.png", f"figure{number}.json")
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 40_000
    content = json.loads(numbers.read_text(encoding="utf-8"))
    assert content["figure"] == number
    assert all(len(scenario["sha256"]) == 64 for scenario in content["scenarios"].values()) and content["scenarios"]
    for row in content["numbers"]:
        assert row["unit"] and (row["expected"] is None or row["source"])
    return list(content["numbers"])


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")  # a wind of 3 m/s is at the edge of its law
@pytest.mark.parametrize("number", [pytest.param(n, marks=LONG.get(n, pytest.mark.slow)) for n in paper.FIGURES])
def test_a_figure_is_drawn_and_its_numbers_hold(number: int, tmp_path: Path) -> None:
    """A picture, and a JSON file of numbers that are what they are expected to be.

    Among them: figure 2, a flat bed is smooth within 0.2 dB, and a fractal one is not; 3, the shadow is as long and as
    wide as geometry states; 4, echoes ac and cc stand at the delays of exact rays, and nothing new 10 m away; 6, the
    contrast of the shadow falls by more than 15 dB; 7, ten pings under a breeze are alike by more than 0.95 in the
    direct echo and by less than 0.3 in the ghosts (0.1 by chance); 8, speckle index 2 of 10000 cells, 0.02 of standard
    error; 11 and 13 as below, of 200 and 40 seeds; 14, main lobe and first sidelobe of sinc^4 within 0.2 and 1 dB.
    """
    for row in check(number, paper.run([number], tmp_path / "new" / "folder")):
        assert row["expected"] is None or row["holds"] is True, (row["name"], row["value"])


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
@pytest.mark.parametrize("figure", [figure3, figure5, figure6, figure7])  # 2 and 4 by `make validate`, drawn
def test_numbers_hold_that_need_no_picture(figure: ModuleType) -> None:
    """Figures of long pictures: every number with an expectation, as listed for the drawn figures."""
    rows = figure.numbers()
    assert sum(row.expected is not None for row in rows) >= 5
    for row in rows:
        assert row.expected is None or row.holds is True, (row.name, row.value)


def test_spikes_energy_model_and_series_agree(tmp_path: Path) -> None:
    """Figure 11: 28 seeds of 175 cells each; 0.2 dB is 3.2 standard errors of the mean level, 4.34/sqrt(4900) dB.

    In the shortest window 25 cells of each: 0.5 dB is 3.05 standard errors.
    """
    for row in check(11, paper.draw(11, tmp_path, realisations=28)):
        assert row["expected"] is None or row["holds"] is True, (row["name"], row["value"])


def test_jitter_decorrelates_as_sinc_squared(tmp_path: Path) -> None:
    """Figure 13: 5 seeds of 825 cells; the error of the correlation is 0.886/sqrt(4125) = 0.014."""
    rows = check(13, paper.draw(13, tmp_path, realisations=5))
    assert [row["value"] for row in rows] == pytest.approx(np.sinc(figure13.JITTERS) ** 2, abs=0.042)


def test_without_a_choice_all_figures_are_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each by its own module, in the order of the paper; its numbers are in its own file, and its size is kept."""
    for n in paper.FIGURES:
        made = style.new_figure(n, 2.0), {"scene": nominal()}, [CheckedNumber(f"of figure {n}", n, "1")]
        monkeypatch.setattr(f"insonify.paper.figure{n}.draw", lambda made=made: made)
    written = paper.run(None, tmp_path)
    assert [path.name for path in written] == [f"figure{n}.{kind}" for n in range(1, 15) for kind in ("png", "json")]
    for n, (picture, numbers) in enumerate(zip(written[::2], written[1::2], strict=True), start=1):
        assert imread(picture).shape[1] == 130 * n
        content = json.loads(numbers.read_text(encoding="utf-8"))
        assert (content["figure"], [row["value"] for row in content["numbers"]]) == (n, [n])


def test_a_change_must_name_a_value() -> None:
    """A figure cannot change what is not in the nominal scene."""
    with pytest.raises(KeyError, match=r"paths\.reflexions"):
        nominal({"paths.reflexions": 1})


@pytest.mark.parametrize(
    ("number", "holds"),
    [
        (CheckedNumber("x", 1.0, "m"), None),
        (CheckedNumber("x", 1.0, "m", 1.05, 0.1), True),
        (CheckedNumber("x", 1.0, "m", 1.2, 0.1), False),
        (CheckedNumber("x", 31.0, "dB", 30.0), True),
        (CheckedNumber("x", 29.0, "dB", 30.0), False),
    ],
)
def test_a_number_states_whether_it_holds(number: CheckedNumber, holds: bool | None) -> None:
    """Within the tolerance, or above a lower bound."""
    assert number.holds is holds


def test_the_example_is_the_template() -> None:
    """What `insonify new` writes is what the examples show, but for the paper's flat surface and one frequency."""
    template = template_text("nominal")
    example = Path(__file__).parents[2] / "examples" / "nominal.yaml"
    shown = example.read_text(encoding="utf-8")

    def without(text: str) -> str:
        text = text[: text.index("\nsurface: ")] + text[text.index("  scattering: null # for its own echoes") :]
        return "\n".join(line for line in text.splitlines() if "sub_bands: " not in line)

    assert without(shown) == without(template)
    assert "reflection: flat" in shown and "reflection: statistical" in template
    assert "sub_bands: 1 #" in shown and "sub_bands: auto #" in template


@pytest.mark.parametrize(
    ("number", "relation"),
    [
        (CheckedNumber("x", 1.0, "m"), None),
        (CheckedNumber("x", 1.0, "m", 1.0, 0.1), "="),
        (CheckedNumber("x", 31.0, "dB", 30.0), ">="),
    ],
)
def test_a_number_states_how_it_stands_to_what_is_expected(
    number: CheckedNumber, relation: str | None, tmp_path: Path
) -> None:
    """A lower bound is reported from an equality, in the file as well."""
    assert number.relation == relation
    path = write_numbers(tmp_path / "x.json", 1, "x", {}, [number])
    assert json.loads(path.read_text(encoding="utf-8"))["numbers"][0]["relation"] == relation


def test_figures_are_counted_while_they_are_drawn(tmp_path: Path) -> None:
    """Reported none of two before the first, then each."""
    reported: list[tuple[int, int]] = []
    paper.run([10, 10], tmp_path, on_figure=lambda done, total: reported.append((done, total)))
    assert reported == [(0, 2), (1, 2), (2, 2)]


def test_the_shadows_numbers_stand_in_their_windows(tmp_path: Path) -> None:
    """Figure 12: each panel states the contrasts of the whole scene, for both boxes and both windows."""
    axes = Figure().subplots()
    figure12._contrasts(axes, 0)
    texts = [text.get_text() for text in axes.texts]
    assert re.match("6 m box: ≥ 30 dB\n2 m box: 20[.][78] dB", texts[0])
    assert len(texts) == 2
