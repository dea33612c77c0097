"""A block of scatterers received by beams of a moving sonar, echo by echo in float64; shares no code with the kernels.

A world is a dictionary of columns; `received_series` sums the echoes of each scatterer by each pair of legs and
channel.
"""

import numpy as np

from insonify.synthesis._gridding_kernel import tap_coefficients
from oracles.beams import axes
from oracles.time_series import row

SPEED, CARRIER, RATE, CELLS = 1500.0, 100e3, 40e3, 2600
WAVELENGTH = SPEED / CARRIER
TAPS = tap_coefficients().astype(float)


def legs(rng, families, count, none=0.25):
    """Columns of legs between one end and some scatterers 5 to 20 m away; a part of them not there, and no numbers."""
    way = rng.normal(size=(families, count, 3))
    length = rng.uniform(5, 20, (families, count))
    made = {
        "delay": length / SPEED, "length": length, "spreading": 1 / length, "absorption": np.exp(-1e-3 * length),
        "reflection_coefficient": rng.normal(size=length.shape) + 1j * rng.normal(size=length.shape),
        "visibility": rng.uniform(0.2, 1, length.shape) * np.exp(1j * rng.uniform(0, 1, length.shape)),
        "departure": way / np.linalg.norm(way, axis=-1, keepdims=True),
        "grazing_sine": np.sin(rng.uniform(-np.pi / 2, np.pi / 2, length.shape)),
    }  # fmt: skip
    lost = rng.uniform(size=length.shape) < none
    for name, column in made.items():
        if name in ("length", "spreading", "absorption", "grazing_sine"):
            column[lost & (rng.uniform(size=length.shape) < 0.5)] = np.nan
    made["visibility"][lost & (rng.uniform(size=lost.shape) < 0.5)] = 0
    made["reflection_coefficient"][lost & (made["visibility"] != 0)] = 0
    return made


def array(rng, beams, *, extent, element="baffled"):
    """A line of so many wavelengths with some beams, somehow turned."""
    turn = axes(heading=rng.uniform(0, 6), pitch=rng.uniform(-1, 1), roll=rng.uniform(-1, 1))
    return {"axes": turn.T.copy(), "steer": np.linspace(-0.4, 0.5, beams), "extent": extent, "element": element}


def world(
    seed, count, *, outs=2, backs=2, beams=1, patterns=2, strengths="products", moving=1.0, turning=0.0, dopplers=3
):
    """A random world; `moving` 0 is a sonar at rest."""
    rng = np.random.default_rng(seed)
    pairs = outs * backs
    away = legs(rng, outs, count)
    shapes = dopplers if moving else 1
    node = -np.cos((np.arange(shapes) + 0.5) * np.pi / shapes)
    return {
        "out": away, "back": away if backs == outs else legs(rng, backs, count),
        "pair": np.indices((outs, backs)).reshape(2, -1).T.copy(),
        "phase": np.exp(2j * np.pi * rng.uniform(size=count)), "strengths": strengths,
        "given": np.where(rng.uniform(size=(pairs, count)) < 0.3, 0, rng.normal(size=(pairs, count)) + 0.5j),
        "factor": np.append(0.1, rng.uniform(0.2, 1, 4)), "root": rng.uniform(0.1, 1, count),
        "weight": rng.uniform(0.5, 2, pairs), "number": rng.uniform(size=count).astype(np.float32),
        "stretch": rng.integers(0, 5, count).astype(np.uint8),
        "share": rng.choice([0.03, 0.3, 1.0], (pairs, 5)).astype(np.float32),
        "level": 3.0, "middle": 1e-3 if moving else 0.0, "sent": moving * np.array([3.0, -1.0, 0.3]),
        "velocity": moving * np.array([[3.0, -0.8, 0.4]]), "acceleration": moving * np.array([[0.1, 0.5, -0.2]]),
        "place": np.zeros((1, 3)), "transmit": array(rng, beams, extent=2.0, element="cosine"),
        "receive": array(rng, patterns, extent=5.0), "has_parallax": bool(moving), "turns": bool(turning),
        "rate": turning * rng.normal(size=(3, 3)), "bend": turning * rng.normal(size=(3, 3)),
        "taken": 2e-3, "loss": 1e-3, "node": 5e-3 * node if moving else np.zeros(1),
    }  # fmt: skip


def gain(one, beam, way):
    """Amplitude of one beam towards some directions, (n,)."""
    ahead, right, _ = one["axes"] @ way.T
    steer = np.sin(one["steer"][beam])
    element = {"baffled": ahead >= 0, "cosine": np.maximum(ahead, 0) / np.sqrt(1 - steer**2)}[one["element"]]
    return row(one["extent"], None, "uniform", right, steer) * element


def contributed(case, grazing_sine):
    """Root of what directions contribute to the cross section."""
    return np.sqrt(np.interp(np.abs(grazing_sine), np.linspace(0, 1, len(case["factor"])), case["factor"]))


def strength(case, p, i, j, n):
    """What scatterers n make of pair p of the legs i and j."""
    if case["strengths"] == "given":
        return case["given"][p, n]
    made = contributed(case, case["out"]["grazing_sine"][i, n]) * contributed(case, case["back"]["grazing_sine"][j, n])
    made = made * case["root"][n] * case["weight"][p]
    share = case["share"][p, case["stretch"][n]].astype(float)
    return made * np.where(case["number"][n] < share, 1 / np.sqrt(share), 0) if case["strengths"] == "thinned" else made


def echoes(case, p):
    """Times, Doppler factors less one and weights by channel, (channels, n), of one pair's echoes that there are."""
    (i, j), out, back = case["pair"][p], case["out"], case["back"]
    n = np.flatnonzero(
        (
            out["visibility"][i]
            * out["reflection_coefficient"][i]
            * back["visibility"][j]
            * back["reflection_coefficient"][j]
        )
        != 0
    )
    left = [
        end["visibility"][k, n]
        * end["reflection_coefficient"][k, n]
        * end["spreading"][k, n]
        * end["absorption"][k, n]
        * np.exp(-case["taken"] * end["length"][k, n])
        for k, end in ((i, out), (j, back))
    ]
    way, far = out["departure"][i, n], out["length"][i, n]
    line = far[:, None] * way - case["middle"] * case["sent"]
    gone = case["middle"] + (np.linalg.norm(line, axis=1) - far) / SPEED
    leaving = line @ case["sent"] / np.linalg.norm(line, axis=1) / SPEED
    start, r, u = out["delay"][i, n] + gone + back["delay"][j, n], back["length"][j, n], back["departure"][j, n]

    def at(t):
        return case["place"] + t[:, None] * case["velocity"] + t[:, None] ** 2 / 2 * case["acceleration"]

    when = start
    for _ in range(12):  # each step is nearer by the part of the speed of sound
        when = start + (np.linalg.norm(r[:, None] * u - at(when), axis=1) - r) / SPEED
    there = r[:, None] * u - at(when)
    reach = np.linalg.norm(there, axis=1)
    now = case["velocity"] + when[:, None] * case["acceleration"]
    doppler = (1 + np.sum(there * now, axis=1) / reach / SPEED) / (1 - leaving) - 1
    receive_time = start if case["turns"] else out["delay"][0, n] + case["middle"] + back["delay"][j, n]
    seen = r[:, None] * u - at(receive_time) if case["has_parallax"] else u
    seen = seen / np.linalg.norm(seen, axis=1, keepdims=True)
    if case["turns"]:
        seen = seen + receive_time[:, None] * (seen @ case["rate"].T + receive_time[:, None] * (seen @ case["bend"].T))
        seen = seen / np.linalg.norm(seen, axis=1, keepdims=True)
    common = case["level"] * far / np.linalg.norm(line, axis=1) * left[0] * left[1] * case["phase"][n]
    common = common * strength(case, p, i, j, n) * r / reach * (1 - case["loss"] * (reach - r))
    when = when - case["middle"]
    common = common * np.exp(-2j * np.pi * ((CARRIER * when) % 1))
    beams, patterns = len(case["transmit"]["steer"]), len(case["receive"]["steer"])
    sent, receive_gain = ([gain(case[end], b, d) for b in range(many)]
                 for end, many, d in (("transmit", beams, way), ("receive", patterns, seen)))  # fmt: skip
    return (
        when,
        doppler,
        np.array([common * sent[c % beams] * receive_gain[c % patterns] for c in range(max(beams, patterns))]),
    )


def shared(case, doppler):
    """Part that each shape has of echoes of some Doppler factors, (shapes, n): Lagrange's polynomials."""
    node = case["node"]
    return np.array([np.prod([(doppler - b) / (a - b) for b in node if b != a], axis=0) + 0 * doppler for a in node])


def deposited(when, weight, cells=CELLS):
    """A grid with some spikes on it, those off the grid left out, (cells,)."""
    grid, position = np.zeros(cells, complex), when * RATE - 2.5
    inside = (position >= 0) & (position < cells - 8)
    cell, weight = np.floor(position[inside]).astype(int), weight[inside]
    between = position[inside] - cell - 0.5
    for j in range(7):
        np.add.at(grid, cell + j, weight * np.polynomial.polynomial.polyval(between, TAPS[:, j]))
    return grid


def received_series(case):
    """Grids of all channels and shapes, (channels, cells, shapes)."""
    channels, shapes = max(len(case[end]["steer"]) for end in ("transmit", "receive")), len(case["node"])
    grids = np.zeros((channels, CELLS, shapes), complex)
    for p in range(len(case["pair"])):
        when, doppler, weight = echoes(case, p)
        for c, s in np.ndindex(channels, shapes):
            grids[c, :, s] += deposited(when, weight[c] * shared(case, doppler)[s])
    return grids
