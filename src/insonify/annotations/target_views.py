"""Range, altitude, grazing angle and aspect under which the sonar has a target, and the conditions of an image."""

from dataclasses import replace
from typing import Any

import numpy as np

from insonify.annotations.labelled_image import LabelledImage
from insonify.scene.target import PointTarget, Target, shape_name
from insonify.surveys.survey import Survey

SLOPE_STEP = 0.5
"""Half of the distance over which the slope of the seabed under a target is taken [m]."""


def with_views(survey: Survey, image: LabelledImage) -> LabelledImage:
    """Image with its conditions and with the views of the targets in it.

    A view is that of the ping in the middle of the target's rows, or in a mosaic of the nearest ping. It has the slant
    range to the point of the seabed under the target's middle, or to a point target itself; the grazing angle on the
    slope there; and the aspect, the bearing of the sonar from the target re its heading, 0 ahead of it, 90 deg to its
    starboard.
    """
    views = dict[int, dict[str, Any]]()
    targets = {target.label: target for target in survey.scenario.targets}
    for instance in np.unique(image.layers[image.layers > 0]).tolist():
        target = targets.get(image.instance_names[instance - 1])
        if target is not None:
            rows = np.flatnonzero((image.layers == instance).any(axis=(0, 2)))
            views[instance] = _view(survey, target, _ping(survey, image, target, int(np.median(rows))))
    return replace(image, views=views, conditions=_conditions(survey, image))


def _ping(survey: Survey, image: LabelledImage, target: Target, row: int) -> int:
    """Number, within the recorded pings, of the ping of a row, or in a mosaic of the one nearest to a target."""
    if image.pings.size:
        return int(np.searchsorted(survey.rows, image.pings[min(row, image.pings.size - 1)]))
    return int(np.argmin(np.hypot(*(survey.position[:, :2] - target.position[:2]).T)))


def _view(survey: Survey, target: Target, number: int) -> dict[str, Any]:
    """View of a target from one ping: distances in metres, angles in degrees."""
    north, east = target.position[:2]
    bed = float(survey.bed_depth(np.array([north]), np.array([east]))[0])
    depth = target.position[2] if isinstance(target, PointTarget) else target.base_depth
    depth = bed if depth is None else depth
    sonar = survey.position[number]
    to_target = np.array([north, east, depth]) - sonar
    slant, horizontal = float(np.linalg.norm(to_target)), float(np.hypot(*to_target[:2]))
    steps = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]]) * SLOPE_STEP
    around = survey.bed_depth(north + steps[:, 0], east + steps[:, 1])
    normal = np.array([around[1] - around[0], around[3] - around[2], 2 * SLOPE_STEP])  # downwards
    sine = float(to_target @ normal / (slant * np.linalg.norm(normal)))
    bearing = np.arctan2(-to_target[1], -to_target[0])
    return {
        "shape": shape_name(target),
        "ping": int(survey.rows[number]),
        "slant_range_m": round(slant, 3),
        "ground_range_m": round(horizontal, 3),
        "grazing_deg": round(float(np.degrees(np.arcsin(np.clip(sine, -1, 1)))), 2),
        "aspect_deg": round(float(np.degrees(bearing - getattr(target, "heading", 0.0)) % 360), 2),
        "altitude_m": round(float(survey.altitude[number]), 3),
        "position_m": [round(float(value), 3) for value in (north, east, depth)],
    }


def _conditions(survey: Survey, image: LabelledImage) -> dict[str, Any]:
    """Conditions of an image: sediment, altitude, frequency, wind."""
    scenario = survey.scenario
    numbers = np.searchsorted(survey.rows, image.pings) if image.pings.size else slice(None)
    law = scenario.seabed.scattering
    return {
        "sediment": getattr(law, "sediment", None),
        "scattering_law": getattr(law, "law", None),
        "altitude_m": round(float(np.mean(survey.altitude[numbers])), 3),
        "frequency_hz": float(scenario.sonar.pulse.frequency),
        "seed": int(scenario.seed),
    }
