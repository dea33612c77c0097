"""Which paths are followed, and how they are perturbed: the knobs of the paper.

The choice lies down here, below the stages that obey it, because two of them read it that must
not know each other: the engine follows paths and draws scatterers by it, synthesis perturbs their
replicas. The scenario only holds it.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from insonify.model import Decibels, Model, field_error
from insonify.propagation.families import bounce_sequence, families_up_to, is_family

Contribution = Literal["seabed", "surface", "target", "water"]


class PathSettings(Model):
    """Settings of the engine: geometry, reflections, edges, jitter and sampling."""

    engine: Literal["eigenrays", "tracer"] = "eigenrays"
    """Every path between sonar and scatterers; or rays thrown and followed, which also find echoes between targets and
    the seabed: for expected intensities, in water of one sound speed."""
    rays: Annotated[int, Field(ge=100, le=100_000_000)] = 200_000
    """Rays that the tracer throws from each side at each ping [1]."""
    target_specular_fraction: Annotated[float, Field(ge=0, le=1)] | None = None
    """Share of the energy that targets' faces mirror for the tracer [1]; None: all that their law does not scatter.
    Faces of a target that says how smooth it is mirror the square of that.

    Where families are named, echoes by a mirror on a target are followed only if this is given.
    """
    geometry: Literal["3d", "slice"] = "3d"
    """The whole scene, or the vertical plane of one beam, each point standing for its share of the footprint."""
    max_reflections: Annotated[int, Field(ge=0, le=12)] = 2
    """Most bounces of one leg."""
    families: tuple[str, ...] | None = None
    """Families followed, such as [D, S, BS]; None: all up to `reflections`."""
    contributions: tuple[Contribution, ...] = ("seabed", "surface", "target", "water")
    """Whose echoes are heard; whatever is left out still casts its shadows."""
    edge_diffraction: Literal["none", "knife-edge"] = "knife-edge"
    """How shadows of targets and of the ground end: as sound bends around edges and crests, or at once.

    The tracer's end at once, and so do those of the ground in expected intensities that take the quick way to it.
    """
    jitter: Annotated[float, Field(ge=0, le=100)] = 0.0
    """Largest random phase of each pulse replica, uniform from 0 [wavelengths]; its envelope stays in place."""
    amplitude_perturbation: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Largest random change of each replica's amplitude, uniform, as a part of it [1]."""
    scatterers_per_cell: Annotated[float, Field(ge=0.1, le=1000)] = 5.0
    """Drawn scatterers in each resolution cell of the beam's main lobe; fewer where it hardly listens [1]."""
    importance_sampling: bool = True
    """Whether drawn pings have few scatterers where a beam hardly listens, and meet faint pairs of legs at few of them,
    each for others; false: all everywhere, so that elements hear the very ground that beams do, several times as slow.
    """
    beam_cutoff_db: Annotated[Decibels, Field(ge=-120, le=-10)] = -50.0
    """Two-way beam level below which ground and bodies are left out [dB re the beam's axis]."""

    @field_validator("families")
    @classmethod
    def _known_families(cls, value: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for name in value or ():
            if not is_family(name):
                raise ValueError(
                    f"{name!r} is not a path family; write D for the direct path, or letters S (surface) "
                    "and B (bottom) in turn, from the sonar outward, such as BS"
                )
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
    def _tracer_takes_the_whole_scene(self) -> Self:
        if self.engine == "tracer" and self.geometry == "slice":
            raise field_error("geometry", "slice", "is one plane, but the tracer throws its rays all round. Write "
                          "geometry: 3d, or engine: eigenrays.")  # fmt: skip
        return self

    @property
    def followed_families(self) -> tuple[str, ...]:
        """The families that legs are looked for in."""
        every = families_up_to(self.max_reflections)
        return every if self.families is None else tuple(name for name in every if name in self.families)
