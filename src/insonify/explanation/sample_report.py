"""Explanation of a sample: the arrivals behind it, each with its sonar equation in decibels.

The recording carries its scenario; the paths are computed again from it, and each is followed from the source level to
the sample. Their coherent sum is the recorded pressure without noise.
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.explanation.formed_beam import FormedBeam, formed_beam
from insonify.explanation.traced_sample_report import traced_sample_report
from insonify.records.arrivals import Arrivals
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.simulator import Simulator, arrivals, build_simulator
from insonify.synthesis.arrival_weights import arrival_weights, beam_amplitudes_of_arrivals
from insonify.synthesis.level_curves import pair_name
from insonify.synthesis.waveform_basis import waveform_basis
from insonify.units import level_db

RINGING = 20.0
"""Time before and after the pulse within which its filter's ringing is followed [1 / band]."""
SHOWN = 6
"""Kinds of arrivals (object and pair of families) that are written out."""
STRONGEST = 3
"""Arrivals of each kind that are written out."""
TERMS = ("source", "t beam", "r beam", "spread", "absorb", "bounce", "scatter", "pulse", "level")
"""Columns that add up: all but the last, to the last."""
LEAST = 0.05
"""Loss by soft edges from which on they have a column of their own [dB]."""
SURFACE_RAYS = {"statistical": "is a glint", "explicit": "has another bounce point of the waves, or is a glint"}
"""Kind of a family's further rays, by `Surface.reflection`; off one plane there are none."""
LARGEST_SHAPE = 2.0
"""Value of a received pulse re that at the carrier above which it is explained [1]."""
NOTE = "distance: straight from the receiver to the scatterer; level: the sum of the columns before it"


class SampleArrivals:
    """The arrivals behind one sample of one channel."""

    def __init__(
        self, scenario: Scenario, ping: int, time: float, channel: int, *, formed: FormedBeam | None = None
    ) -> None:
        """Find them again.

        Args:
            scenario: The scenario.
            ping: Number of the ping.
            time: Time of the sample [s].
            channel: Number of the beam or element.
            formed: Beam that is formed of elements about that one; None: the channel itself.
        """
        self.simulator: Simulator = build_simulator(scenario)
        self.ping_geometry = self.simulator.ping_geometry(ping, channel=channel)
        self.channel = channel % scenario.sonar.beam_count
        pulse, extra = self.ping_geometry.pulse, RINGING / scenario.sonar.receiver.bandwidth
        extra += 0.0 if formed is None else formed.greatest_lag
        window = time - pulse.stop - extra, time - pulse.start + extra
        near: Arrivals = arrivals(scenario, ping, window=window, channel=channel)
        if formed is None:
            factor = np.ones(len(near), complex)
            basis = waveform_basis(self.ping_geometry, bands=self.ping_geometry.interpolated_bands)
            waveforms = basis.samples(pulse, time - near.delay, near.doppler)
        else:
            factor, waveforms = formed.echoes(near, self.ping_geometry, time)
        bands = range(len(waveforms)) if self.ping_geometry.sub_bands and formed is None else [None]
        weights = [arrival_weights(near, self.ping_geometry, self.channel, band) for band in bands]
        pressure = np.asarray(sum(weight * part for weight, part in zip(weights, waveforms, strict=True)))
        received = pressure != 0  # the rest is behind the array, or its pulse has ended
        self.paths = near.take(received)
        central = arrival_weights(near, self.ping_geometry, self.channel)[received] * factor[received]
        self.shape: NDArray[np.complex128] = pressure[received] / np.where(central == 0, 1e-300, central)
        self.pressure: NDArray[np.complex128] = pressure[received]
        self.array_factor: NDArray[np.complex128] = factor[received]

    def sonar_equation_terms(self) -> NDArray[np.float64]:
        """Terms of each arrival's sonar equation [dB], shape (n, 9), see `TERMS`."""
        p = self.paths
        transmit_amplitude, receive_amplitude = beam_amplitudes_of_arrivals(p, self.ping_geometry, self.channel)
        # jitter of amplitudes has no column of its own: it is part of the scattering
        bare = p.spreading * p.absorption * np.abs(p.reflection_coefficient)
        scattering = np.abs(p.amplitude) / np.maximum(bare, 1e-300)
        ends = transmit_amplitude, receive_amplitude * self.array_factor
        path = p.spreading, p.absorption, p.reflection_coefficient, scattering, self.shape
        terms = [level_db(np.abs(factor) ** 2) for factor in (*ends, *path, self.pressure)]
        return np.stack([np.full(len(p), self.ping_geometry.source_level_db), *terms], axis=1)

    def extra_columns(self) -> dict[str, NDArray[np.float64]]:
        """Further columns by name, each of shape (n,), those only in which anything stands.

        `edges` [dB]: what soft edges of shadows take, both paths, jitter of amplitudes included; `budget` has it in
        the scattering. `caustic` [deg]: 90 for each caustic touched; near one, the phase itself has a little less.
        """
        p = self.paths
        bare = p.spreading * p.absorption * np.abs(p.reflection_coefficient) * p.scattering_amplitude
        edges = np.asarray(level_db((np.abs(p.amplitude) / np.maximum(bare, 1e-300)) ** 2), np.float64)
        columns: dict[str, NDArray[np.float64]] = {}
        if np.any(np.abs(edges) > LEAST):
            columns["edges"] = edges
        if np.any(p.caustics):
            columns["caustic"] = 90.0 * p.caustics.astype(np.float64)
        return columns

    def mean_square(self) -> float:
        """Expected square of the pressure [uPa^2]: a coherent sum in each group, an incoherent one over the groups."""
        _, group = np.unique(self.paths.group, return_inverse=True)
        count = int(group.max()) + 1 if group.size else 0
        real, imaginary = (np.bincount(group, part, count) for part in (self.pressure.real, self.pressure.imag))
        return float(np.sum(real**2 + imaginary**2))


def explain_sample(
    dataset: xr.Dataset, ping: int, time: float, *, channel: int | None = None, bearing: float | None = None
) -> str:
    """The arrivals behind one sample of a recording, as a page to read.

    Args:
        dataset: A recording that carries its scenario.
        ping: Number of the ping.
        time: Time after the start of transmission [s]; the nearest sample is taken.
        channel: Number of the beam or element; by default the one in which that sample is strongest.
        bearing: Where a beam looks that is formed of all recorded elements, clockwise from the bow [rad]; None: the
            channel by itself, which receives all bearings.

    Returns:
        A table of the strongest arrivals, their groups, and how they add up to the sample. Of a recording by the
        tracer, whose rays are energies: levels by contribution and pair of families.

    Raises:
        ValueError: The recording does not carry its scenario, that ping is not simulated yet, or a bearing is given
            for beams that are formed already.
    """
    if not dataset.attrs.get("scenario"):
        raise ValueError("the recording does not hold its scenario, so its samples cannot be explained")
    scenario = parse_model(Scenario, dataset.attrs["scenario"])
    name = "pressure" if "pressure" in dataset else "intensity"
    sample = dataset[name].sel(ping=ping) if "ping" in dataset.coords else dataset[name].isel(ping=ping)
    values = np.asarray(sample.sel(time=time, method="nearest").values)
    formed = None if bearing is None else formed_beam(dataset, scenario, ping, bearing)
    chosen = int(np.argmax(np.abs(np.nan_to_num(values)))) if channel is None else channel
    if formed is not None:
        chosen = formed.reference
    recorded = values[chosen]
    if not np.isfinite(recorded):
        raise ValueError(f"ping {ping} is not simulated yet, so its samples cannot be explained")
    when = float(dataset["time"].sel(time=time, method="nearest"))
    if scenario.paths.engine == "tracer":
        return traced_sample_report(scenario, ping, chosen, when, float(np.real(recorded)))
    behind = SampleArrivals(scenario, ping, when, chosen, formed=formed)
    if formed is not None:
        recorded = formed.recorded(sample, when)
    why = f", the strongest of {len(values)}" if channel is None and len(values) > 1 else ""
    side = {-1: "port, ", 0: "", 1: "starboard, "}[scenario.sonar.channel_sides[chosen]]
    beam = f"{side}beam {chosen} ({np.degrees(float(dataset['steer'][chosen])):+g} deg{why})"
    if scenario.sonar.receiver.record == "elements":
        beam = f"{side}element {chosen}{why}"
    if formed is not None:
        beam = f"beam of {len(formed.offset)} elements towards {np.degrees(formed.bearing):+g} deg from the bow"
    count = len(behind.paths)
    head = f"ping {ping}, {beam}, {when * 1e3:.3f} ms: {count or 'no'} arrival{'s' * (count != 1)}\n"
    body = [_table(behind), "", *_notes(behind), ""] if count else []
    return "\n".join([head, *body, _verdict(behind, recorded, name)])


def _notes(behind: SampleArrivals) -> list[str]:
    """Meaning of the columns of the table that need explanation."""
    extras, notes = behind.extra_columns(), [NOTE]
    scenario = behind.simulator.scenario
    rough = SURFACE_RAYS["statistical"] if scenario.seabed.reflecting_interface == "rough" else None
    rays = SURFACE_RAYS.get(scenario.surface.reflection, rough)
    if rays and np.any(behind.paths.bounces):
        notes.append(f"bounce: all reflections; a ray numbered S2, S3, ... {rays}, its share of the energy included")
    if "edges" in extras:
        notes.append("edges: sound that bends around the edges of targets and crests of the ground, out and back")
    if np.any(np.abs(behind.shape) > LARGEST_SHAPE):
        notes.append("pulse: the received pulse at this time; above 0 dB where a beam has a null at the carrier and is "
                     "stronger at the edges of the band")  # fmt: skip
    if "caustic" in extras:
        notes.append("caustic: what the caustics touched turn the phase by; near one it is a little less")
    return notes


def _kinds(behind: SampleArrivals) -> dict[tuple[str, str], NDArray[np.int64]]:
    """Rows of the arrivals by object and pair of families, the most energetic kind first."""
    p = behind.paths
    legs = np.stack([p.transmit_family, p.receive_family], axis=1)
    kind = {(str(out), str(back)): pair_name(str(out), str(back)) for out, back in np.unique(legs, axis=0)}
    pair = np.array([kind[str(out), str(back)] for out, back in legs], "<U25")
    power = np.abs(behind.pressure) ** 2
    kinds = {}
    for label in np.unique(p.object):
        for name in np.unique(pair[p.object == label]):
            kinds[str(label), str(name)] = np.flatnonzero((p.object == label) & (pair == name))
    return dict(sorted(kinds.items(), key=lambda item: -power[item[1]].sum()))


def _table(behind: SampleArrivals) -> str:
    """Each kind of arrival with its count and levels, and the strongest of them line by line."""
    kinds, terms, extras = _kinds(behind), behind.sonar_equation_terms(), behind.extra_columns()
    names = list(TERMS)
    if "edges" in extras:
        names.insert(names.index("scatter") + 1, "edges")
        terms[:, TERMS.index("scatter")] -= extras["edges"]
        terms = np.insert(terms, names.index("edges"), extras["edges"], axis=1)
    turned = extras.get("caustic")
    strength = np.abs(behind.pressure)
    widest = f"{'delay':>9s} {'out':<4s}{'back':<4s}{'distance':>9s}" + "".join(f"{term:>8s}" for term in names)
    phases = ["phase"] if turned is None else ["phase", "caustic"]
    shift = ("", "") if behind.ping_geometry.is_static else (f"{'shift':>8s}", f"{'Hz':>8s}")
    lines = [
        widest + "".join(f"{name:>8s}" for name in phases) + shift[0],
        f"{'ms':>9s}{'m':>18s}" + f"{'dB':>8s}" * len(names) + f"{'deg':>8s}" * len(phases) + shift[1],
    ]
    for (label, pair), rows in list(kinds.items())[:SHOWN]:
        incoherent_sum, coherent_sum = float(np.sum(strength[rows] ** 2)), float(abs(behind.pressure[rows].sum()) ** 2)
        count = f"{len(rows)} arrival{'s' * (len(rows) != 1)}"
        sums = f"incoherent sum {_db(incoherent_sum)} dB, coherent sum {_db(coherent_sum)} dB re 1 uPa"
        lines.append(f"{label} {pair}: {count}, {sums}")
        strongest = rows[np.argsort(-strength[rows], kind="stable")[:STRONGEST]]
        more = [("" if turned is None else f"{turned[row]:8.0f}") + _shift(behind, int(row)) for row in strongest]
        lines += [_line(behind, int(row), terms[row]) + end for row, end in zip(strongest, more, strict=True)]
    if len(kinds) > SHOWN:
        rest = np.concatenate(list(kinds.values())[SHOWN:])
        incoherent_sum = float(np.sum(strength[rest] ** 2))
        lines.append(f"others: {len(rest)} arrivals, incoherent sum {_db(incoherent_sum)} dB re 1 uPa")
    return "\n".join(lines)


def _line(behind: SampleArrivals, row: int, terms: NDArray[np.float64]) -> str:
    """One arrival: delay, families, distance, its sonar equation and phase."""
    p = behind.paths
    away = float(np.linalg.norm(p.position[row] - behind.ping_geometry.receive_position))
    cells = "".join(f"{round(float(value), 1) + 0.0:8.1f}" for value in terms)
    phase = round(float(np.degrees(np.angle(behind.pressure[row])))) + 0
    out, back = p.ray_names(row)
    where = f"{out:<4s}{back:<4s}{away:9.2f}"
    return f"{p.delay[row] * 1e3:9.4f} {where}{cells}{phase:8d}"


def _shift(behind: SampleArrivals, row: int) -> str:
    """Doppler shift of the carrier of one arrival on a moving sonar [Hz]."""
    return (
        "" if behind.ping_geometry.is_static else f"{behind.paths.doppler[row] * behind.ping_geometry.frequency:8.1f}"
    )


def _verdict(behind: SampleArrivals, recorded: complex, name: str) -> str:
    """Sum of the arrivals, compared with the recorded sample."""
    if name == "intensity":
        rest = float(np.real(recorded)) - behind.mean_square()
        lines = [("all arrivals, expected", behind.mean_square()), ("recorded", float(np.real(recorded)))]
    else:
        total = complex(behind.pressure.sum())
        rest = abs(complex(recorded) - total) ** 2
        lines = [("all arrivals, coherent sum", abs(total) ** 2), ("recorded", abs(recorded) ** 2)]
    leftover = _residual(behind.simulator.scenario, name)
    if not len(behind.paths):
        lines = [(f"recorded: {leftover}", abs(recorded) ** 2 if name == "pressure" else float(np.real(recorded)))]
    else:
        lines.append((f"difference: {leftover}", max(rest, 0.0)))
    return "\n".join(f"{text:<32s}{_db(power):>8s} dB re 1 uPa" for text, power in lines)


def _residual(scenario: Scenario, name: str) -> str:
    """Contributions to the recorded sample beyond its arrivals."""
    water, receiver = scenario.water, scenario.sonar.receiver
    is_noiseless = water.noise_level_db is None and water.noise is None and receiver.self_noise is None
    parts = [] if is_noiseless else ["noise"]
    parts += [name for name in receiver.stages if name != "adc"]
    # a recording of expected intensity holds the mean over the jitter, the arrivals hold one draw of it
    paths = scenario.paths
    shaken = paths.jitter > 0 or paths.amplitude_perturbation > 0 or paths.replica_perturbations
    return " and ".join([*parts, *(["one draw of jitter"] if shaken and name == "intensity" else []), "rounding"])


def _db(power: float) -> str:
    return f"{float(level_db(power)):.1f}" if power > 0 else "below any"
