"""Records are columns, checked at the door, and a recording states what its numbers are."""

from dataclasses import fields, replace

import numpy as np
import pytest
import yaml

from insonify.records.arrivals import Arrivals, concatenate_arrivals, no_arrivals
from insonify.simulator import arrivals, build_simulator, simulate
from oracles.scenes import nominal, point

SETTINGS = {
    "targets": [point(0, 150, 19.5)],
    "paths": {"contributions": ["target"]},
    "track": {"window": (0.199, 0.212), "pings": 2},
}


def test_a_recording_states_what_every_number_means():
    """Every variable has units and a long name; the scenario, the seed and the version stand in the attributes."""
    scenario = nominal(title="harbour", seed=5, receive={"steer": (-0.1, 0.1)}, **SETTINGS)
    held = simulate(scenario)
    for name in [*held.data_vars, *held.coords]:
        assert {"units", "long_name"} <= held[name].attrs.keys(), name
    assert held.pressure.dims == ("ping", "channel", "time") and held.pressure.dtype == np.complex64
    assert held.sizes["channel"] == 2
    assert held.attrs["seed"] == 5 and held.attrs["title"] == "harbour"
    assert held.attrs["version"] and held.attrs["centre_frequency"] == 100e3
    assert type(scenario)(**yaml.safe_load(held.attrs["scenario"])) == scenario


def test_an_incoherent_recording_holds_intensity():
    """uPa^2, real, not negative."""
    held = simulate(nominal(field="incoherent", **SETTINGS))
    assert "pressure" not in held and held.intensity.attrs["units"] == "uPa^2"
    assert np.all(held.intensity.values >= 0)


def test_arrivals_joined_are_the_rows_of_all():
    """Rows keep their order; nothing joined is nothing."""
    found = arrivals(nominal(**SETTINGS))
    both = concatenate_arrivals([found, found.take(slice(0, 3))])
    assert len(both) == len(found) + 3 and len(concatenate_arrivals([])) == len(no_arrivals()) == 0
    np.testing.assert_array_equal(both.delay[-3:], found.delay[:3])


def test_the_product_of_the_losses_is_the_amplitude():
    """Spreading, absorption, reflection and scattering of every path off a point and the seabed, out and back."""
    paths = arrivals(
        nominal(paths={"geometry": "slice"}, targets=[point(0, 150, 19.5)], track={"window": (0.2, 0.2022)})
    )
    product = paths.spreading * paths.absorption * paths.scattering_amplitude * np.abs(paths.reflection_coefficient)
    assert len(paths) > 100 and set(paths.object) > {"seabed"}
    np.testing.assert_allclose(np.abs(paths.amplitude), product, rtol=1e-6)


def test_records_refuse_columns_of_unequal_length():
    """Each names the column."""
    found = arrivals(nominal(**SETTINGS))
    columns = {column.name: getattr(found, column.name) for column in fields(Arrivals)}
    with pytest.raises(ValueError, match="object"):
        Arrivals(**{**columns, "object": found.object[:2]})
    simulator = build_simulator(nominal(**SETTINGS))
    here = simulator.ping_geometry(0)
    legs = next(iter(simulator.engine.all_pairs(here))).transmit_legs
    with pytest.raises(ValueError, match="grazing"):
        replace(legs, grazing_sine=legs.grazing_sine[:, :0])


def test_the_page_of_a_lab_notebook():
    """One line an arrival, in order, and how many are left over."""
    page = repr(arrivals(nominal(**SETTINGS))).splitlines()
    assert page[0] == "Arrivals: 25 paths, 200.3-210.2 ms; levels in dB re the source at 1 m, before beams"
    assert page[2].split()[:3] == ["1", "200.321", "ms"] and page[2].endswith("D")
    assert len(page) == 23


def test_a_long_list_is_reported_by_kind():
    """Past forty rows: object, legs, how many, when and how strong; then the ten strongest, in order of arrival."""
    both = {**SETTINGS, "targets": [point(0, 150, 19.5), point(3, 150.2, 15, label="buoy")]}
    paths = arrivals(nominal(**both))
    page = repr(paths).splitlines()
    assert page[0].startswith(f"Arrivals: {len(paths)} paths") and len(paths) == 50
    assert page[0].endswith("dB re the source at 1 m, before beams")
    kinds = [line.split() for line in page[2 : next(n for n, line in enumerate(page) if "strongest, in" in line)]]
    row = next(row for row in kinds if row[:2] == ["buoy", "D-S"])
    legs = np.char.add(paths.transmit_family, paths.receive_family)
    these = np.isin(legs, ("DS", "SD")) & (paths.object == "buoy")
    level = 20 * np.log10(np.abs(paths.amplitude))
    assert int(row[2]) == these.sum() == 2
    assert row[3] == f"{paths.delay[these].min() * 1e3:.2f}-{paths.delay[these].max() * 1e3:.2f}"
    assert float(row[5]) == pytest.approx(level[these].max(), abs=0.051)
    rows = [line.split() for line in page[-10:]]
    assert sorted(float(row[3]) for row in rows) == pytest.approx(np.sort(level)[-10:], abs=0.051)
    assert [float(row[1]) for row in rows] == sorted(float(row[1]) for row in rows)
