"""Where scenarios are pushed to their ends: long pulses, odd labels, runs that collide."""

from pathlib import Path

import numpy as np
import pytest

from insonify.formats import zarr_store
from insonify.recording_run import record
from insonify.scenario.attributes import attributes
from insonify.scenario.load import parse_model
from insonify.scenario.recording_layout import recording_layout
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.simulator import build_simulator, simulate
from oracles.scenes import nominal


@pytest.mark.parametrize("duration", [0.02, 0.2])
def test_a_long_pulse_is_as_strong_however_densely_the_bed_is_sampled(duration: float) -> None:
    """Five points a cell and a hundred differ by less than 0.1 dB: cells never outgrow the water they lie under."""
    pulse = {"kind": "cw", "frequency": 100e3, "duration": duration}

    def received(per_cell: float) -> np.ndarray:
        scenario = nominal(
            sonar={"pulse": pulse},
            paths={"max_reflections": 0, "scatterers_per_cell": per_cell},
            track={"window": (0.04, 0.2)},
            field="incoherent",
        )
        return simulate(scenario).intensity.values[0, 0]

    np.testing.assert_allclose(10 * np.log10(received(5) / received(100)), 0, atol=0.1)


@pytest.mark.parametrize("label", ["1e3", "12", "no", "null", "~", "a: b", "-", "wreck\x85", "ω 3"])
def test_any_label_survives_the_recording(label: str) -> None:
    """What the attributes state is read back as it was, also where YAML would make a number or a word of it."""
    scenario = nominal(box={"label": label})
    assert parse_model(Scenario, to_yaml(scenario)) == scenario


def test_a_run_stops_when_another_has_replaced_its_recording(tmp_path: Path) -> None:
    """The recording has an identity; a ping meant for one is not written into another."""
    scenario = nominal(track={"window": (0.1, 0.101), "pings": 2})
    place = tmp_path / "two.zarr"
    record(scenario, place, pings=[0])
    mine = zarr_store.identity(place)
    other = scenario.model_copy(update={"seed": 2})
    simulator = build_simulator(other)
    layout = recording_layout(other, simulator.platforms, simulator.grid.time)
    zarr_store.create_recording(place, layout, attributes(other), overwrite=True)
    data = simulate(scenario, pings=[1]).pressure.values[0]
    with pytest.raises(zarr_store.StoreError, match="replaced by another run"):
        zarr_store.write_ping(place, 1, data, into=mine)
    assert not zarr_store.recorded_pings(place).any()


def test_what_is_not_finite_is_never_recorded(tmp_path: Path) -> None:
    """A NaN is refused, and the ping stays undone."""
    scenario = nominal(track={"window": (0.1, 0.101)})
    place = tmp_path / "one.zarr"
    simulator = build_simulator(scenario)
    layout = recording_layout(scenario, simulator.platforms, simulator.grid.time)
    zarr_store.create_recording(place, layout, attributes(scenario))
    with pytest.raises(ValueError, match="not finite"):
        zarr_store.write_ping(place, 0, np.full((1, simulator.grid.sample_count), np.nan))
    assert not zarr_store.recorded_pings(place).any()


@pytest.mark.parametrize(
    "track", [{"window": (0.0, 1e300)}, {"position": (1e300, 0.0, 11.0)}, {"interval": 1e300}, {"window": (0.0, 200.0)}]
)
def test_numbers_beyond_the_sea_are_refused(track: dict[str, object]) -> None:
    """Windows past 100 s, places past 10 000 km: reported at the door, not found as silence later."""
    with pytest.raises(ValueError, match=r"latest stop|longest|1e\+300 (m|s) is out of range .* to 10{6,7} "):
        nominal(track=track)
