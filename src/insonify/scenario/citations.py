"""Sources of the laws and methods that run in a scenario."""

from pathlib import Path

from insonify.scattering.lambert import Lambert
from insonify.scenario.scenario import Scenario
from insonify.scene.seabed_law import SedimentLaw, TableLaw
from insonify.scene.surface import AplSurfaceLaw

IMAGES = "Allen & Berkley (1979), J. Acoust. Soc. Am. 65, 943: image sources"
DRAWS = "Salmon, Moraes, Dror & Shaw (2011), Proc. SC11: random numbers by key (Philox)"
GRIDDING = "Greengard & Lee (2004), SIAM Review 46, 443: sums of echoes on a time grid"
ABSORPTION = "Francois & Garrison (1982), J. Acoust. Soc. Am. 72, 1879: absorption"
LAMBERT = Lambert.citation
JACKSON = "Williams & Jackson (1998), J. Acoust. Soc. Am. 103, 169: scattering by a sediment's surface and inside"
SEA = "Elfouhaily, Chapron, Katsaros & Vandemark (1997), J. Geophys. Res. 102, 15781: waves of a wind sea"
ROUGH = "Eckart (1953), J. Acoust. Soc. Am. 25, 566: coherent reflection from a rough boundary"
FOLDS = "Chester, Friedman & Ursell (1957), Proc. Camb. Phil. Soc. 53, 599: paths that merge on a curved surface"
WINDY = "APL-UW TR 9407 (1994), section II: backscatter of a windy sea surface"
FRACTAL = "APL-UW TR 9407 (1994), section IV: power-law relief of the seabed"
FACETS = "Gordon (1975), IEEE Trans. Antennas Propag. 23, 590: Kirchhoff's integral over flat facets, in closed form"
PATCHY = "Jakeman & Pusey (1976), IEEE Trans. Antennas Propag. 24, 806: K-distributed echoes"
SUSPENDED = "Urick (1983), Principles of Underwater Sound, ch. 8: volume reverberation"
NOISE = (
    "Wenz (1962), J. Acoust. Soc. Am. 34, 1936, as fitted by Coates (1989); Mellen (1952), 24, 478: noise of the sea"
)
FIELD = "Cox (1973), J. Acoust. Soc. Am. 54, 1289: coherence between two receivers of noise from many directions"
SURFACE_NOISE = "Cron & Sherman (1962), J. Acoust. Soc. Am. 34, 1732: noise that the surface makes"
SEDIMENT = "APL-UW TR 9407 (1994): geoacoustics of sediments and their reflection"


def citations(scenario: Scenario) -> list[str]:
    """Sources of the laws and methods that a scenario uses, one line each."""
    sources = [IMAGES, GRIDDING]
    if scenario.field == "coherent":
        sources.append(DRAWS)
    if scenario.water.absorption_db_per_m is None:
        sources.append(ABSORPTION)
    laws = [scenario.seabed.scattering, scenario.surface.scattering, *([Lambert()] if scenario.scene.occluders else [])]
    sources += dict.fromkeys(cited for law in laws if (cited := getattr(law, "citation", None)))
    if any(target.face_reflection_coefficient for target in scenario.scene.solids_of_one_law):
        sources.append(FACETS)
    if isinstance(scenario.seabed.scattering, SedimentLaw):
        sources.append(JACKSON)
    if isinstance(scenario.seabed.scattering, TableLaw):
        sources.append(f"Seabed strength table {Path(scenario.seabed.scattering.file).name}")
    if scenario.seabed.texture is not None:
        sources.append(PATCHY)
    if scenario.water.scatters:
        sources.append(SUSPENDED)
    if isinstance(scenario.surface.scattering, AplSurfaceLaw):
        sources.append(WINDY)
    if scenario.surface.wind_speed is not None or scenario.seabed.reflecting_interface == "rough":
        sources.append(ROUGH)
    if scenario.surface.wind_speed is not None:
        sources.append(SEA)
    if scenario.surface.reflection == "explicit":
        sources.append(FOLDS)
    if not isinstance(scenario.seabed.reflection, float):
        sources.append(SEDIMENT)
    sea, elements = scenario.water.noise, scenario.sonar.receiver.record == "elements"
    if sea is not None or (elements and scenario.water.noise_level_db is not None):
        sources.append(FIELD)
    if sea is not None:
        sources += [NOISE] * (sea.level_db is None) + [SURFACE_NOISE] * (sea.directionality == "surface")
    sources += [
        f"Bathymetry {Path(kind.file).name}: {kind.description}"
        for kind in scenario.seabed.relief
        if kind.kind == "grid"
    ]
    if any(kind.kind == "power-law" for kind in scenario.seabed.relief):
        sources.append(FRACTAL)
    return sources
