"""Explanation of a sample of the tracer: energies by contribution and pair of families."""

import numpy as np

from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator, levels
from insonify.synthesis.level_curves import ALL, pair_name
from insonify.units import level_db

SHOWN_RANGE = 60.0
"""Level below the strongest curve at which curves are omitted [dB]."""
WHY = (
    "The tracer's rays carry energies and no phases: only paths to point targets and boundary echoes are named one by "
    "one. For all paths behind a sample write engine: eigenrays under paths and run again"
)


def traced_sample_report(scenario: Scenario, ping: int, channel: int, time: float, recorded: float) -> str:
    """The expected levels behind one sample of a recording by the tracer, strongest first, and paths that have names.

    Args:
        scenario: The scenario.
        ping: Number of the ping.
        channel: Number of the beam.
        time: Time of the sample [s].
        recorded: The sample [uPa^2].
    """
    curves = levels(scenario, ping, channel=channel)["level_db"].sel(time=time, method="nearest")
    rows = [
        (float(curves.sel(contribution=contribution, pair=pair)), str(contribution), str(pair))
        for contribution in curves["contribution"].values
        for pair in curves["pair"].values
    ]
    finite_rows = sorted((row for row in rows if np.isfinite(row[0]) and row[1] != "total"), reverse=True)
    shown = [row for row in finite_rows if row[0] > finite_rows[0][0] - SHOWN_RANGE] if finite_rows else []
    lines = [
        f"ping {ping}, beam {channel}, {time * 1e3:.3f} ms: expected levels of rays by contribution and pair of paths"
    ]
    lines += [f"  {contribution:<13s} {'all pairs' if pair == ALL else pair:<10s} {level:8.1f} dB re 1 uPa"
              for level, contribution, pair in shown]  # fmt: skip
    total = float(level_db(sum(10 ** (level / 10) for level, _, pair in finite_rows if pair == ALL)))
    if not shown:
        lines += ["  nothing arrives"]
    lines += named_paths(scenario, ping, channel, time)
    lines += ["", f"{'all contributions, expected':<32s}{total:8.1f} dB re 1 uPa",
              f"{'recorded':<32s}{float(level_db(recorded)):8.1f} dB re 1 uPa", WHY]  # fmt: skip
    return "\n".join(lines)


def named_paths(scenario: Scenario, ping: int, channel: int, time: float) -> list[str]:
    """Lines on the paths to point targets and the boundary echoes whose pulse covers a time, in order of arrival."""
    simulator = build_simulator(scenario)
    geometry = simulator.ping_geometry(ping, channel=channel)
    row = channel % scenario.sonar.beam_count % geometry.channel_count
    paths = [
        (float(echo.delay[0]), echo.object, pair_name(echo.transmit_chain, echo.receive_chain), echo.energy[row, 0])
        for echo in simulator.tracer.exact_paths(geometry)
        if geometry.pulse.start <= time - echo.delay[0] <= geometry.pulse.stop and echo.energy[row, 0] > 0
    ]
    peak_db = float(level_db(geometry.pulse.peak**2))
    return [""] * bool(paths) + [
        f"  {name} by {pair}: arrives at {delay * 1e3:.3f} ms, {level_db(energy) + peak_db:.1f} dB re 1 uPa at its peak"
        for delay, name, pair, energy in sorted(paths)
    ]
