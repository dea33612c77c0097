"""Measurements with new things, in a process of its own: `measure.py FOLDER ...`, folders whose modules come first.

A module of a folder stands in for that of the package, as a file of a changed checkout does. Prints JSON by item.
"""

import importlib.abc
import importlib.util
import json
import sys
import tempfile
import traceback
from pathlib import Path

import numpy as np


class Overlay(importlib.abc.MetaPathFinder):
    """Modules of folders, in place of those of the package or beside them."""

    def find_spec(self, name, path, target=None):
        """Module in the first folder that has it."""
        for folder in sys.argv[1:]:
            file = Path(folder, *name.split(".")).with_suffix(".py")
            if file.is_file():
                return importlib.util.spec_from_file_location(name, file)
        return None


LAWS = {
    "lambert": {"law": "lambert", "strength_db": -27.0},
    "sine-power": {"law": "sine-power", "strength_db": -27.0},
    "lommel-seeliger": {"law": "lommel-seeliger", "strength_db": -20.0},
}
RELIEF = {"kind": "power-law", "hurst": 0.8, "rms": 1e-3, "outer_scale": 10.0}
ENGINES = {
    "coherent": {},
    "expected": {"field": "incoherent"},
    "fast reverberation": {"field": "incoherent", "relief": [RELIEF]},
    "tracer": {"field": "incoherent", "paths": {"engine": "tracer", "rays": 20_000}},
    "slice": {"field": "incoherent", "paths": {"geometry": "slice"}},
    "expected, of the surface": {"field": "incoherent", "boundary": "surface"},
}


def scenario(law=None, relief=(), paths=None, surface=None, **changes):
    """A 100 kHz sonar 5 m above a seabed at 10 m."""
    from insonify.scenario.scenario import Scenario

    array = {"kind": "planar", "width": 0.2, "height": 0.02}
    return Scenario(**{
        "seed": 3, "water": {"sound_speed": 1500.0, "absorption_db_per_m": 0.0},
        "seabed": {"depth": 10.0, "scattering": law, "relief": relief, "reflection": 0.0},
        "surface": {"scattering": surface},
        "sonar": {
            "source_level_db": 220, "pulse": {"kind": "cw", "frequency": 100e3, "duration": 0.1e-3},
            "transmit": array, "receive": array, "mounting": {"bearing": "90 deg", "tilt": "20 deg"},
        },
        "track": {"kind": "static", "position": (0, 0, 5.0), "window": (0.0095, 0.0265)},
        "paths": {"max_reflections": 0, "contributions": ["seabed", "surface", "target"], **(paths or {})},
        **changes,
    })  # fmt: skip


def powers(*arguments, **settings):
    """Power over time of one ping, and the times re the middle of the pulse [s]."""
    import insonify

    recording = insonify.simulate(scenario(*arguments, **settings), threads=1)
    power = np.abs(recording["pressure"].values) ** 2 if "pressure" in recording else recording["intensity"].values
    return np.asarray(power, float).ravel(), recording["time"].values - 0.05e-3


def mean_powers(power):
    """Mean power in eight intervals of range."""
    return [float(part.mean()) for part in np.array_split(power, 8)]


def levels(engine):
    """Mean powers by law, and those under Lommel-Seeliger's law by the power under Lambert's and the ratio of both."""
    made = {name: powers(**{ENGINES[engine].get("boundary", "law"): law}, **_settings(engine)) for name, law in
            LAWS.items()}  # fmt: skip
    power, time = made["lambert"]
    ratio = 10**-2 / (2 * 10**-2.7 * 5.0 / (750 * time))
    found = {name: mean_powers(power) for name, (power, _) in made.items()}
    return {**found, "lommel-seeliger by lambert": mean_powers(power * ratio)}


def _settings(engine):
    """Settings of a scenario for an engine."""
    return {name: value for name, value in ENGINES[engine].items() if name != "boundary"}


def is_fast():
    """True where the fast reverberation applies."""
    from insonify.simulator import build_simulator

    simulator = build_simulator(scenario(LAWS["lommel-seeliger"], **ENGINES["fast reverberation"]))
    return simulator.fast_reverberation(simulator.ping_geometry(0)) is not None


def cited():
    """Sources of a scenario with the law."""
    from insonify.scenario.citations import citations

    return citations(scenario(LAWS["sine-power"]))


def shape():
    """Mean powers of a block as the new shape and as a box, leaning by a hundredth of a degree; a smooth one's."""
    from insonify.scene import Wedge

    block = {"position": (0, 9.0), "size": (1.0, 1.0, 1.0), "pitch": 2e-4}
    wedge = Wedge(**block, top_length=1.0).model_dump()
    smooth = {**wedge, "top_length": 0.5, "face_reflection_coefficient": 1.0}
    targets = {"wedge": wedge, "box": {"shape": "box", **block}, "smooth": smooth}
    return {name: mean_powers(powers(targets=[target], field="incoherent")[0]) for name, target in targets.items()}


PULSE = {"frequency": 300e3, "bandwidth": 15e3, "duration": 1e-3}


def pulse():
    """Errors of the spectrum re its peak, and of the peak of an echo after the matched filter, rising and falling."""
    from insonify.sonar import Pulse, Receiver, envelope, receive_pulse, spectrum

    found = {}
    for sweep in ("up", "down"):
        made = Pulse(kind="hfm", sweep=sweep, **PULSE)
        count = 1 << 14
        time = (np.arange(count) + 0.5) * made.duration / count
        series, offset = envelope(made, time), np.linspace(-12e3, 12e3, 41)
        direct = np.exp(-2j * np.pi * offset[:, None] * time) @ series * (made.duration / count)
        error = np.abs(spectrum(made, offset) - direct).max() / np.abs(direct).max()
        turns = np.diff(np.unwrap(np.angle(series[[1, 2, -3, -2]])))[[0, 2]] / (2 * np.pi * made.duration / count)
        peak = abs(receive_pulse(made, Receiver(bandwidth=40e3, matched_filter=True)).samples(0.0))
        found[sweep] = {"spectrum": float(error), "frequencies": turns.tolist(), "peak": float(peak)}
    return found


def exported():
    """Codes of the pulse in exported files, or messages of formats that have none."""
    import insonify
    from insonify.formats.store_description import StoreError

    sys.path.append(str(Path(__file__).parents[1]))
    from oracles.surveys import multibeam, sidescan

    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("hfm", "coded"):
            pulse = {"kind": kind, "sweep": "down", **PULSE}
            beams = insonify.simulate(multibeam(pings=1).with_({"sonar.pulse": pulse}), threads=1)
            images = insonify.simulate(sidescan(pings=2).with_({"sonar.pulse": pulse}), threads=1)
            for recording, name in ((beams, "a.kmall"), (images, "a.nc"), (images, "b.nc"), (images, "a.xtf"),
                                    (images, "a.mcap"), (images, "a.listing")):  # fmt: skip
                named = "sonar-netcdf4" if name == "b.nc" else None
                try:
                    file = insonify.export(recording, Path(folder, f"{kind}{name}"), named)
                    found[f"{kind} {name}"] = code(file)
                except StoreError as fault:
                    found[f"{kind} {name}"] = str(fault)
    return found


def code(file):
    """Code of the pulse in a file; the number of pings or the size of a file without one."""
    import insonify

    if file.suffix in (".kmall", ".listing"):
        with insonify.open_instrument(file) as opened:
            if file.suffix == ".listing":
                return [type(opened).__name__, opened.groups["pings"]]
            return int(opened.soundings()["waveform"].values.ravel()[0])
    if file.name.endswith("b.nc"):
        import netCDF4

        with netCDF4.Dataset(file) as opened:
            return int(opened["Sonar/Beam_group1/transmit_type"][:].ravel()[0])
    if file.suffix == ".mcap":
        from rosbags.highlevel import AnyReader

        with AnyReader([file]) as reader:
            connections = [one for one in reader.connections if one.msgtype.endswith("SonarInfo")]
            connection, _, raw = next(reader.messages(connections=connections))
            return int(reader.deserialize(raw, connection.msgtype).tx_signal_types[0])
    return file.stat().st_size


if __name__ == "__main__":
    sys.meta_path.insert(0, Overlay())
    items = {**{engine: (levels, engine) for engine in ENGINES}, "is fast": (is_fast,),
             "cited": (cited,), "shape": (shape,), "pulse": (pulse,), "exported": (exported,)}  # fmt: skip
    results = {}
    for name, (function, *arguments) in items.items():
        try:
            results[name] = function(*arguments)
        except Exception:
            results[name] = {"error": traceback.format_exc()}
    print(json.dumps(results))
