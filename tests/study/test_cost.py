"""Claims about the cost of a run: right to a factor of two before anything is drawn, and said before it is too much."""

import pytest

from insonify.cli import main
from insonify.engines import volume
from insonify.simulation import parts_of, prepare
from insonify.study.cost import Cost, cost, too_big
from oracles.arrays import heard_by_elements, line_of
from oracles.scenes import nominal

SIDES = {"sides": ["port", "starboard"]}
CHEAP = {"reflections": 0, "causes": ["seabed"]}


@pytest.mark.parametrize(
    "changes",
    [
        {"track": {"window": (0.02, 0.1)}},
        {"track": {"window": (0.02, 0.1)}, "sonar": SIDES},
        {"track": {"window": (0.1, 0.12)}, "line": {"length": 0.5}},
        {"track": {"window": (0.1, 0.12)}, "paths": {**CHEAP, "scatterers_per_cell": 1}},
    ],
)
def test_scatterers_are_counted_to_a_factor_of_two(changes):
    """As many as one ping then draws."""
    scenario = nominal(**{"paths": CHEAP} | changes)
    listening = prepare(scenario)
    drawn = sum(len(block()) for side in listening.stances(0) for block in listening.engine.blocks(side))
    assert 0.5 < cost(scenario).scatterers / drawn < 2


@pytest.mark.parametrize("body", [{"shape": "box", "size": (2, 1, 1)}, {"shape": "plate", "length": 3, "width": 2}])
def test_points_on_targets_are_counted_to_a_factor_of_two(body):
    """Those of an upright box and of a solid, where nothing else is heard."""
    told = {"causes": ["target"], "reflections": 0}
    scenario = nominal(targets=[{**body, "position": (0, 30)}], track={"window": (0.02, 0.1)}, paths=told)
    listening = prepare(scenario)
    drawn = sum(len(block()) for side in listening.stances(0) for block in listening.engine.blocks(side))
    assert drawn > 1000 and 0.45 < cost(scenario).scatterers / drawn < 2.2


def test_cost_grows_with_pings_and_sides():
    """Ten pings take ten times as long and as much disk; both sides twice as much."""
    one, ten = (cost(nominal(track={"window": (0.02, 0.1), "pings": pings})) for pings in (1, 10))
    both = cost(nominal(track={"window": (0.02, 0.1)}, sonar=SIDES))
    assert ten.seconds == pytest.approx(10 * one.seconds) and ten.disk == 10 * one.disk
    assert both.seconds == pytest.approx(2 * one.seconds, rel=0.05) and both.disk == 2 * one.disk


def test_ground_heard_the_quick_way_is_counted_as_it_is_walked():
    """A relief's expected intensity takes milliseconds, its drawn scatterers several times as long."""
    rough = {"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}
    told = {"seabed": rough, "track": {"window": (0.02, 0.2)}, "paths": CHEAP, "sonar": SIDES}
    quick, drawn = (cost(nominal(field=field, **told)) for field in ("incoherent", "coherent"))
    assert quick.seconds < 0.1 and quick.seconds < drawn.seconds / 3


def test_the_program_itself_takes_memory():
    """Even a run of nothing holds Python, its libraries and the compiled kernels: hundreds of megabytes."""
    assert 200e6 < cost(nominal(track={"window": (0.02, 0.03)})).memory < 1e9


def test_what_a_machine_cannot_hold_is_refused_with_what_to_change():
    """Memory wanted, memory there, and the keys that matter."""
    big = Cost(pings=1, scatterers=2e11, seconds=1e5, memory=150e9, disk=1e9)
    said = too_big(big, memory=16e9)
    assert "about 150 GB of memory, and the machine has 16 GB" in said and "shorten track.window" in said
    assert too_big(big, memory=1e12) == ""
    assert "200 G scatterers: about 28 hours of one core" in big.words()


@pytest.mark.filterwarnings("ignore")
def test_check_and_run_refuse_a_run_that_is_too_big(tmp_path, capsys):
    """100 s of recording at 100 kHz: refused at once, by name, exit code 2; a long run is told its cost."""
    end = "{kind: line, length: 1 m}"
    text = (
        "sonar: {source_level_db: 200, pulse: {kind: cw, frequency: 100 kHz, duration: 0.1 ms}, "
        f"transmit: {end}, receive: {end}}}\n"
        "track: {kind: static, position: [0, 0, 9 m], interval: 100 s, window: [0 s, WINDOW]}\n"
    )
    file = tmp_path / "big.yaml"
    file.write_text(text.replace("WINDOW", "100 s"))
    assert main(["check", str(file)]) == 2
    assert "big.yaml: this needs about" in capsys.readouterr().err
    assert main(["run", str(file), "-o", str(tmp_path / "big.zarr")]) == 2
    assert not (tmp_path / "big.zarr").exists()
    file.write_text(text.replace("WINDOW", "50 ms"))
    assert main(["check", str(file)]) == 0
    assert capsys.readouterr().out.startswith(f"{file}: nothing wrong\n")
    file.write_text(text.replace("WINDOW]", "50 ms], pings: 100000"))
    assert main(["check", str(file)]) == 0
    assert "\n100000 pings, about " in capsys.readouterr().out


def test_a_large_array_is_held_in_fewer_parts():
    """Parts of a ping each hold the sound of all elements: 16 of small ones, two of any that are larger than 1 GB."""
    assert parts_of(1_000_000) == 16 and parts_of(1 << 28) == 8 and parts_of(1 << 32) == 2
    few, many = (
        cost(heard_by_elements([(0, 20, 5)], receive=line_of(count, 1.0), track={"window": (0.0, 1.0)}))
        for count in (8, 400)
    )
    assert few.memory < 2e9 and 4e9 < many.memory < 40e9
    assert "number of beams or elements" in too_big(many, memory=1e9)


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_points_in_the_water_are_counted(field):
    """As many as one ping then draws, to a twentieth: those under the ground are the difference."""
    murky = nominal(water={"noise_level_db": None, "volume_strength_db": -70}, field=field,
                    paths={"reflections": 0, "causes": ["water"]}, track={"window": (0.03, 0.05)})  # fmt: skip
    listening = prepare(murky)
    blocks = listening.engine.blocks(listening.stance(0), even=field == "incoherent")
    drawn = sum(len(block()) for block in blocks)
    assert cost(murky).scatterers == pytest.approx(drawn, rel=0.05)


@pytest.mark.parametrize(("field", "limit"), [("coherent", "MOST_CUBES"), ("incoherent", "MOST_TILES")])
def test_water_that_would_take_forever_is_refused_with_what_to_change(monkeypatch, field, limit):
    """More blocks than anybody waits for, here a hundred: named before anything is drawn, and if nobody asked, then."""
    monkeypatch.setattr(volume, limit, 100)
    endless = nominal(water={"noise_level_db": None, "volume_strength_db": -70}, field=field,
                      track={"window": (0.0, 0.2)}, paths={"reflections": 0, "causes": ["water"]})  # fmt: skip
    said = too_big(cost(endless), memory=1e12)
    assert "water.volume_strength_db" in said and "Shorten track.window" in said
    listening = prepare(endless)
    with pytest.raises(ValueError, match="leave clear water clear"):
        listening.engine.blocks(listening.stance(0), even=field == "incoherent")
