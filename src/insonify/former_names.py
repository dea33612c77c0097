"""Former names of scenario keys and of their values, so that an old file gets an error with the name to write."""

FORMER_KEYS: dict[str, dict[str, str]] = {
    "ArcArray": {"span": "arc_angle"},
    "AngleError": {"memory": "correlation_time"},
    "Crosstalk": {"transmit_db": "feedthrough_db"},
    "ElementArray": {"facings": "orientations", "places": "positions"},
    "ElementErrors": {"place": "position"},
    "Inhomogeneity": {"length": "correlation_length", "lifetime": "correlation_time"},
    "MotionSpectrum": {"spread": "bandwidth"},
    "PathSettings": {
        "beam_floor_db": "beam_cutoff_db",
        "causes": "contributions",
        "edges": "edge_diffraction",
        "reflections": "max_reflections",
        "target_mirror": "target_specular_fraction",
        "thinning": "importance_sampling",
    },
    "PingSchedule": {"logged": "navigation_errors"},
    "PositionError": {"memory": "correlation_time"},
    "Receiver": {"band": "bandwidth", "compress": "matched_filter", "converter": "adc"},
    "ReceiverGain": {"most_db": "max_db", "spreading": "tvg_db_per_decade"},
    "SeaNoise": {"whence": "directionality"},
    "Seabed": {"bounce": "reflecting_interface", "lattice": "scatterer_grid", "split": "cutoff_wavelength"},
    "Surface": {"bounce": "reflection", "split": "cutoff_wavelength", "waves_to": "wave_direction"},
    "Body": {"smooth": "face_reflection_coefficient"},
    "Texture": {"length": "correlation_length", "shape": "k_shape"},
}
"""By the name of a model: the new name of each key that was renamed."""

FORMER_VALUES: dict[str, dict[str, dict[str, str]]] = {
    "PathSettings": {"edge_diffraction": {"fresnel": "knife-edge", "hard": "none"}, "engine": {"paths": "eigenrays"}},
    "SeaNoise": {"directionality": {"everywhere": "isotropic"}},
    "Surface": {"reflection": {"mirror": "flat", "waves": "explicit"}},
}
"""By the name of a model and of its key: the new name of each value that was renamed."""

FORMER_WORDS = {"learnt": "empirical"}
"""New names of options' and arguments' values that were renamed: the gain of a sidescan image."""


def former_key(model: type, name: str) -> str:
    """New name of a key of a model, or of one of its base classes, that was renamed; empty for any other name.

    Args:
        model: Class of the model.
        name: Name of the key, as given.

    Example:
        >>> from insonify.propagation.path_settings import PathSettings
        >>> former_key(PathSettings, "thinning")
        'importance_sampling'
    """
    return next(
        (FORMER_KEYS[base.__name__][name] for base in model.__mro__ if name in FORMER_KEYS.get(base.__name__, {})), ""
    )


def former_value(model: type, name: str, value: object) -> str:
    """New name of a value of a model's key that was renamed; empty for any other value.

    Args:
        model: Class of the model.
        name: Name of the key.
        value: Its value, as given.
    """
    if not isinstance(value, str):
        return ""
    return next(
        (
            FORMER_VALUES[base.__name__].get(name, {}).get(value, "")
            for base in model.__mro__
            if base.__name__ in FORMER_VALUES
        ),
        "",
    )
