"""A claim about synthetic relief: it stays below the sea surface."""

import pytest

from oracles.scenes import nominal


@pytest.mark.parametrize(
    "relief",
    [
        {"kind": "power-law", "hurst": 0.8, "rms": 8.0, "outer_scale": 20.0},
        {"kind": "ripples", "wavelength": 200.0, "height": 50.0},
    ],
)
def test_relief_higher_than_the_water_is_deep_is_refused(relief):
    """20 m of water; the same shape at a hundredth of its height passes."""
    settings = {"track": {"window": (0.0, 0.05)}, "targets": []}
    with pytest.raises(ValueError, match=r"seabed\.relief: rises .* above its mean plane .*the water is 20 m deep"):
        nominal(seabed={"relief": relief}, **settings)
    low = {key: value / 100 if key in ("rms", "height") else value for key, value in relief.items()}
    assert nominal(seabed={"relief": low}, **settings).seabed.relief
