"""Claims about pages on recordings of elements and of the tracer."""

import numpy as np
import pytest

from insonify import simulate
from insonify.cli import main
from insonify.explanation.formed_beam import formed_beam
from insonify.explanation.sample_report import SampleArrivals, explain_sample
from insonify.processing import beam_recording
from insonify.scenario.write import to_yaml
from oracles.arrays import elements_scenario
from oracles.scenes import nominal


def elements():
    """Two points at one range, 20 deg apart, received by a line of 16 elements that faces starboard."""
    places = [(30 * np.cos(a), 30 * np.sin(a), 10.0) for a in np.radians([80, 100])]
    track = {"kind": "static", "position": (0, 0, 10), "heading": 0.0, "window": (0.035, 0.045), "speed": None}
    scenario = elements_scenario(places, receive={"kind": "line", "length": 0.24, "elements": 16})
    return scenario.with_("track", {key: value for key, value in track.items() if value is not None})


@pytest.fixture(scope="module")
def received():
    """One ping of it."""
    return simulate(elements())


def lines_of(page, start):
    """Lines of a page that begin with a word."""
    return [line for line in page.splitlines() if line.startswith(start)]


@pytest.mark.parametrize(("bearing", "label", "other"), [(80.0, "t0", "t1"), (100.0, "t1", "t0")])
def test_a_bearing_separates_two_points_at_one_range(received, bearing, label, other):
    """In the beam towards it a point keeps its level, and the other one is a side lobe; a single element has both."""
    scenario = elements()
    level = np.abs(received["pressure"].values[0]).max(axis=0)
    time = float(received["time"][int(level.argmax())])
    mixed = SampleArrivals(scenario, 0, time, 8)
    formed = formed_beam(received, scenario, 0, np.radians(bearing))
    behind = SampleArrivals(scenario, 0, time, formed.reference, formed=formed)

    def strongest(one, name_of):
        return 20 * np.log10(np.abs(one.pressure[one.paths.object == name_of]).max())

    assert abs(strongest(mixed, label) - strongest(mixed, other)) < 1.5
    assert strongest(behind, label) == pytest.approx(strongest(mixed, label), abs=1.0)
    assert strongest(behind, label) - strongest(behind, other) > 10
    page = explain_sample(received, 0, time, bearing=np.radians(bearing))
    assert f"towards {bearing:+g} deg from the bow" in page
    assert page.index(f"{label} D-D") < page.index(f"{other} D-D") if f"{other} D-D" in page else True


def test_arrivals_in_the_beam_add_up_to_the_beam_of_the_recording(received):
    """Against delay and sum of all elements: the direct echo of a point, within 0.3 dB."""
    scenario = elements()
    formed = formed_beam(received, scenario, 0, np.radians(80))
    beam = beam_recording(received, [formed.bearing], sound_speed=scenario.water.sound_speed)["pressure"].values[0, 0]
    row = int(np.abs(beam).argmax())
    time = float(received["time"][row])
    behind = SampleArrivals(scenario, 0, time, formed.reference, formed=formed)
    assert formed.recorded(received["pressure"].isel(ping=0), time) == pytest.approx(complex(beam[row]), rel=1e-4)
    assert abs(20 * np.log10(abs(behind.pressure.sum()) / abs(beam[row]))) < 0.3
    terms = behind.sonar_equation_terms()
    near = np.isfinite(terms).all(axis=1)
    np.testing.assert_allclose(terms[near, :-1].sum(axis=1), terms[near, -1], atol=1e-4)


def test_a_bearing_of_beams_is_refused():
    """They are formed already."""
    with pytest.raises(ValueError, match="this one is of beams"):
        explain_sample(
            simulate(nominal(paths={"geometry": "slice"}, track={"window": (0.1, 0.11)})), 0, 0.105, bearing=0.1
        )


TRACED = {"engine": "tracer", "rays": 5_000, "edge_diffraction": "none"}


def test_a_page_of_the_tracer_names_contributions_and_pairs(tmp_path, capsys):
    """Energies of rays, and a total equal to the sample; on the command line as well."""
    scenario = nominal(box={"position": (0, 83)}, field="incoherent", paths=TRACED, track={"window": (0.108, 0.114)})
    traced = simulate(scenario)
    time = 0.1107
    page = explain_sample(traced, 0, time)
    assert lines_of(page, "  target") and lines_of(page, "  seabed") and "engine: eigenrays" in page
    total, recorded = (float(lines_of(page, name)[0].split()[-5]) for name in ("all contributions", "recorded"))
    assert total == pytest.approx(recorded, abs=0.1)
    (tmp_path / "traced.yaml").write_text(to_yaml(scenario))
    folder = str(tmp_path / "traced.zarr")
    assert main(["run", str(tmp_path / "traced.yaml"), "-o", folder, "--quiet"]) == 0
    capsys.readouterr()
    assert main(["explain", folder, "--time", "110.7 ms"]) == 0
    assert capsys.readouterr().out.strip() == page
    assert main(["explain", folder, "--time", "110.7 ms", "--bearing", "5 deg"]) == 2
    assert "--bearing 5 deg" in capsys.readouterr().err


def test_a_page_of_the_tracer_names_the_paths_that_it_can():
    """A surface return and a point target by their names and times; where nothing arrives, so it states."""
    there = {"shape": "point", "label": "pole", "position": (0.0, 21.0, 19.0), "target_strength_db": 20.0}
    paths = {**TRACED, "rays": 1000, "contributions": ["target", "boundary echo"]}
    track = {"window": (0.01, 0.04)}
    traced = simulate(nominal(targets=[there], field="incoherent", paths=paths, track=track))
    assert "boundary echo by S: arrives at 14.667 ms" in explain_sample(traced, 0, 0.01472)
    delay = 2 * np.hypot(21.0, 8.0) / 1500
    page = explain_sample(traced, 0, delay + 5e-5)
    assert f"pole by D-D: arrives at {delay * 1e3:.3f} ms" in page and "pole" not in explain_sample(traced, 0, 0.0147)
    silent = simulate(nominal(field="incoherent", paths={**paths, "contributions": ["target"]}, track=track))
    assert "nothing arrives" in explain_sample(silent, 0, 0.02)


@pytest.mark.parametrize("bearing", [90, 60, 12])
def test_arrivals_of_a_sweep_add_up_in_beams_far_off_broadside(bearing):
    """Two points 60 deg apart, a sweep of 20 kHz over 24 cm: the sum is the beam's sample within -50 dB of an element.

    Across the array sound from the side is late by 1.6 periods of the band, which a phase alone does not describe.
    """
    places = [(30 * np.cos(a), 30 * np.sin(a), 10.0) for a in np.radians([20, 80])]
    pulse = {"kind": "lfm", "frequency": 100e3, "duration": 0.5e-3, "bandwidth": 20e3}
    scenario = elements().with_({"targets": elements_scenario(places).targets, "sonar.pulse": pulse})
    recording = simulate(scenario)
    formed = formed_beam(recording, scenario, 0, np.radians(bearing))
    element = np.abs(recording["pressure"].values).max()
    for time in recording["time"].values[np.searchsorted(recording["time"], [0.0401, 0.0403])]:
        behind = SampleArrivals(scenario, 0, float(time), formed.reference, formed=formed)
        recorded = formed.recorded(recording["pressure"].isel(ping=0), float(time))
        assert abs(behind.pressure.sum() - recorded) < 10 ** (-50 / 20) * element
