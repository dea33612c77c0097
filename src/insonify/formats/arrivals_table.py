"""Arrivals as a table of comma-separated values: one row for each path, a header with units."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from insonify.records.arrivals import Arrivals

if TYPE_CHECKING:
    import xarray as xr

COLUMNS: dict[str, tuple[str, str]] = {
    "delay": ("s", "two-way travel time from the start of transmission"),
    "amplitude_real": ("1", "pressure re the source at 1 m, real part"),
    "amplitude_imaginary": ("1", "pressure re the source at 1 m, imaginary part"),
    "spreading": ("1", "pressure ratio by spreading, two-way"),
    "absorption": ("1", "pressure ratio by absorption, two-way"),
    "boundary_real": ("1", "product of reflection coefficients, real part"),
    "boundary_imaginary": ("1", "product of reflection coefficients, imaginary part"),
    "scattering": ("m", "pressure scattered to 1 m re incident pressure"),
    "group": ("", "arrivals of one group interfere in the mean"),
    "transmit_family": ("", "family of the transmit leg"),
    "receive_family": ("", "family of the receive leg, named from the sonar outward"),
    "transmit_branch": ("", "number of the ray branch of the family, transmit leg"),
    "receive_branch": ("", "number of the ray branch of the family, receive leg"),
    "caustics": ("", "caustics touched, two-way"),
    "object": ("", "object that scattered: seabed, surface, water or a target"),
    "north": ("m", "position of the scatterer"),
    "east": ("m", "position of the scatterer"),
    "depth": ("m", "position of the scatterer"),
    "departure_north": ("1", "unit vector of travel at the transmitter"),
    "departure_east": ("1", "unit vector of travel at the transmitter"),
    "departure_down": ("1", "unit vector of travel at the transmitter"),
    "arrival_north": ("1", "unit vector from the receiver towards the arriving sound"),
    "arrival_east": ("1", "unit vector from the receiver towards the arriving sound"),
    "arrival_down": ("1", "unit vector from the receiver towards the arriving sound"),
    "grazing_out": ("rad", "grazing angle at the scatterer, transmit leg"),
    "grazing_back": ("rad", "grazing angle at the scatterer, receive leg"),
}
"""Unit and meaning of each column; no unit for names, counts and numbers of groups."""


def arrivals_dataset(arrivals: Arrivals) -> xr.Dataset:
    """Convert arrivals to labelled columns over `path`, in order of delay.

    Args:
        arrivals: Paths of one ping, n of them, of one band.

    Returns:
        Dataset of `COLUMNS`, each of shape (n,), with units and long name.
    """
    import xarray as xr

    p = arrivals.take(np.argsort(arrivals.delay, kind="stable"))
    amplitude = p.amplitude
    columns = (
        p.delay, amplitude.real, amplitude.imag, p.spreading, p.absorption, p.reflection_coefficient.real,
        p.reflection_coefficient.imag, p.scattering_amplitude, p.group, p.transmit_family, p.receive_family,
        p.transmit_branch, p.receive_branch, p.caustics, p.object,
        *p.position.T, *p.departure.T, *p.arrival.T, p.transmit_grazing, p.receive_grazing,
    )  # fmt: skip
    return xr.Dataset(
        {
            name: ("path", column, {"units": unit or "1", "long_name": meaning})
            for (name, (unit, meaning)), column in zip(COLUMNS.items(), columns, strict=True)
        }
    )


def arrivals_table(arrivals: Arrivals, path: str | Path) -> Path:
    """Write arrivals as CSV, in order of delay; the header has name and unit, such as "delay [s]".

    Numbers are written with full precision.

    Returns:
        The path.
    """
    table = arrivals_dataset(arrivals)
    header = [f"{name} [{unit}]" if unit else name for name, (unit, _) in COLUMNS.items()]
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(zip(*(table[name].values.tolist() for name in COLUMNS), strict=True))
    return Path(path)
