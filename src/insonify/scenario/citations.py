"""What a simulation rests on: the sources of what actually runs in a scenario."""

from insonify.scattering.lambert import Lambert
from insonify.scenario.scenario import Scenario
from insonify.scene.bottom_law import SedimentLaw
from insonify.scene.surface import WindLaw

IMAGES = "Allen & Berkley (1979), J. Acoust. Soc. Am. 65, 943: image sources"
DRAWS = "Salmon, Moraes, Dror & Shaw (2011), Proc. SC11: random numbers by key (Philox)"
GRIDDING = "Greengard & Lee (2004), SIAM Review 46, 443: sums of echoes on a time grid"
ABSORPTION = "Francois & Garrison (1982), J. Acoust. Soc. Am. 72, 1879: absorption"
LAMBERT = "Mackenzie (1961), J. Acoust. Soc. Am. 33, 1498: Lambert's law for the seabed"
JACKSON = "Williams & Jackson (1998), J. Acoust. Soc. Am. 103, 169: scattering by a sediment's surface and inside"
WINDY = "APL-UW TR 9407 (1994), section II: backscatter of a windy sea surface"
SEDIMENT = "APL-UW TR 9407 (1994): geoacoustics of sediments and their reflection"


def citations(scenario: Scenario) -> list[str]:
    """Sources of the laws and methods that a scenario uses, one line each."""
    found = [IMAGES, GRIDDING]
    if scenario.field == "coherent":
        found.append(DRAWS)
    if scenario.water.absorption_db_per_m is None:
        found.append(ABSORPTION)
    laws = [scenario.seabed.scattering, scenario.surface.scattering]
    if any(isinstance(law, Lambert) for law in laws) or scenario.scene.boxes:
        found.append(LAMBERT)
    if isinstance(scenario.seabed.scattering, SedimentLaw):
        found.append(JACKSON)
    if isinstance(scenario.surface.scattering, WindLaw):
        found.append(WINDY)
    if not isinstance(scenario.seabed.reflection, float):
        found.append(SEDIMENT)
    return found
