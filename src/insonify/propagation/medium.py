"""Which rays a scene has: straight ones in water of one sound speed, curved ones in layered water."""

from insonify.propagation.images import StraightRays
from insonify.propagation.rays import Domain, Rays
from insonify.scene.scene import Scene


def rays_in(scene: Scene, domain: Domain) -> Rays:
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
    from insonify.propagation.curved import curved_rays  # compiles more than water of one speed asks for

    return curved_rays(scene, domain)
