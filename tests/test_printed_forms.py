"""Objects of the front door are printed as what they are, in few lines, with plurals where there are several."""

import numpy as np

import insonify
from insonify.comparison.result import Comparison, Finding
from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation import eigenrays


def test_a_comparison_is_printed_by_its_verdicts():
    """Not by its arrays of levels, which have a number for each sample."""
    findings = (
        Finding("texture", "different", "3.9 looks, and 1.0 simulated", probability=0.005),
        Finding("level against range", "alike", "within 0.4 dB", probability=0.6),
    )
    levels = np.zeros((500, 2000))
    comparison = Comparison("line.xtf", "line.zarr", findings, (), np.arange(2000.0), (levels, levels))
    assert repr(comparison).splitlines() == [
        "Comparison of line.xtf and line.zarr: 1 of 2 measures differ: texture",
        "  texture              different: 3.9 looks, and 1.0 simulated",
        "  level against range  alike: within 0.4 dB",
    ]


def test_one_path_to_one_point_is_singular():
    """Fermat's straight path in uniform water, and a ray that turns once above a lens of slow water."""
    uniform = SoundSpeedProfile([0.0, 20.0], [1500.0, 1500.0])
    found = eigenrays(uniform, water_depth=20.0, source_depth=11.0, point_depth=19.0, range=150.0, families=["D"])
    assert repr(found).startswith("Eigenrays: 1 path to 1 point\n") and "turn" not in repr(found)
    layered = SoundSpeedProfile([0.0, 8.0, 14.0, 20.0], [1510.0, 1510.0, 1490.0, 1490.0])
    found = eigenrays(layered, water_depth=20.0, source_depth=11.0, point_depth=19.0, range=150.0, families=["D", "S"])
    assert repr(found).startswith("Eigenrays: 2 paths to 1 point\n") and repr(found).count("1 turn, 0 caustics") == 1


def test_a_recording_of_an_instrument_states_format_file_and_pings(tmp_path):
    """And the pings of each group of data."""
    recording = insonify.simulate(insonify.load_template("sidescan"), pings=range(2))
    path = insonify.export(recording, tmp_path / "line.xtf")
    with insonify.open_instrument(path) as file:
        assert repr(file) == "XtfFile: line.xtf, XTF, instrument simulated; port: 2 pings, starboard: 2 pings"


def test_a_live_sonar_counts_its_pings():
    """Before the first and after it."""
    with insonify.live(insonify.load_template("sidescan").with_("paths.contributions", ["target"])) as sonar:
        before = repr(sonar)
        sonar.ping(time=0.0, position=(0.0, 0.0, 12.0))
        assert (before, repr(sonar)) == tuple(
            f"LiveSonar: Sidescan survey, 2 channels, {n} pings so far" for n in (0, 1)
        )
