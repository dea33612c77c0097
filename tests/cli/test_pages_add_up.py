"""Printed tables add up, line by line, and agree with what is stored and drawn."""

import re
from pathlib import Path

import numpy as np
import pytest

from insonify.cli import main
from insonify.formats.label_store import open_labels
from insonify.formats.zarr_store import open_recording
from insonify.scenario.load import load_scenario
from insonify.simulator import labels, simulate
from oracles.few_of import few_of

QUAY = """
seed: 7
water: {sound_speed: 1500, noise_level_db: null}
seabed: {depth: 20 m, reflection: 0.35}
targets:
  - {shape: point, label: buoy, position: [0 m, 60 m, 18 m], target_strength_db: 18}
  - {shape: point, label: float, position: [0 m, 62 m, 15 m], target_strength_db: 12}
sonar:
  source_level_db: 220
  pulse: {kind: cw, frequency: 100 kHz, duration: 0.2 ms}
  transmit: {kind: line, length: 0.3 m}
  receive: {kind: line, length: 0.3 m}
track: {kind: static, position: [0, 0, 11 m], window: [79 ms, 100 ms], pings: 2}
paths: {geometry: slice, max_reflections: 2}
"""
NUMBER = r"(-?\d+\.?\d*)"


@pytest.fixture(scope="module")
def quay(tmp_path_factory):
    """A folder with a short recording of two points over a bed, labelled."""
    here = tmp_path_factory.mktemp("quay")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(here)
        Path("quay.yaml").write_text(QUAY, encoding="utf-8")
        assert main(["run", "quay.yaml", "-o", "quay.zarr", "--labels", "--quiet"]) == 0
    return here


def page(quay, capsys, time, *more):
    """Lines of `explain` at a time."""
    capsys.readouterr()
    assert main(["explain", str(quay / "quay.zarr"), "--time", time, *more]) == 0
    return capsys.readouterr().out.splitlines()


def rows(lines):
    """Head of the table, and the numbers of its rows: delay, distance, and all columns after the families."""
    head = next((line for line in lines if line.lstrip().startswith("delay ")), "").split()
    found = [line.split() for line in lines if re.match(r"^\s+\d+\.\d{4} [A-Z]", line)]
    return head, [(row[1], row[2], np.array([row[0], *row[3:]], float)) for row in found]


@pytest.mark.parametrize("time", ["80.2 ms", "82.1 ms", "83.3 ms"])
def test_each_row_is_a_sonar_equation_that_adds_up(quay, capsys, time):
    """Nine terms rounded to 0.1 dB: the last is the sum of the others within 0.45 dB, the worst of eight roundings."""
    head, found = rows(page(quay, capsys, time))
    assert head[4:-1] == ["source", "t", "beam", "r", "beam", "spread", "absorb", "bounce", "scatter", "pulse", "level"]
    assert found
    for _, _, numbers in found:
        terms = numbers[2:11]
        assert terms[0] == 220.0
        assert terms[:8].sum() == pytest.approx(terms[8], abs=0.45)


@few_of((0, 3, 4), "pair", ["D-D", "S-D", "B-D", "SB-S", "D-BS"])
@pytest.mark.parametrize(("label", "across", "depth", "strength"), [("buoy", 60, 18, 18), ("float", 62, 15, 12)])
def test_each_row_is_a_path_of_images(quay, capsys, label, across, depth, strength, pair):
    """Delay, distance, spreading, reflections and strength of a row are those of straight ways to two images."""
    image = {"D": 11.0, "S": -11.0, "B": 29.0, "SB": 51.0, "BS": -29.0}
    out, back = pair.split("-")
    length = [np.hypot(across, depth - image[family]) for family in (out, back)]
    late = sum(length) / 1.5
    found = rows(page(quay, capsys, f"{late + 0.1:.3f} ms"))[1]
    same = [one for *ways, one in found if ways == [out, back] and abs(one[0] - late) < 2e-4]  # as printed: 0.1 us
    (numbers,) = [one for one in same if abs(one[8] - strength) < 0.051]
    assert numbers[1] == pytest.approx(np.hypot(across, depth - 11), abs=0.006)
    assert numbers[5] == pytest.approx(-20 * np.log10(length[0] * length[1]), abs=0.051)
    assert numbers[7] == pytest.approx(20 * np.log10(0.35) * pair.count("B"), abs=0.051)


@pytest.mark.parametrize("time", ["79.6 ms", "80.2 ms", "82.1 ms"])
def test_the_verdict_is_the_sample_that_is_stored(quay, capsys, time):
    """The recorded level is 20 log10 of the stored pressure to 0.05 dB, the sum as near, the rest far below."""
    stored = open_recording(quay / "quay.zarr")["pressure"].isel(ping=1, channel=0)
    when = float(time.split()[0]) / 1e3
    level = float(20 * np.log10(np.abs(stored.sel(time=when, method="nearest"))))
    lines = page(quay, capsys, time, "--ping", "1")
    settings = {line.split(" ")[0].rstrip(":,"): re.findall(NUMBER, line)[0] for line in lines[-3:]}
    assert lines[0].startswith("ping 1, ")
    assert float(settings["recorded"]) == pytest.approx(level, abs=0.051)
    assert float(settings["all"]) == pytest.approx(level, abs=0.12)
    assert float(settings["difference"]) < level - 30


def test_counts_of_the_kinds_are_all_that_the_head_counts(quay, capsys):
    """Arrivals of each object and pair, and of the others, are together those of the first line."""
    lines = page(quay, capsys, "82.1 ms")
    total = int(re.search(r"(\d+) arrivals", lines[0])[1])
    kinds = [int(re.search(r": (\d+) arrival", line)[1]) for line in lines[1:] if re.search(r": \d+ arrival", line)]
    assert sum(kinds) == total > 10


def test_what_is_run_is_what_is_simulated(quay):
    """Sound, labels and scenario of the command are those of Python, bit for bit.

    But intensities and angles of labels, stored to 2^-13 of themselves (half of 0.001 dB), and positions and distances,
    stored to half a millimetre.
    """
    scenario = load_scenario(quay / "quay.yaml")
    stored, written = open_recording(quay / "quay.zarr"), open_labels(quay / "quay.zarr")
    fresh, computed = simulate(scenario), labels(scenario, 1)
    np.testing.assert_array_equal(stored["pressure"].values, fresh["pressure"].values)
    for name in computed.data_vars:
        loaded, expected = written[name].isel(ping=1).values, computed[name].values
        units = computed[name].attrs.get("units")
        if units in ("uPa^2", "rad"):
            np.testing.assert_allclose(loaded, expected, rtol=1.0001 * 2.0**-13)
        elif units == "m":
            np.testing.assert_allclose(loaded, expected, atol=0.501e-3)
        else:
            np.testing.assert_array_equal(loaded, expected)
    assert stored.attrs["scenario"] == fresh.attrs["scenario"]


def test_showing_and_explaining_leave_the_recording_as_it_was(quay, capsys):
    """No byte of it changes, and the same picture comes out twice."""

    def content():
        folder = quay / "quay.zarr"
        return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    before, pictures = content(), []
    for name in ("one.png", "two.png"):
        assert main(["show", str(quay / "quay.zarr"), "-o", str(quay / name), "--ping", "0"]) == 0
        pictures.append((quay / name).read_bytes())
    page(quay, capsys, "82.1 ms")
    assert content() == before
    assert pictures[0] == pictures[1]
