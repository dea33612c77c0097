"""Path settings: section `paths` of a scenario.

In this package because two stages read it that do not import each other: the engine selects paths and scatterers by
it, and synthesis draws the replica jitter.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from insonify.model import Decibels, Model, field_error
from insonify.propagation.families import bounce_sequence, families_up_to, is_family

Contribution = Literal["seabed", "surface", "target", "water", "boundary echo"]
FAMILIES = (
    "write D for the direct path, or letters S (surface) and B (bottom) in turn, from the sonar outward, such as BS"
)
"""Form of a family's name."""


class ReplicaPerturbation(Model):
    """Replica jitter of some paths, in place of that of all others."""

    families: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    """Families, such as [S, BS]: paths with one of them as either leg; H for S off a hull; None: all."""
    objects: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    """Labels of targets and patches, seabed, surface, water or boundary echo; None: all."""
    jitter: Annotated[float, Field(ge=0, le=100)] | None = None
    """Largest random phase [wavelengths]; None: that of all others."""
    amplitude_perturbation: Annotated[float, Field(ge=0, le=1)] | None = None
    """Largest relative random change of amplitude [1]; None: that of all others."""

    @field_validator("families")
    @classmethod
    def _known_families(cls, value: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for name in value or ():
            if not is_family(name.replace("H", "S")):
                raise ValueError(f"{name!r} is not a path family; {FAMILIES}")
        return value

    @model_validator(mode="after")
    def _selects_and_sets(self) -> Self:
        if self.families is None and self.objects is None:
            raise field_error("families", None, "selects no paths. Give families, objects, or both.")
        if self.jitter is None and self.amplitude_perturbation is None:
            raise field_error("jitter", None, "changes nothing. Give jitter, amplitude_perturbation, or both.")
        return self


class PathSettings(Model):
    """Settings of the engine: geometry, reflections, edges, jitter and sampling.

    Example:
        >>> insonify.PathSettings(max_reflections=2).followed_families
        ('D', 'S', 'B', 'SB', 'BS')
    """

    engine: Literal["eigenrays", "tracer"] = "eigenrays"
    """Eigenrays: all paths between sonar and scatterers; tracer: random rays, also between targets and the seabed.

    The tracer is for expected intensities.
    """
    rays: Annotated[int, Field(ge=100, le=100_000_000)] = 200_000
    """Rays that the tracer launches from each side at each ping [1]."""
    target_specular_fraction: Annotated[float, Field(ge=0, le=1)] | None = None
    """Fraction of the energy that targets' faces reflect specularly in the tracer [1]; None: all that their law leaves.

    Faces with a `face_reflection_coefficient` reflect its square.

    Where families are named, paths with a specular reflection off a target are followed only if this is given.
    """
    geometry: Literal["3d", "slice"] = "3d"
    """The whole scene, or the vertical plane of one beam, in which each point stands for its part of the footprint."""
    max_reflections: Annotated[int, Field(ge=0, le=12)] = 2
    """Largest number of bounces of one leg [1]."""
    families: tuple[str, ...] | None = None
    """Families to follow, such as [D, S, BS]; None: all up to `max_reflections`."""
    contributions: tuple[Contribution, ...] = ("seabed", "surface", "target", "water", "boundary echo")
    """Scattering boundaries and objects that contribute; the others still cast shadows.

    `boundary echo`: specular echoes of seabed and surface and their multiples, and the direct sound between platforms.
    """
    face_reflections: bool = False
    """Reflect sound off large flat smooth faces of targets on its way to and from other scatterers, such as the seabed
    in front of a wall; a face counts as one of `max_reflections`.

    Faces are sides of boxes and plates, and flat parts of meshes and library shapes, with a
    `face_reflection_coefficient`, 10 wavelengths wide or more. In the tracer all faces reflect.
    """
    edge_diffraction: Literal["none", "knife-edge"] = "knife-edge"
    """Diffraction at shadow edges of targets and terrain: knife-edge, or none (hard shadows).

    The tracer has hard shadows, as has the terrain in expected intensities by the fast reverberation.
    """
    jitter: Annotated[float, Field(ge=0, le=100)] = 0.0
    """Largest random phase of each pulse replica, uniform from 0 [wavelengths]; its envelope stays in place."""
    amplitude_perturbation: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Largest relative random change of each replica's amplitude, uniform [1]."""
    replica_perturbations: tuple[ReplicaPerturbation, ...] = ()
    """Jitter and amplitude perturbation of some families or objects; where several apply to a path, the last."""
    scatterers_per_cell: Annotated[float, Field(ge=0.1, le=1000)] = 5.0
    """Random scatterers in each resolution cell of the beam's main lobe; fewer where its gain is low [1]."""
    importance_sampling: bool = True
    """Use few scatterers where the beam's gain is low, and evaluate weak pairs of legs at few of them.

    Each is weighted by the inverse of its probability. False: all everywhere, the same for elements and beams, several
    times as slow.
    """
    beam_cutoff_db: Annotated[Decibels, Field(ge=-120, le=-10)] = -50.0
    """Two-way beam level below which seabed and bodies are left out [dB re the beam's axis]."""

    @field_validator("families")
    @classmethod
    def _known_families(cls, value: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for name in value or ():
            if not is_family(name):
                raise ValueError(f"{name!r} is not a path family; {FAMILIES}")
        if value is not None and len(set(value)) < len(value):
            raise ValueError("a family is named twice; name each once")
        return value

    @model_validator(mode="after")
    def _families_within_reflections(self) -> Self:
        if self.families is None:
            return self
        if not self.families:
            raise field_error(
                "families", "[]", "follows no path. Name at least one, such as [D], or write null for all."
            )
        longest = max(self.families, key=lambda name: len(bounce_sequence(name)))
        if len(bounce_sequence(longest)) > self.max_reflections:
            raise field_error(
                "families", longest,
                f"has {len(bounce_sequence(longest))} bounces, but max_reflections is {self.max_reflections}. "
                f"Write max_reflections: {len(bounce_sequence(longest))}, or leave the family out.",
            )  # fmt: skip
        return self

    @model_validator(mode="after")
    def _tracer_perturbs_all_alike(self) -> Self:
        if self.engine == "tracer" and self.replica_perturbations:
            raise field_error("replica_perturbations", None, "names families, which the tracer's rays have none of. "
                          "Leave it out, or write engine: eigenrays.")  # fmt: skip
        return self

    @model_validator(mode="after")
    def _tracer_takes_the_whole_scene(self) -> Self:
        if self.engine == "tracer" and self.geometry == "slice":
            raise field_error("geometry", "slice", "is one plane, but the tracer launches rays in all directions. "
                          "Write geometry: 3d, or engine: eigenrays.")  # fmt: skip
        return self

    @property
    def followed_families(self) -> tuple[str, ...]:
        """Families of the legs, as given or by `max_reflections`."""
        every = families_up_to(self.max_reflections)
        return every if self.families is None else tuple(name for name in every if name in self.families)
