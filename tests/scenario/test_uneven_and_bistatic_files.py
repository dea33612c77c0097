"""Scenario files with uneven water, bistatic receivers and scattering layers: round trips, citations, warnings."""

import warnings

import pytest

from insonify.scenario.bistatic_errors import CLOCK, with_transmitter_clock
from insonify.scenario.citations import FIELD, NOISE, PATCHY, SURFACE_NOISE, SUSPENDED, citations
from insonify.scenario.inhomogeneity_warnings import SHARED, inhomogeneity_warnings
from insonify.scenario.load import parse_model
from insonify.scenario.write import to_yaml
from insonify.validity import PhysicsWarning
from oracles.arrays import WINDOW, elements_scenario

WAY = 1500 * WINDOW[1] / 2
WAVELENGTH = 1500 / 100e3


def scene(water=None, **top):
    """Elements in silent water, whatever the settings."""
    plain = {"sound_speed": 1500.0, "absorption_db_per_m": 0.0, "noise_level_db": None}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        return elements_scenario([(0.0, 30.0, 8.0)], water={**plain, **(water or {})}, **top)


def uneven(length, *, receive=None, rms=1e-4, record="elements"):
    """Cautions of such water."""
    settings = {"inhomogeneity": {"rms_index": rms, "correlation_length": length}}
    return inhomogeneity_warnings(scene(settings, receive=receive, receiver={"record": record}))


def test_inhomogeneities_smaller_than_a_fresnel_zone_are_reported():
    """4 R / (k l^2) = 1 at l = sqrt(2 R wavelength / pi), 0.68 m here: a word below it, none above."""
    edge = (2 * WAY * WAVELENGTH / 3.141592653589793) ** 0.5
    assert edge == pytest.approx(0.677, abs=1e-3)
    (message,) = uneven(0.98 * edge)
    assert "water.inhomogeneity.correlation_length" in message and f"{edge:.2g} m or more" in message
    assert uneven(1.02 * edge) == []


def test_what_is_advised_needs_no_further_word():
    """The patches that a caution offers, to its two digits and a little, are large enough."""
    (message,) = uneven(0.3, record="beams")
    offered = float(message.split("Give patches of ")[1].split(" m")[0])
    assert uneven(1.05 * offered, record="beams") == []


@pytest.mark.parametrize(("part", "words"), [(0.96, 0), (1.04, 1)])
def test_an_array_longer_than_half_a_patch_is_reported(part, words):
    """Its elements would not share their delays; nothing is reported of recorded beams."""
    line = {"kind": "line", "length": part * SHARED * 3.0 * 32 / 31, "elements": 32, "element": "omni"}
    assert len(uneven(3.0, receive=line)) == words
    assert uneven(3.0, receive=line, record="beams") == []


def test_even_water_is_never_warned_of():
    """Patches of any size without changes; no patches at all."""
    assert uneven(0.1, rms=0.0) == [] and inhomogeneity_warnings(scene()) == []


@pytest.mark.parametrize("settings", [
    {"inhomogeneity": {"rms_index": 1e-4, "correlation_length": "5 m", "correlation_time": "20 s"}},
    {"noise": {"level_db": "40 dB", "directionality": "surface"}},
    {"volume_strength_db": [["0 m", -80], ["10 m", None], ["12 m", "-60 dB"]]},
    {"patches": [{"position": [0, 25, 10], "size": ["2 m", 1, 1], "heading": "30 deg", "volume_strength_db": -40,
                  "form": "box"}]},
])  # fmt: skip
def test_water_is_written_back_as_it_was_read(settings):
    """Round trip through a file, units and nulls included."""
    one = scene(settings)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        assert parse_model(type(one), to_yaml(one)) == one


@pytest.mark.parametrize(("water", "top", "source"), [
    ({"noise": {"level_db": 40}}, {}, FIELD), ({"noise_level_db": 40}, {}, FIELD),
    ({"noise": {"wind_speed": 5}}, {}, NOISE),
    ({"noise": {"level_db": 40, "directionality": "surface"}}, {}, SURFACE_NOISE),
    ({"volume_strength_db": -70}, {}, SUSPENDED),
    ({}, {"seabed": {"depth": 20, "texture": {"k_shape": 2, "correlation_length": "1 m"}}}, PATCHY),
])  # fmt: skip
def test_what_runs_is_cited_and_nothing_else(water, top, source):
    """Each source by what requests it; a scene without any of it names none of them."""
    assert source in citations(scene(water, **top))
    assert not {FIELD, NOISE, SURFACE_NOISE, SUSPENDED, PATCHY} & set(citations(scene()))


def test_a_receiver_keeps_the_transmitters_time_unless_it_states_its_own():
    """What is left out of its track is the transmitter's clock; what is written stays."""
    track = scene(track={"pings": 7, "interval": 0.4}).track
    kept = with_transmitter_clock({"kind": "static", "position": (0, 0, 3)}, track)
    assert kept["pings"] == 7 and all(kept[name] == getattr(track, name) for name in CLOCK)
    assert with_transmitter_clock({"kind": "static", "pings": 3}, track)["pings"] == 3
    for strange in (None, 5, "north"):
        assert with_transmitter_clock(strange, track) == strange
    assert with_transmitter_clock({"kind": "static"}, None) == {"kind": "static"}


@pytest.mark.parametrize("name", ["interval", "window", "stop_and_hop"])
def test_another_clock_is_refused_at_the_field_that_differs(name):
    """Each part of the clock by its own name, with the fix."""
    other = {"interval": 0.9, "window": (0.0, 0.05), "stop_and_hop": True}[name]
    receiver = {"kind": "static", "position": (10.0, 0.0, 5.0), name: other}
    with pytest.raises(ValueError, match=rf"receiver_track.{name}: differs from track.{name}, .* Leave it out"):
        scene(receiver_track=receiver)


@pytest.mark.parametrize("depth", [-1.0, 0.0, 20.0, 30.0])
def test_a_receiver_out_of_the_water_is_reported_at_its_own_track(depth):
    """At or above the surface, at or below the bed: the receiver's position, not the transmitter's, is named."""
    with pytest.raises(ValueError, match=r"receiver_track\.position"):
        scene(receiver_track={"kind": "static", "position": (10.0, 0.0, depth)})
