"""Records are columns, checked at the door, and a recording says what its numbers are."""

from dataclasses import fields, replace

import numpy as np
import pytest
import yaml

from insonify.records.arrivals import Arrivals, joined, nothing
from insonify.simulation import arrivals, prepare, simulate
from oracles.scenes import nominal, point

TOLD = {
    "targets": [point(0, 150, 19.5)],
    "paths": {"causes": ["target"]},
    "track": {"window": (0.199, 0.212), "pings": 2},
}


def test_a_recording_says_what_every_number_means():
    """Every variable has units and a long name; the scenario, the seed and the version stand in the attributes."""
    scenario = nominal(title="harbour", seed=5, receive={"steer": (-0.1, 0.1)}, **TOLD)
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
    held = simulate(nominal(field="incoherent", **TOLD))
    assert "pressure" not in held and held.intensity.attrs["units"] == "uPa^2"
    assert np.all(held.intensity.values >= 0)


def test_arrivals_joined_are_the_rows_of_all():
    """Rows keep their order; nothing joined is nothing."""
    found = arrivals(nominal(**TOLD))
    both = joined([found, found.take(slice(0, 3))])
    assert len(both) == len(found) + 3 and len(joined([])) == len(nothing()) == 0
    np.testing.assert_array_equal(both.delay[-3:], found.delay[:3])


def test_records_refuse_columns_of_unequal_length():
    """Each names the column."""
    found = arrivals(nominal(**TOLD))
    columns = {column.name: getattr(found, column.name) for column in fields(Arrivals)}
    with pytest.raises(ValueError, match="owner"):
        Arrivals(**{**columns, "owner": found.owner[:2]})
    listening = prepare(nominal(**TOLD))
    here = listening.stance(0)
    legs = next(iter(listening.engine.all_pairs(here))).out
    with pytest.raises(ValueError, match="grazing"):
        replace(legs, grazing=legs.grazing[:, :0])


def test_the_page_of_a_lab_notebook():
    """One line an arrival, in order, and how many are left over."""
    page = repr(arrivals(nominal(**TOLD))).splitlines()
    assert page[0] == "Arrivals: 25 paths, 200.3-210.2 ms"
    assert page[2].split()[:3] == ["1", "200.321", "ms"] and page[2].endswith("D")
    assert len(page) == 23
