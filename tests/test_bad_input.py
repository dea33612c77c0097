"""Claims about what the physics library does with what means nothing: it reports it, with the fix."""

import copy
import dataclasses
import pickle
import re
import subprocess
import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from insonify import ocean, scattering
from insonify.scattering import Sediment
from insonify.scene.terrain import PowerLaw, Ripples, SedimentMap, SedimentPatches, build_terrain, upward_normal

SAND = Sediment.named("medium sand")
SEA = ocean.SeaSurface(ocean.Elfouhaily(7.0), bands=4, directions=2)
GROUND = build_terrain([PowerLaw(hurst=0.6, rms=0.1), Ripples()], seed=1)
LAWS = [
    *(law(SAND, 5e4) for law in (scattering.Jackson, scattering.SmallSlope, scattering.Kirchhoff)),
    *(law(SAND, 5e4) for law in (scattering.Perturbation, scattering.SedimentVolume)),
    scattering.Lambert(),
    scattering.AplSurface(7.0, 5e4),
    scattering.Bubbles(7.0, 5e4),
    scattering.SurfaceFacets(0.01, 0.02),
    scattering.SurfaceScattering.at_wind(7.0, 5e4),
    scattering.TableScatteringLaw([0.1, 1.0], [-20.0, -10.0]),
]

WATER = {"temperature": 10.0, "salinity": 35.0}
PLATE = {"frequency": 1e5, "tilt": 0.1, "sound_speed": 1500.0}
FUNCTIONS: dict[str, tuple[Callable[..., Any], dict[str, float]]] = {
    **{
        f"sound speed by {model}": (
            lambda model=model, **k: ocean.sound_speed(model=model, **k),
            WATER | {"depth": 9.0},
        )
        for model in ("teos10", "mackenzie", "chen-millero", "medwin", "unesco")
    },
    "sound speed at pressure": (ocean.sound_speed_at_pressure, WATER | {"pressure_dbar": 9.0}),
    **{
        f"absorption by {model}": (
            lambda model=model, **k: ocean.absorption_db_per_m(model=model, **k),
            WATER | {"frequency": 1e5, "depth": 9.0, "ph": 8.0},
        )
        for model in ("francois-garrison", "ainslie-mccolm")
    },
    "absorption filter": (ocean.absorption_filter, {"frequency": 1e5, "path_length": 90.0}),
    "pressure": (ocean.pressure_dbar, {"depth": 9.0, "latitude": 45.0}),
    "depth": (ocean.depth_from_pressure, {"pressure_dbar": 9.0, "latitude": 45.0}),
    "noise": (ocean.noise_level_db, {"frequency": 2e4, "wind_speed": 5.0, "shipping": 0.5, "rain_rate": 1.0}),
    "waves": (ocean.angular_frequency, {"wavenumber": 1.0, "water_depth": 9.0}),
    "elfouhaily": (ocean.Elfouhaily(7.0).density, {"wavenumber": 1.0}),
    "pierson-moskowitz": (ocean.PiersonMoskowitz(12.0).density, {"wavenumber": 1.0}),
    "spreading": (ocean.CosinePowerSpreading().density, {"angle": 0.1, "wavenumber": 1.0}),
    "sea": (SEA.elevation, {"north": 1.0, "east": 2.0, "time": 3.0}),
    "volume": (ocean.volume_backscattering_coefficient, {"number_density": 1.0, "mean_backscatter": 1e-5}),
    "bubble": (ocean.bubble_resonance_frequency, {"radius": 1e-4, "depth": 1.0, "density": 1025.0}),
    "reflection": (lambda **k: scattering.reflection_coefficient(SAND, **k), {"grazing": 0.3}),
    "coherent loss": (scattering.coherent_reflection_factor, {"frequency": 1e5, "rms_height": 1e-3, "grazing": 0.3}),
    "apl bottom": (
        lambda **k: scattering.apl_bottom_strength_db(SAND, **k),
        {"frequency": 3e4, "grazing": 0.3, "sound_speed": 1500.0},
    ),
    "apl surface": (scattering.apl_surface_strength_db, {"wind_speed": 7.0, "frequency": 3e4, "grazing": 0.3}),
    "bubble loss": (scattering.bubble_loss_db, {"wind_speed": 7.0, "frequency": 3e4, "grazing": 0.3}),
    "roughness": (lambda **k: scattering.roughness_spectrum(SAND, **k), {"wavenumber": 10.0}),
    "plate": (scattering.plate_strength_db, {"side": 1.0, "other_side": 2.0} | PLATE),
    "cylinder": (scattering.cylinder_strength_db, {"radius": 1.0, "length": 2.0} | PLATE),
    "sphere series": (scattering.sphere_series_strength_db, {"radius": 0.01, "frequency": 1e5, "angle": 3.0}),
    "ground": (GROUND.height, {"north": 1.0, "east": 2.0}),
    **{
        type(law).__name__: (law.cross_section, {"grazing_in": 0.3, "grazing_out": 0.4, "azimuth": 2.0}) for law in LAWS
    },
}
PROGRAM = [pytest.param(f, k, name, id=f"{title}-{name}") for title, (f, k) in FUNCTIONS.items() for name in k]


@pytest.mark.parametrize(("function", "good", "name"), PROGRAM)
def test_what_is_no_number_is_refused_by_name(function, good, name):
    """A word, nothing, true, an infinite or a complex number, rows of unequal length: the argument is named."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nor does anything leak out of numpy on the way
        for nothing in ("abc", "10 kHz", None, True, 1j, np.inf * -1, [None, 1.0], [[1.0], [1.0, 2.0]]):
            with pytest.raises(ValueError, match=rf"(?s)^{name} is .*; give a finite number"):
                function(**good | {name: nothing})


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
@pytest.mark.parametrize(("function", "good", "name"), PROGRAM)
def test_every_argument_broadcasts(function, good, name):
    """Lists, columns, integers and empty arrays of one argument give what its numbers give one by one."""
    one = np.asarray(function(**good))
    column = np.asarray(function(**good | {name: np.full((2, 1), good[name])}))
    assert column.shape == (2, 1)
    np.testing.assert_allclose(column, one, rtol=1e-12)
    assert np.asarray(function(**good | {name: [good[name]] * 3})).shape == (3,)
    assert np.asarray(function(**good | {name: np.array([])})).shape == (0,)
    if name in ("frequency", "temperature", "salinity", "wind_speed", "north", "east", "time", "azimuth"):
        whole = [np.asarray(function(**good | {name: kind(3)})) for kind in (float, int, np.int32, np.array)]
        assert all(np.array_equal(other, whole[0], equal_nan=True) for other in whole)


MEANINGLESS = [
    ("absorption by francois-garrison", "frequency", -1.0),
    ("absorption by francois-garrison", "temperature", -300.0),
    ("absorption by francois-garrison", "ph", 50.0),
    ("absorption filter", "path_length", -1.0),
    ("pressure", "latitude", 91.0),
    ("noise", "frequency", 0.0),
    ("elfouhaily", "wavenumber", 0.0),
    ("waves", "water_depth", -1.0),
    ("volume", "mean_backscatter", -50.0),
    ("bubble", "density", 0.0),
    ("reflection", "grazing", 20.0),
    ("reflection", "grazing", -0.3),
    ("apl bottom", "sound_speed", 1.5),
    ("roughness", "wavenumber", -1.0),
    ("ground", "north", 1e12),
    *((type(law).__name__, "grazing_in", 20.0) for law in LAWS),
]


@pytest.mark.parametrize(("title", "name", "value"), MEANINGLESS)
def test_what_means_nothing_is_refused_with_its_limit(title, name, value):
    """Degrees for radians, decibels for ratios, kilometres a second: the message has the value and the range."""
    function, good = FUNCTIONS[title]
    with pytest.raises(
        ValueError, match=rf"^{name} is {re.escape(f'{value:g}')}.*; give a finite number.*(above|or more|to)"
    ):
        function(**good | {name: value})


def test_a_gap_in_a_measurement_stays_a_gap():
    """NaN and masked values of a lowered probe give NaN, silently, and only where they are."""
    warm = np.ma.array([10.0, 1e20, 12.0], mask=[False, True, False])
    for temperature in (warm, [10.0, np.nan, 12.0]):
        for model in ("teos10", "mackenzie", "chen-millero", "medwin", "unesco"):
            speed = ocean.sound_speed(temperature, 35.0, 10.0, model=model)
            assert np.isnan(speed).tolist() == [False, True, False]
            assert type(speed) is np.ndarray


def test_a_place_that_is_none_has_no_sediment():
    """A row number cannot be a gap: NaN is refused where ground is only undefined."""
    cover = SedimentMap(base=SedimentPatches(sediments=("clay", "rock"), fractions=(1, 2))).build_cover(seed=2)
    assert np.isnan(GROUND.height(np.nan, 0.0))
    with pytest.raises(ValueError, match="north is nan m"):
        cover.lookup([0.0, np.nan], 0.0)
    with pytest.raises(ValueError, match=r"slope has shape \(3,\)"):
        upward_normal([0.0, 0.0, 0.0])


@pytest.mark.parametrize("law", LAWS[:5], ids=lambda law: type(law).__name__)
def test_a_name_is_not_yet_a_sediment(law):
    """The message states how to turn one into the other; and a frequency of any type gives one law."""
    kind = type(law)
    with pytest.raises(ValueError, match=rf"{kind.__name__}\.sediment is 'clay'; give .*Sediment\.named\('clay'\)"):
        kind("clay", 5e4)
    with pytest.raises(ValueError, match=rf"{kind.__name__}\.frequency is '50 kHz'"):
        kind(SAND, "50 kHz")
    assert kind(SAND, np.array(50000)) == law
    assert hash(kind(SAND, np.float32(5e4))) == hash(law)


def test_a_sphere_is_rigid_or_soft():
    """Another boundary is not taken for one of the two."""
    with pytest.raises(ValueError, match="'elastic'; give 'rigid' or 'soft'"):
        scattering.sphere_series_strength_db(0.01, 1e5, boundary="elastic")


def test_a_shear_wave_as_fast_as_water_is_no_division_by_nothing():
    """At grazing 0 the limit is given: upside down, and (rho - 1) / (rho + 1) over a sediment as fast as water."""
    slow = scattering.ElasticSolid(2.5, 2.0, 1.0)
    assert scattering.elastic_reflection_coefficient(slow, 0.0) == pytest.approx(-1.0, abs=1e-9)
    like_water = Sediment(1.8, 1.0, 0.0, volume_parameter=0.0)
    assert scattering.reflection_coefficient(like_water, 0.0) == pytest.approx(0.8 / 2.8, rel=1e-9)


MODELS = [
    *LAWS,
    SAND,
    SEA,
    GROUND,
    GROUND.resolved.parts[0],
    ocean.PiersonMoskowitz(12.0),
    ocean.Jonswap(12.0, 1e5),
    ocean.NoiseSpectrum([1e3, 1e5], [50.0, 40.0]),
    ocean.ScatteringLayer(0.0, 10.0, -70.0),
    ocean.SoundSpeedProfile([0.0, 10.0], [1500.0, 1490.0]),
    PowerLaw(hurst=0.6, rms=0.1),
    Ripples(),
]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_models_are_values(model):
    """Copied, pickled or made again they are equal, with equal hashes; and none can be changed, nor its arrays."""
    for twin in (copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        assert twin == model
        assert hash(twin) == hash(model)
    assert model != "model"
    fields = (
        [f.name for f in dataclasses.fields(model)] if dataclasses.is_dataclass(model) else type(model).model_fields
    )
    for name in fields:
        with pytest.raises((AttributeError, ValueError)):
            setattr(model, name, 1.0)
        value = getattr(model, name)
        assert not (isinstance(value, np.ndarray) and value.flags.writeable)
    assert len(repr(model)) < 600


def test_help_names_types_as_people_do():
    """The signature of a function fits on a line or two, for all its types."""
    from pydoc import plain, render_doc

    text = plain(render_doc(ocean.sound_speed))
    assert "temperature: 'ArrayLike'" in text
    assert max(len(line) for line in text.splitlines()) < 160


def test_the_module_is_the_command():
    """`python -m insonify` behaves as `insonify` does, with its exit codes."""
    completed = subprocess.run(
        [sys.executable, "-m", "insonify", "show", "nonsense", "-o", "x.png"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.returncode == 2
    assert "did you mean" in completed.stderr
