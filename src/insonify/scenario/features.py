"""Features of a scenario that decide which kernels a run of it calls."""

from insonify.scenario.scenario import Scenario


def scenario_features(
    scenario: Scenario, *, series: bool = True, labels: bool = False, levels: bool = False
) -> frozenset[str]:  # fmt: skip
    """Names of the features that a scenario has, and of the results that are computed of it.

    Args:
        scenario: The scenario.
        series: True if time series are computed, of the scenario's field.
        labels: True if samples are labelled.
        levels: True if levels are computed by contribution and pair.
    """
    sonar, paths, seabed, water = scenario.sonar, scenario.paths, scenario.seabed, scenario.water
    track, receiver = scenario.track, scenario.sonar.receiver
    has = {
        scenario.field: series,
        "labels": labels,
        "levels": levels,
        "seabed": "seabed" in paths.contributions and seabed.scattering is not None,
        "relief": bool(seabed.relief),
        "rough bed": seabed.reflecting_interface == "rough",
        "layered water": water.layered,
        "volume": water.volume_strength_db is not None or bool(water.patches),
        "targets": bool(scenario.targets),
        "occluders": bool(scenario.scene.occluders),
        "bounces": paths.max_reflections > 0,
        "knife edge": paths.edge_diffraction == "knife-edge",
        "slice": paths.geometry == "slice",
        "tracer": paths.engine == "tracer",
        "moving": track.kind != "static" and getattr(track, "speed", None) != 0 and not track.stop_and_hop,
        "two platforms": scenario.receiver_track is not None,
        "elements": receiver.record == "elements",
        "many beams": sonar.beam_count > 1,
        "several sides": len(sonar.side_sonars) > 1,
        "hull": sonar.hull is not None,
    }
    return frozenset({f"{scenario.surface.reflection} surface", *(name for name in has if has[name])})
