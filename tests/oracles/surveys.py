"""Small surveys with known signs, with and without a place on Earth."""

import numpy as np

from insonify.scenario.scenario import Scenario

MOTION = {name: {"rms": f"{deg} deg", "period": "4 s"} for name, deg in (("roll", 3), ("pitch", 2), ("yaw", 1))}
ORIGIN = {"origin_latitude": 54.0, "origin_longitude": 3.0}
UTM = (5_983_000.0, 500_000.0)


def sidescan(*, targets=(), pings=6, track=None, **changes):
    """Two sides at 300 kHz, 4 m above a flat bed at 10 m, on a line towards 30 deg that rolls, pitches and yaws."""
    array = {"kind": "planar", "width": 0.3, "height": 0.01}
    described = {
        "title": "a small survey",
        "water": {"sound_speed": 1500.0, "noise_level_db": 20.0},
        "seabed": {"depth": 10.0, "scattering": {"law": "lambert", "strength_db": -27.0}},
        "targets": list(targets),
        "sonar": {
            "source_level_db": 210, "pulse": {"kind": "cw", "frequency": 300e3, "duration": 0.1e-3}, "transmit": array,
            "receive": array, "mounting": {"bearing": "90 deg", "tilt": "30 deg"}, "sides": ["port", "starboard"],
        },
        "track": {"kind": "line", "start": (0.0, 0.0, 6.0), "heading": "30 deg", "speed": 2.0, "pings": pings,
                  "interval": 0.1, "window": (0.0, 0.03), "motion": MOTION, **(track or {})},
        "paths": {"max_reflections": 0, "contributions": ("seabed", "target")},
        "field": "incoherent",
    }  # fmt: skip
    return Scenario(**{**described, **changes})


def multibeam(*, targets=(), pings=2, **changes):
    """A line of 64 elements looking down at 300 kHz, 8 m above a flat bed at 10 m, towards 40 deg with some roll."""
    described = {
        "title": "a small multibeam survey",
        "water": {"sound_speed": 1500.0, "noise_level_db": None},
        "seabed": {"depth": 10.0, "scattering": {"law": "lambert", "strength_db": -27.0}},
        "targets": list(targets),
        "sonar": {
            "source_level_db": 210, "pulse": {"kind": "cw", "frequency": 300e3, "duration": 0.1e-3},
            "transmit": {"kind": "planar", "width": 2e-3, "height": 0.2},
            "receive": {"kind": "line", "length": 0.16, "elements": 64},
            "receiver": {"record": "elements", "bandwidth": 20e3}, "mounting": {"bearing": 0.0, "tilt": "90 deg"},
        },
        "track": {"kind": "line", "start": (1.0, 2.0, 2.0), "heading": "40 deg", "speed": 2.0, "pings": pings,
                  "interval": 0.1, "window": (0.008, 0.03), "motion": {"roll": {"rms": "2 deg", "period": "5 s"}}},
        "paths": {"max_reflections": 0, "contributions": ("seabed", "target"), "scatterers_per_cell": 2},
        "field": "coherent",
    }  # fmt: skip
    return Scenario(**{**described, **changes})


def aperture(*, targets=(), pings=24, **changes):
    """Four elements on a northward line at 100 kHz, 4 m deep over a bed at 10 m, looking to starboard."""
    described = {
        "title": "a small aperture",
        "water": {"sound_speed": 1500.0, "noise_level_db": None},
        "seabed": {"depth": 10.0},
        "targets": list(targets),
        "sonar": {
            "source_level_db": 200, "pulse": {"kind": "lfm", "frequency": 100e3, "bandwidth": 15e3, "duration": 0.5e-3},
            "transmit": {"kind": "planar", "width": 0.05, "height": 0.02},
            "receive": {"kind": "planar", "width": 0.2, "height": 0.02, "columns": 4, "rows": 1},
            "receiver": {"record": "elements", "bandwidth": 20e3, "synthetic_aperture": 3.0},
            "mounting": {"bearing": "90 deg", "tilt": "20 deg"},
        },
        "track": {"kind": "line", "start": (-1.2, 0.0, 4.0), "heading": 0.0, "speed": 1.0, "pings": pings,
                  "interval": 0.1, "window": (0.0155, 0.024)},
        "paths": {"max_reflections": 0, "contributions": ("target",)},
        "field": "coherent",
    }  # fmt: skip
    return Scenario(**{**described, **changes})


def plane(folder, north_slope, east_slope):
    """GeoTIFF of a plane bed in UTM zone 31, 10 m deep at the scene's origin, as relief of a scenario."""
    import rasterio

    north, east = np.arange(30, -31, -1.0), np.arange(-30, 31, 1.0)
    depth = 10 + north_slope * north[:, None] + east_slope * east
    place = rasterio.Affine(1, 0, UTM[1] + east[0] - 0.5, 0, -1, UTM[0] + north[0] + 0.5)
    about = {"driver": "GTiff", "height": 61, "width": 61, "count": 1, "dtype": "float32", "crs": "EPSG:32631"}
    with rasterio.open(folder / "plane.tif", "w", transform=place, **about) as file:
        file.write(-depth.astype(np.float32), 1)
    return {"kind": "grid", "file": str(folder / "plane.tif"), "origin": list(UTM), "positive": "up"}
