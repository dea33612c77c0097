"""Boundary echoes of the tracer: those of the eigenray engine, which finds them by other code."""

import numpy as np
import pytest

from insonify.simulator import levels
from oracles.traced import apart_db, scene

SAND = {"scattering": {"law": "jackson", "sediment": "medium sand"}}


def echo_curves(engine, *, families, window, **changes):
    """Expected power of every boundary echo and of all together over the window [uPa^2]."""
    paths = {"families": families, "contributions": ["boundary echo"], "max_reflections": 3}
    found = levels(scene(engine, rays=100, window=window, paths=paths, **changes), threads=1).level_db
    power = 10 ** (found.sel(contribution="boundary echo") / 10)
    return {str(pair): power.sel(pair=pair).values for pair in power.pair.values if power.sel(pair=pair).max() > 0}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"seabed": {"reflection": 0.6, "depth": 15.0}},
        {"seabed": SAND, "sonar": {"pulse": {"frequency": 2e4, "duration": 1e-3}}},
        {"receive": {"offset": (0.0, 0.0, -0.1)}},
        {"transmit": {"kind": "planar", "length": None, "width": 0.3, "height": 0.06}},
        {"water": {"noise_level_db": None, "profile": [[0, 1530], [12, 1500], [20, 1496]]}},
    ],
    ids=["nominal", "shoal", "rough sand", "arrays apart", "planar", "layered"],
)
def test_boundary_echoes_of_the_tracer_are_those_of_the_engine(changes):
    """S, B, BS, SB, SBS and BSB over 40 ms: every sample that is not 60 dB down within 0.02 dB.

    All together likewise, or, where BS and SB arrive at different times and overlap, their mean within 0.1 dB.
    """
    families = ["D", "S", "B", "SB", "BS", "SBS", "BSB"]
    ours, theirs = (
        echo_curves(engine, families=families, window=(0.005, 0.045), **changes) for engine in ("tracer", "eigenrays")
    )
    assert set(ours) == set(theirs) == {"all", "S", "B", "BS", "SB", "SBS", "BSB"}
    for name, traced in theirs.items():
        strong = traced > 1e-6 * traced.max()
        if name == "all" and "receive" in changes:
            assert apart_db(ours[name], traced) == pytest.approx(0.0, abs=0.02)
            overlap = traced * (theirs["BS"] > 1e-3 * theirs["BS"].max())
            assert apart_db(ours[name] * (overlap > 0), overlap) == pytest.approx(0.0, abs=0.1)
            continue
        np.testing.assert_allclose(10 * np.log10(ours[name][strong] / traced[strong]), 0.0, atol=0.02, err_msg=name)


def test_a_box_overhead_hides_the_surface_from_the_tracer():
    """A slab between the sonar and the surface leaves no S, and the others as they were."""
    slab = {"shape": "box", "size": (20.0, 20.0, 1.0), "position": (0.0, 0.0), "base_depth": 6.0}
    free, hidden = (
        echo_curves("tracer", families=["D", "S", "B"], window=(0.005, 0.02), targets=targets)
        for targets in ([], [slab])
    )
    assert "S" in free and "S" not in hidden
    np.testing.assert_array_equal(hidden["B"], free["B"])
