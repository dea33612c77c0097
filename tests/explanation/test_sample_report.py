"""The arrivals behind a sample add up to the sample."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

from insonify import simulate
from insonify.explanation.sample_report import SampleArrivals, explain_sample
from insonify.paper.nominal_scenario import nominal
from insonify.scenario.scenario import Scenario
from oracles.few_of import few_of

SLICE: dict[str, Any] = {"paths.geometry": "slice", "track.window": [0.19, 0.23]}


def sample(
    scenario: Scenario, time: float, channel: int = 0, ping: int = 0
) -> tuple[SampleArrivals, complex, xr.Dataset]:
    """The arrivals behind a sample, the sample itself, and the recording."""
    data = simulate(scenario)
    row = int(np.argmin(np.abs(data["time"].values - time)))
    name = "pressure" if "pressure" in data else "intensity"
    return (
        SampleArrivals(scenario, ping, float(data["time"][row]), channel),
        data[name].values[ping, channel, row],
        data,
    )


@few_of((0, 2, 4), "time", [0.192, 0.2004, 0.2023, 0.208, 0.22])
@pytest.mark.parametrize("jitter", [0.0, 0.5])
def test_arrivals_in_phase_are_the_recorded_pressure(time: float, jitter: float) -> None:
    """Before the target, in its echo, in its ghosts and in its shadow, with and without jitter."""
    behind, recorded, _ = sample(nominal({**SLICE, "paths.jitter": jitter, "track.pings": 2}), time, ping=1)
    assert abs(behind.pressure.sum() - recorded) < 1e-3 * abs(recorded)


def test_arrivals_in_phase_are_the_recorded_pressure_of_a_steered_beam() -> None:
    """In three dimensions, each channel through its own beams."""
    steer = [0.0, 0.005, 0.02]
    scenario = nominal({"track.window": [0.2, 0.201], "sonar.receive.steer": steer, "paths.max_reflections": 1})
    behind, recorded, _ = sample(scenario, 0.2005, channel=1)
    assert abs(behind.pressure.sum() - recorded) < 1e-3 * abs(recorded)


def test_arrivals_in_phase_are_the_compressed_pressure() -> None:
    """A swept pulse and its matched filter."""
    pulse = {"sonar.pulse.kind": "lfm", "sonar.pulse.bandwidth": 15e3, "sonar.receiver.matched_filter": True}
    behind, recorded, _ = sample(nominal({**SLICE, **pulse}), 0.2004)
    assert abs(behind.pressure.sum() - recorded) < 1e-3 * abs(recorded)


def test_groups_as_energies_are_the_expected_intensity() -> None:
    """The incoherent reading of the same sample."""
    behind, recorded, _ = sample(nominal({**SLICE, "field": "incoherent"}), 0.2023)
    assert behind.mean_square() == pytest.approx(float(recorded.real), rel=1e-3)


@pytest.mark.parametrize("sub_bands", [1, 3])
def test_the_terms_add_up_to_the_level(sub_bands: int) -> None:
    """Source level, beams, spreading, absorption, bounces, scattering and pulse: decibels add."""
    behind, _, _ = sample(
        nominal({**SLICE, "paths.amplitude_perturbation": 0.3, "sonar.receiver.sub_bands": sub_bands}), 0.2023
    )
    terms = behind.sonar_equation_terms()
    received = np.isfinite(terms).all(axis=1)
    assert received.sum() > 1000
    np.testing.assert_allclose(terms[received, :-1].sum(axis=1), terms[received, -1], atol=1e-4)


def test_the_terms_are_those_of_the_sonar_equation() -> None:
    """A point on the axis, direct: -20 log10 of both paths, no beam loss, its target strength."""
    point = {"shape": "point", "label": "point", "position": [0, 150, 11], "target_strength_db": -12.0}
    changes = {
        "targets": [point],
        "paths.contributions": ["target"],
        "paths.max_reflections": 0,
        "paths.geometry": "3d",
    }
    behind, _, _ = sample(nominal({**SLICE, **changes}), 0.2001)
    ((source, sent, received, spread, relative_absorption, bounced, scattered, pulse, level),) = (
        behind.sonar_equation_terms()
    )
    assert (source, sent, received) == pytest.approx((220.0, 0.0, 0.0), abs=1e-6)
    assert spread == pytest.approx(-40 * np.log10(150.0), abs=1e-6)
    loss = float(behind.simulator.scenario.water.absorption(100e3))
    assert relative_absorption == pytest.approx(-300 * loss, abs=1e-6)
    assert bounced == 0.0
    assert scattered == pytest.approx(-12.0, abs=1e-4)
    assert level == pytest.approx(220 - 40 * np.log10(150.0) - 300 * loss - 12 + pulse, abs=1e-4)


def test_the_page_names_what_is_received() -> None:
    """Object, pair, counts, and both sums, which agree to a tenth of a decibel."""
    _, _, data = sample(nominal(SLICE), 0.2023)
    page = explain_sample(data, 0, 0.2023)
    assert "box D-S: " in page
    assert "seabed S-S: " in page
    together, recorded = (next(line for line in page.splitlines() if line.startswith(name)).split()[-5]
                          for name in ("all arrivals", "recorded"))  # fmt: skip
    assert together == recorded


def test_noise_is_listed_apart() -> None:
    """With noise the difference is named so, and is about as strong as the noise."""
    _, _, data = sample(nominal({**SLICE, "water.noise_level_db": 20.0}), 0.2)
    (line,) = (line for line in explain_sample(data, 0, 0.2).splitlines() if line.startswith("difference"))
    assert "noise" in line
    assert float(line.split()[-5]) == pytest.approx(20 + 10 * np.log10(21e3), abs=12)


@pytest.mark.parametrize("sub_bands", [1, 3])
def test_a_sample_without_arrivals_has_a_page(sub_bands: int) -> None:
    """A sample before all echoes."""
    nothing = {"targets": [], "paths.contributions": ["target"], "sonar.receiver.sub_bands": sub_bands}
    quiet = simulate(nominal({**SLICE, **nothing}))
    page = explain_sample(quiet, 0, 0.2)
    assert "no arrivals" in page and "recorded: " in page
    assert "inf" not in page


def test_a_recording_without_its_scenario_cannot_be_explained() -> None:
    """The message states why."""
    with pytest.raises(ValueError, match="does not hold its scenario"):
        explain_sample(xr.Dataset(attrs={"scenario": ""}), 0, 0.2)


def test_a_ping_that_is_not_there_cannot_be_explained() -> None:
    """The message reports it, before any path is looked for."""
    data = simulate(nominal(SLICE))
    data["pressure"][:] = np.nan
    with pytest.raises(ValueError, match="not simulated yet"):
        explain_sample(data, 0, 0.2)


def test_the_page_states_why_it_describes_a_beam() -> None:
    """The strongest of several; requested by number, no reason is given."""
    steer = [0.0, 0.02]
    data = simulate(nominal({"track.window": [0.2, 0.201], "sonar.receive.steer": steer, "paths.max_reflections": 0}))
    assert "beam 0 (+0 deg, the strongest of 2)" in explain_sample(data, 0, 0.2005)
    assert "beam 1 (+1.14592 deg)" in explain_sample(data, 0, 0.2005, channel=1)


def test_the_page_states_what_its_distances_are() -> None:
    """Of a box 150 m away: its first corner straight from the receiver, and in words."""
    _, _, data = sample(nominal(SLICE), 0.2005)
    page = explain_sample(data, 0, 0.2005)
    assert "distance: straight from the receiver" in page
    row = next(line for line in page.splitlines() if " D   D " in line).split()
    assert float(row[3]) == pytest.approx(750 * float(row[0]) / 1e3, abs=0.01)


def test_what_bends_around_a_target_has_its_own_column() -> None:
    """Behind the box with soft edges: levels still add up, the scatter column is free of the edges' loss."""
    scenario = nominal({**SLICE, "paths.edge_diffraction": "knife-edge", "paths.max_reflections": 0})
    behind, recorded, data = sample(scenario, 0.208)
    # the face is 60 dB stronger, and its filter rings for longer than it is followed
    assert abs(behind.pressure.sum() - recorded) < 0.05 * abs(recorded)
    edges = behind.extra_columns()["edges"]
    bed = behind.paths.object == "seabed"
    assert edges[bed].max() < -3
    terms = behind.sonar_equation_terms()
    scattered = 20 * np.log10(behind.paths.scattering_amplitude)
    np.testing.assert_allclose(terms[:, 6] - edges, scattered.ravel(), atol=1e-4)
    page = explain_sample(data, 0, 0.208).splitlines()
    assert "edges" in page[2] and any(line.startswith("edges: ") for line in page)


def test_columns_of_nothing_are_left_out() -> None:
    """Hard edges, no caustics: the page has the columns that it always had."""
    behind, _, data = sample(nominal(SLICE), 0.2023)
    assert behind.extra_columns() == {}
    assert "caustic" not in explain_sample(data, 0, 0.2023) and "edges" not in explain_sample(data, 0, 0.2023)


def test_the_page_states_what_further_rays_off_a_moving_surface_are() -> None:
    """Glints of a rough sea, bounce points of a swell that is drawn."""
    for surface, scenario in (
        ({"surface.reflection": "statistical", "surface.wind_speed": 3.0}, "is a glint"),
        ({"surface.reflection": "explicit", "surface.swell": {"height": 0.1, "length": 30.0}}, "another bounce point"),
    ):
        _, _, data = sample(
            nominal({"track.window": [0.2, 0.203], "paths.contributions": ["target"], **surface}), 0.2023
        )
        note = next(line for line in explain_sample(data, 0, 0.2023).splitlines() if line.startswith("bounce: "))
        assert scenario in note
