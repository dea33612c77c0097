"""Scattering and reflection by interfaces and simple bodies.

`Sediment.named("medium sand")` or `Sediment.from_grain_size(1.5)`, then a law of it: `Jackson(sediment, 100e3)`
is the default seabed. Every law has `cross_section(grazing_in, grazing_out, azimuth)`, radians from the plane of
the interface, azimuth 0 forward and pi in backscatter; `insonify.units.level_db` of it is the scattering strength.
Arguments broadcast; a law used outside its range warns with `insonify.validity.PhysicsWarning`.
"""

from insonify.scattering.albedo import albedo
from insonify.scattering.apl_bottom import apl_bottom_strength_db
from insonify.scattering.apl_surface import AplSurface, apl_surface_strength_db
from insonify.scattering.bubbles import Bubbles, bubble_loss_db
from insonify.scattering.compiled_law import CompiledLaw, compile_law
from insonify.scattering.jackson import Jackson
from insonify.scattering.kirchhoff import Kirchhoff
from insonify.scattering.lambert import Lambert
from insonify.scattering.law import ScatteringLaw
from insonify.scattering.perturbation import Perturbation
from insonify.scattering.reflection import (
    ElasticSolid,
    coherent_reflection_factor,
    elastic_reflection_coefficient,
    reflection_coefficient,
)
from insonify.scattering.roughness import roughness_spectrum, structure_constant
from insonify.scattering.scattering_geometry import local_angles
from insonify.scattering.sediment_volume import SedimentVolume
from insonify.scattering.sediments import Sediment
from insonify.scattering.small_slope import SmallSlope
from insonify.scattering.sphere_series import sphere_series_strength_db
from insonify.scattering.surface_facets import SurfaceFacets
from insonify.scattering.surface_scattering import SurfaceScattering
from insonify.scattering.table_law import TableScatteringLaw
from insonify.scattering.target_strength import (
    curved_strength_db,
    cylinder_strength_db,
    disc_strength_db,
    plate_strength_db,
    sphere_strength_db,
)

__all__ = [
    "AplSurface",
    "Bubbles",
    "CompiledLaw",
    "ElasticSolid",
    "Jackson",
    "Kirchhoff",
    "Lambert",
    "Perturbation",
    "ScatteringLaw",
    "Sediment",
    "SedimentVolume",
    "SmallSlope",
    "SurfaceFacets",
    "SurfaceScattering",
    "TableScatteringLaw",
    "albedo",
    "apl_bottom_strength_db",
    "apl_surface_strength_db",
    "bubble_loss_db",
    "coherent_reflection_factor",
    "compile_law",
    "curved_strength_db",
    "cylinder_strength_db",
    "disc_strength_db",
    "elastic_reflection_coefficient",
    "local_angles",
    "plate_strength_db",
    "reflection_coefficient",
    "roughness_spectrum",
    "sphere_series_strength_db",
    "sphere_strength_db",
    "structure_constant",
]
