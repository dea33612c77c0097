"""Sound off an uneven surface by Kirchhoff's integral, summed over the surface. Shares no code with the project."""

import numpy as np


def reflected(height, start, end, wavenumber, along, across, edge=0.15):
    """Pressure re that at 1 m, with the mirror's sign taken off: 1 / (r1 + r2) times its phasor for a level surface.

    p = (j k / 2 pi) integral of (N . r1) / (r1 r2) exp(-j k (r1 + r2)) dx dy, N the normal with 1 upwards, twice the
    normal derivative of what comes in, as on a pressure-release surface (Pierce 1981, Acoustics, ch. 4, not verified).

    Args:
        height: Function of north and east that gives height, and slopes north and east.
        start: North, east, depth of one end.
        end: The same of the other.
        wavenumber: Wavenumber of the sound.
        along: First, last north of the surface, and number of points.
        across: The same of east.
        edge: Share of each side over which the surface fades out, so that its edges do not scatter.
    """
    (north, weight_n), (east, weight_e) = (_faded(*line, edge) for line in (along, across))
    total = 0j
    for rows in np.array_split(np.arange(north.size), max(1, north.size * east.size // 200_000)):
        n, e = north[rows, None], east[None, :]
        h, slope_n, slope_e = height(n, e)
        r1 = np.sqrt((n - start[0]) ** 2 + (e - start[1]) ** 2 + (start[2] + h) ** 2)
        r2 = np.sqrt((n - end[0]) ** 2 + (e - end[1]) ** 2 + (end[2] + h) ** 2)
        facing = (start[2] + h - (n - start[0]) * slope_n - (e - start[1]) * slope_e) / r1
        term = facing / (r1 * r2) * (1 - 1j / (wavenumber * r1)) * np.exp(-1j * wavenumber * (r1 + r2))
        total += weight_n[rows] @ term @ weight_e
    return 1j * wavenumber / (2 * np.pi) * total


def _faded(first, last, count, edge):
    """Points of a line, and their weights."""
    place = np.linspace(first, last, count)
    side = np.clip(np.minimum(place - first, last - place) / (edge * (last - first)), 0, 1)
    return place, (0.5 - 0.5 * np.cos(np.pi * side)) * (place[1] - place[0])
