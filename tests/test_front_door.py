"""Claims about the names at the top: a scenario is built, copied, swept, shown and pickled in Python alone."""

import pickle

import numpy as np
import pytest

import insonify
from insonify import scene, sonar
from insonify.ocean import Water


@pytest.fixture
def built():
    """A sonar 11 m deep, a box 30 m away, direct paths, a short window."""
    array = sonar.LineArray(length="0.5 m")
    return insonify.Scenario(
        title="Box <1>",
        water=Water(sound_speed="1490 m/s"),
        seabed=scene.Seabed(depth="20 m"),
        surface=scene.Surface(),
        targets=(scene.Box(label="box", position=("0 m", "30 m"), size=(1, 1, 1)),),
        sonar=sonar.Sonar(
            source_level_db=210, pulse=sonar.Pulse(kind="cw", frequency="100 kHz", duration="0.2 ms"),
            transmit=array, receive=array, receiver=sonar.Receiver(), mounting=sonar.Mounting(bearing="90 deg"),
        ),
        track=sonar.StaticTrack(position=(0, 0, 11), pings=1, interval=1, window=("40 ms", "44 ms")),
        paths=insonify.PathSettings(max_reflections=0),
    )  # fmt: skip


@pytest.mark.parametrize("package", [insonify, scene, sonar])
def test_every_public_name_is_there(package):
    """Loaded when first used, and listed."""
    assert set(package.__all__) <= set(dir(package))
    for name in package.__all__:
        assert getattr(package, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'Bax'"):
        _ = package.Bax


def test_a_scenario_is_built_recorded_and_opened(built, tmp_path):
    """`record` writes what `open_recording` reads, the same as `simulate` gives in memory."""
    store = insonify.record(built, tmp_path / "box.zarr")
    np.testing.assert_array_equal(insonify.open_recording(store).pressure, insonify.simulate(built).pressure)


def test_a_part_is_text_or_a_part(built, tmp_path):
    """Both record the same pings; text that is no part gives the same advice wherever parts are taken."""
    scenario, parts = built.with_("track.pings", 5), ("2/3", insonify.Part(2, 3))
    stores = [insonify.record(scenario, tmp_path / f"{k}.zarr", part=part) for k, part in enumerate(parts)]
    for store in stores:
        assert insonify.open_recording(store).done.values.tolist() == [False, True, True, False, False]
    for wrong in ("3/2", 3):
        for simulate in (
            lambda part: insonify.record(scenario, tmp_path / "c.zarr", part=part),
            lambda part: next(insonify.dataset(tmp_path / "absent.yaml", part=part)),
            lambda part: insonify.datasets.make_dataset(tmp_path / "absent.yaml", tmp_path, part=part),
        ):
            with pytest.raises(ValueError, match=rf"{wrong} is no part of a job; (parts are 1/2|write its number)"):
                simulate(wrong)


def test_a_sweep_and_a_pickle_are_scenarios_of_their_own(built):
    """Three ranges by `with_`; the original is as it was; a pickled copy is equal and its echo bit-identical."""
    swept = [built.with_("targets.0.position", [0, far]) for far in (28, 30, 32)]
    assert [one.targets[0].position[1] for one in swept] == [28, 30, 32] and built.targets[0].position[1] == 30
    copy = pickle.loads(pickle.dumps(built))
    assert copy == built
    np.testing.assert_array_equal(insonify.simulate(copy).pressure, insonify.simulate(built).pressure)


def test_a_scenario_shows_what_was_given(built):
    """`repr` has the given values only and is short; notebooks get the file, escaped."""
    text = repr(built)
    assert "sound_speed=1490.0" in text and "salinity" not in text and len(text) < 1200
    page = built._repr_html_()
    assert "Box &lt;1&gt;" in page and "sound_speed: 1490" in page and "<1>" not in page
