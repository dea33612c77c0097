"""Message definitions of sonars in ROS 2, and messages made from plain fields.

Fields and constants of marine_acoustic_msgs 2.1.0 (github.com/apl-ocean-engineering/marine_msgs) and of
marine_interfaces/SonarInfo (github.com/rolker/unh_marine_autonomy, pull requests 266 and 269). The other messages are
those of ROS 2 Jazzy.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

Fields = Mapping[str, Any]
"""Fields of a message by name; those of messages within it are mappings again."""

DEFINITIONS = {
    "marine_acoustic_msgs/msg/PingInfo": "float32 frequency|float32 sound_speed|float32[] tx_beamwidths|"
    "float32[] rx_beamwidths",
    "marine_acoustic_msgs/msg/DetectionFlag": "uint8 DETECT_OK=0|uint8 DETECT_BAD_SONAR=1|uint8 DETECT_BAD_FILTER=2|"
    "uint8 DETECT_BAD_USER=4|uint8 flag",
    "marine_acoustic_msgs/msg/SonarImageData": "bool is_bigendian|uint32 DTYPE_UINT8=0|uint32 DTYPE_INT8=1|"
    "uint32 DTYPE_UINT16=2|uint32 DTYPE_INT16=3|uint32 DTYPE_UINT32=4|uint32 DTYPE_INT32=5|uint32 DTYPE_UINT64=6|"
    "uint32 DTYPE_INT64=7|uint32 DTYPE_FLOAT32=8|uint32 DTYPE_FLOAT64=9|uint32 dtype|uint32 beam_count|uint8[] data",
    "marine_acoustic_msgs/msg/RawSonarImage": "std_msgs/Header header|PingInfo ping_info|float32 sample_rate|"
    "uint32 samples_per_beam|uint32 sample0|float32[] tx_delays|float32[] tx_angles|float32[] rx_angles|"
    "SonarImageData image",
    "marine_acoustic_msgs/msg/ProjectedSonarImage": "std_msgs/Header header|PingInfo ping_info|"
    "geometry_msgs/Vector3[] beam_directions|float32[] ranges|SonarImageData image",
    "marine_acoustic_msgs/msg/SonarDetections": "std_msgs/Header header|PingInfo ping_info|DetectionFlag[] flags|"
    "float32[] two_way_travel_times|float32[] tx_delays|float32[] intensities|float32[] tx_angles|float32[] rx_angles",
    "marine_acoustic_msgs/msg/SonarRanges": "std_msgs/Header header|PingInfo ping_info|DetectionFlag[] flags|"
    "float32[] transmit_delays|float32[] intensities|geometry_msgs/Vector3[] beam_unit_vec|float32[] ranges",
    "marine_interfaces/msg/SonarInfo": "std_msgs/Header header|string sonar_model|string calibration_ref|"
    "builtin_interfaces/Time calibration_time|float32[] pulse_lengths|float32[] bandwidths|"
    "uint8 SIGNAL_TYPE_UNKNOWN=0|uint8 SIGNAL_TYPE_CW=1|uint8 SIGNAL_TYPE_FM_UP=2|uint8 SIGNAL_TYPE_FM_DOWN=3|"
    "uint8[] tx_signal_types|uint8 QUANTITY_UNKNOWN=0|uint8 QUANTITY_RAW_ADC=1|uint8 QUANTITY_AMPLITUDE=2|"
    "uint8 QUANTITY_POWER=3|uint8 intensity_quantity|uint8 INTENSITY_SCALE_UNKNOWN=0|uint8 INTENSITY_SCALE_LINEAR=1|"
    "uint8 INTENSITY_SCALE_DB=2|uint8 intensity_scale|uint8 REFERENCE_UNKNOWN=0|"
    "uint8 REFERENCE_UNCALIBRATED_RELATIVE=1|uint8 REFERENCE_ABSOLUTE_1UPA=2|uint8 intensity_reference|float32 scale|"
    "float32 offset|uint8 TVG_UNKNOWN=0|uint8 TVG_NONE=1|uint8 TVG_20LOGR=2|uint8 TVG_40LOGR=3|uint8 TVG_CUSTOM=4|"
    "uint8 tvg_model|float32 tvg_absorption_db_per_km|float32 source_level_db|uint8 ANGULAR_NORMALIZATION_UNKNOWN=0|"
    "uint8 ANGULAR_NORMALIZATION_NOT_APPLIED=1|uint8 ANGULAR_NORMALIZATION_APPLIED=2|uint8 angular_normalization|"
    "float32[] angular_response_angle_deg|float32[] angular_response_db_rel_nadir|"
    "uint8 ANGULAR_RESPONSE_TL_UNKNOWN=0|uint8 ANGULAR_RESPONSE_TL_IN=1|uint8 ANGULAR_RESPONSE_TL_REMOVED=2|"
    "uint8 angular_response_tl|float32 angular_response_absorption_db_per_m|float32[] beam_pattern_angle_deg|"
    "float32[] beam_pattern_gain_db",
}  # fmt: skip
"""Fields and constants of each message, in their order."""


def typestore() -> Typestore:
    """Types of ROS 2 Jazzy with those of `DEFINITIONS`."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    types: dict[str, Any] = {}
    for name, fields in DEFINITIONS.items():
        types.update(get_types_from_msg(fields.replace("|", "\n"), name))
    store.register(types)
    return store


def message(store: Typestore, name: str, fields: Fields) -> Any:
    """Message of a type with all of its fields.

    Args:
        store: Types, as from `typestore`.
        name: Name of the type.
        fields: Its fields.

    Raises:
        KeyError: A field is missing.
    """
    values = {field: _value(store, kind, fields[field]) for field, kind in store.fielddefs[name][1]}
    return store.types[name](**values)


def _value(store: Typestore, kind: Any, value: Any) -> Any:
    """Value of one field: a message, a list of them, an array, or as it is."""
    node, detail = kind
    if node.name == "NAME":
        return message(store, detail, value)
    if node.name == "BASE":
        return value
    (of, name), _ = detail
    if of.name == "NAME":
        return [message(store, name, one) for one in value]
    return np.asarray(value, name[0])
