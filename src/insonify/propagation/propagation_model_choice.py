"""Choice of the propagation model: straight rays in water of one sound speed, refracted rays in layered water."""

from insonify.propagation.image_sources import StraightRays
from insonify.propagation.propagation_model import PropagationModel, RayDomain
from insonify.scene.scene import Scene


def propagation_model_for(scene: Scene, domain: RayDomain) -> PropagationModel:
    """Propagation model of a scene.

    Args:
        scene: Water, boundaries and occluders.
        domain: Domain of the rays of a survey.

    Returns:
        Image sources for one sound speed, also for a constant profile; exact rays and their tables otherwise.

    Raises:
        ValueError: The profile does not cover the depths from the surface to the seabed.
    """
    if not scene.water.layered:
        return StraightRays(scene)
    from insonify.propagation.refracted_rays import refracted_rays  # compiles kernels that straight rays do not need

    return refracted_rays(scene, domain)
