"""Pages that are read before and after a run: what it will cost, and why a sample is what it is."""

import hashlib
import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify import simulate
from insonify.estimates.run_cost import SHARE, RunCost, estimate_cost, size_refusal
from insonify.explanation.sample_report import TERMS, SampleArrivals, explain_sample
from insonify.paper.checked_numbers import CheckedNumber, write_numbers
from insonify.recording_run import record
from insonify.scenario.write import to_yaml
from oracles.scenes import nominal, point

SIZES = {"kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12}
TIMES = {"second": 1.0, "seconds": 1.0, "minutes": 60.0, "hours": 3600.0, "days": 86400.0}
COUNTS = {"": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
CHEAP = {"max_reflections": 0, "contributions": ["seabed"]}
SOUND_SPEED, SLANT = 1500.0, 60.0
ABEAM = point(0.0, SLANT, 11.0, strength=-12.0)


@given(st.integers(1, 9), *(st.floats(low, high) for low, high in ((1, 1e12), (2, 1e8), (1e3, 1e14), (1e3, 1e14))))
def test_the_words_of_a_cost_are_its_numbers(pings, scatterers, seconds, memory, disk):
    """Read back with their units, each is right to the digits that are given."""
    message = RunCost(pings, scatterers, seconds, memory, disk).summary()
    expected = re.fullmatch(
        r"(\d+) pings?, about ([\d.e+]+) ?([kMG]?) scatterers(?: each)?: about (\S+) (\w+) of processor time, "
        r"(\S+) (\w+) of memory, (\S+) (\w+) on disk",
        message,
    )
    assert expected is not None, message
    count, points, size, long, unit, held, held_unit, stored, stored_unit = expected.groups()
    assert int(count) == pings
    assert float(points) * COUNTS[size] == pytest.approx(scatterers, rel=0.051, abs=0.5)
    assert float(long) * TIMES[unit] == pytest.approx(seconds, rel=0.051, abs=0.5)
    assert float(held) * SIZES[held_unit] == pytest.approx(memory, rel=6e-3, abs=500)
    assert float(stored) * SIZES[stored_unit] == pytest.approx(disk, rel=6e-3, abs=500)


@given(st.floats(1e6, 1e13), st.floats(0.5, 1.5))
def test_a_run_is_refused_exactly_when_its_share_of_memory_is_exceeded(memory, part):
    """Four fifths of the machine, whatever its size."""
    run = RunCost(1, 1e3, 1.0, part * memory, 1e3)
    assert (size_refusal(run, memory) != "") == (part * memory > SHARE * memory)


def test_cost_does_not_care_where_and_whither():
    """Moved over a flat bed, turned, or drawn with another seed: the same work to a few percent."""
    window = {"window": (0.02, 0.08)}
    here = estimate_cost(nominal(track=window, paths=CHEAP))
    away = {"position": (500.0, -300.0, 11.0), "heading": 1.0, **window}
    there = estimate_cost(nominal(track=away, paths=CHEAP, seed=9))
    assert there.scatterers == pytest.approx(here.scatterers, rel=0.05)
    assert (there.disk, there.pings) == (here.disk, here.pings)


def test_cost_follows_the_request():
    """Nearly in proportion to the scatterers in a cell; more with a lower floor; few in a slice."""

    def evaluate_at(**paths):
        return estimate_cost(nominal(track={"window": (0.05, 0.08)}, field="incoherent", paths={**CHEAP, **paths}))

    few, many = (evaluate_at(scatterers_per_cell=number) for number in (30, 120))
    assert 3 < many.scatterers / few.scatterers < 4  # finer tiles fit the seabed in reach more closely
    assert (
        evaluate_at(beam_cutoff_db=-70).memory > evaluate_at(beam_cutoff_db=-30).memory
    )  # more tiles, hardly more points
    assert evaluate_at(max_reflections=2).seconds > evaluate_at().seconds
    assert 0 < evaluate_at(geometry="slice").scatterers < few.scatterers / 10


def test_disk_is_what_is_written(tmp_path):
    """Sizes of all files of a run with labels and of one without, to a factor of two."""
    scenario = nominal(track={"window": (0.05, 0.08), "pings": 3}, paths=CHEAP, water={"noise_level_db": 40})
    for labels in (False, True):
        folder = record(scenario, tmp_path / f"{labels}.zarr", with_labels=labels)
        written = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
        assert 0.5 < estimate_cost(scenario, labels=labels).disk / written < 2


@pytest.fixture(scope="module")
def scenario():
    """A point of -12 dB ahead at the sonar's depth, over direct paths."""
    paths = {"contributions": ["target"], "max_reflections": 0}
    return nominal(track={"window": (0.07, 0.09), "pings": 2}, targets=[ABEAM], paths=paths)


@pytest.fixture(scope="module")
def recording(scenario):
    """Recording of the scenario."""
    return simulate(scenario)


def numbers_of(page, start):
    """The numbers of the first line of a page that begins so."""
    line = next(line for line in page.split("\n") if line.strip().startswith(start))
    return [float(word) for word in re.findall(r"(?<![\w.])[-+]?\d+\.?\d*(?![\w.])", line)]


def test_the_line_of_an_echo_is_the_sonar_equation(scenario, recording):
    """Delay 2 r / c, distance r, 220 dB - 40 log r - 2 a r + TS, and the columns add up to the last."""
    middle = 2 * SLANT / SOUND_SPEED + scenario.sonar.pulse.duration / 2
    page = explain_sample(recording, 1, middle)
    delay, away, *terms, _phase = numbers_of(page, "80.0000")
    terms = dict(zip(TERMS, terms, strict=True))
    lost = float(scenario.water.absorption(100e3))
    assert delay == pytest.approx(2e3 * SLANT / SOUND_SPEED) and away == pytest.approx(SLANT)
    assert terms["source"] == 220 and terms["scatter"] == pytest.approx(-12, abs=0.06)
    assert terms["spread"] == pytest.approx(-40 * np.log10(SLANT), abs=0.06)
    assert terms["absorb"] == pytest.approx(-2 * lost * SLANT, abs=0.06)
    assert sum(terms[name] for name in TERMS[:-1]) == pytest.approx(terms["level"], abs=0.5)
    recorded = abs(recording["pressure"].sel(time=middle, method="nearest").values[1, 0])
    assert numbers_of(page, "recorded")[0] == pytest.approx(20 * np.log10(recorded), abs=0.06)
    assert terms["level"] == pytest.approx(20 * np.log10(recorded), abs=0.2)


def test_the_page_is_of_the_nearest_sample_and_of_no_other(recording):
    """A third of a sample off, to either side: the same page to the last letter; a whole one: another."""
    time = recording["time"].values
    row = int(np.argmin(np.abs(time - 0.0801)))
    step = time[1] - time[0]
    page = explain_sample(recording, 0, float(time[row]))
    assert explain_sample(recording, 0, float(time[row] + step / 3)) == page
    assert explain_sample(recording, 0, float(time[row] - step / 3)) == page
    assert explain_sample(recording, 0, float(time[row + 1])) != page
    assert f"{time[row] * 1e3:.3f} ms: 1 arrival\n" in page


def test_pings_that_stand_still_have_one_page(recording):
    """Without noise or jitter the second ping differs by its number alone."""
    first, second = (explain_sample(recording, ping, 0.0801) for ping in (0, 1))
    assert first.replace("ping 0", "ping 1") == second


def test_what_stands_behind_a_sample_scales_with_the_source(scenario):
    """6 dB more at the source are 6 dB more of each arrival, and of the mean square."""
    stronger = scenario.model_copy(update={"sonar": scenario.sonar.model_copy(update={"source_level_db": 226.0})})
    quiet, strong = (SampleArrivals(case, 0, 0.0801, 0) for case in (scenario, stronger))
    np.testing.assert_allclose(strong.pressure, quiet.pressure * 10**0.3, rtol=1e-6)
    np.testing.assert_allclose(
        strong.sonar_equation_terms()[:, -1] - quiet.sonar_equation_terms()[:, -1], 6.0, atol=1e-5
    )
    assert strong.mean_square() == pytest.approx(quiet.mean_square() * 10**0.6, rel=1e-6)


def test_the_numbers_of_a_figure_name_the_scenarios_they_came_from(tmp_path, scenario):
    """The digest is that of the scenario's own YAML, so that equal scenarios, and only those, have equal digests."""
    other = scenario.model_copy(update={"seed": 77})
    rows = [CheckedNumber("width", np.float64(1.25), "m", 1.2, 0.1, "theory"), CheckedNumber("given", 3, "dB")]
    path = write_numbers(
        tmp_path / "a.json", 7, "Seven", {"one": scenario, "same": scenario, "other": other}, iter(rows)
    )
    expected = json.loads(path.read_text(encoding="utf-8"))
    assert expected["scenarios"]["one"]["sha256"] == hashlib.sha256(to_yaml(scenario).encode()).hexdigest()
    assert expected["scenarios"]["one"] == expected["scenarios"]["same"] != expected["scenarios"]["other"]
    assert expected["scenarios"]["other"]["seed"] == 77 and expected["figure"] == 7
    assert [(row["value"], row["unit"], row["relation"], row["holds"]) for row in expected["numbers"]] == [
        (1.25, "m", "=", True), (3, "dB", None, None),
    ]  # fmt: skip
