"""One scene for two engines, and how far apart what they receive is."""

import numpy as np

from insonify.simulator import levels
from oracles.scenes import nominal

FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": 0.05, "outer_scale": 20.0}
BOX = {"shape": "box", "size": (2.0, 1.0, 1.0), "position": (0.0, 75.5)}


def scene(engine, *, rays=40_000, window=(0.09, 0.12), paths=None, track=None, **changes):
    """The nominal scene for one of the engines, received as an expectation.

    Targets mirror nothing unless requested to.
    """
    chosen = {
        "engine": engine,
        "rays": rays,
        "target_specular_fraction": 0.0,
        "edge_diffraction": "none",
        **(paths or {}),
    }
    return nominal(field="incoherent", paths=chosen, track={"window": window, **(track or {})}, **changes)


def curves(scenario, ping=0):
    """Mean power of every contribution and pair of families over the window, where there is any."""
    found = levels(scenario, ping, threads=2)
    power = 10 ** (found.level_db.values / 10)
    return {
        (str(contribution), str(pair)): power[i, j]
        for i, contribution in enumerate(found.contribution.values) for j, pair in enumerate(found.pair.values)
        if contribution in ("seabed", "surface", "target") and power[i, j].max() > 0
    }  # fmt: skip


def apart_db(expected, traced):
    """Level of the mean of one curve over that of another [dB]."""
    return 10 * np.log10(expected.mean() / traced.mean())
