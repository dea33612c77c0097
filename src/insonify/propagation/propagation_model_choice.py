"""Which rays a scene has: straight ones in water of one sound speed, curved ones in layered water."""

from insonify.propagation.image_sources import StraightRays
from insonify.propagation.propagation_model import PropagationModel, RayDomain
from insonify.scene.scene import Scene


def propagation_model_for(scene: Scene, domain: RayDomain) -> PropagationModel:
    """The rays of a scene.

    Args:
        scene: Water, boundaries and occluders.
        domain: What a survey needs of them.

    Returns:
        Images for one sound speed, also where a profile has but one; exact rays and their tables otherwise.

    Raises:
        ValueError: The profile does not reach from the surface to the seabed.
    """
    if not scene.water.layered:
        return StraightRays(scene)
    from insonify.propagation.refracted_rays import refracted_rays  # compiles more than water of one speed asks for

    return refracted_rays(scene, domain)
