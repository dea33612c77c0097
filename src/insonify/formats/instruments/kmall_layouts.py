"""Records of Kongsberg KMALL datagrams.

Kongsberg (2021), EM datagrams on *.kmall format, 410224 rev. I: EMdgmFormat.h, packed to 4 bytes, little-endian.
"""

from insonify.formats.instruments.columns import layout

HEADER = layout("u4 size; S4 kind; u1 version system; u2 model; u4 seconds nanoseconds")
PARTITION = layout("u2 count number")
BODY = layout("u2 size ping; u1 fans fan swaths swath tx_array rx_array rx_arrays algorithm")
PING = layout(
    "u2 size pad0; f4 ping_rate; u1 beam_spacing depth_mode sub_depth_mode swath_distance detection_mode pulse_form;"
    "u2 pad1; f4 frequency_mode lowest_frequency highest_frequency pulse_length effective_pulse_length bandwidth "
    "absorption port_edge starboard_edge port_coverage starboard_coverage; i2 port_metres starboard_metres;"
    "u1 stabilisation filter1; u2 filter2; u4 pipe; f4 tx_beam_width rx_beam_width power; u2 ramp_up pad2;"
    "f4 yaw_angle;"
    "u2 sectors sector_size; f4 heading sound_speed transducer_depth water_level x_to_all y_to_all;"
    "u1 position_method position_status attitude_status pad3; f8 latitude longitude; f4 ellipsoid_height"
)
SECTOR = layout(
    "u1 number tx_array sub_array pad0; f4 delay tilt source_level focus_range frequency bandwidth pulse_length;"
    "u1 shading waveform; u2 pad1; f4 voltage_level tracking_correction effective_pulse_length"
)
RX = layout(
    "u2 size soundings valid sounding_size; f4 water_column_rate seabed_image_rate normal_level oblique_level;"
    "u2 alarm extra classes class_size"
)
SOUNDING = layout(
    "u2 index; u1 sector type method rejection1 rejection2 post class confidence; u2 pad; f4 range_factor quality "
    "vertical_uncertainty horizontal_uncertainty window_length echo_length; u2 water_column_beam water_column_sample;"
    "f4 water_column_angle absorption level1 level2 sensitivity source_level calibration tvg angle angle_correction "
    "travel_time travel_time_correction delta_latitude delta_longitude down starboard forward incidence_correction;"
    "u2 cleaning first_sample centre_sample sample_count"
)
WATER_TX = layout("u2 size sectors sector_size; i2 pad; f4 heave")
WATER_SECTOR = layout("f4 tilt frequency beam_width; u2 number; i2 pad")
WATER_RX = layout("u2 size beams; u1 beam_size phase tvg_exponent; i1 tvg_offset; f4 sample_rate sound_speed")
WATER_BEAM = layout("f4 angle; u2 first_sample detected sector sample_count; f4 detected_range")
ATTITUDE_INFO = layout("u2 size; u1 system status; u2 format count sample_size contents")
ATTITUDE = layout(
    "S4 kind; u2 size version; u4 seconds nanoseconds status; f8 latitude longitude; f4 ellipsoid_height roll pitch "
    "yaw heave roll_rate pitch_rate yaw_rate velocity_north velocity_east velocity_down latitude_error longitude_error "
    "height_error roll_error pitch_error yaw_error heave_error acceleration_north acceleration_east acceleration_down;"
    "u4 delayed_seconds delayed_nanoseconds; f4 delayed_heave"
)
SENSOR = layout("u2 size system status pad")
POSITION = layout("u4 seconds nanoseconds; f4 quality; f8 latitude longitude; f4 speed course ellipsoid_height")
PROFILE = layout("u2 size count; S4 format; u4 seconds; f8 latitude longitude")
PROFILE_POINT = layout("f4 depth sound_speed; u4 pad; f4 temperature salinity")
SPEED_INFO = layout("u2 size status format count sample_size contents; f4 filter_time offset")
SPEED = layout("u4 seconds nanoseconds; f4 sound_speed temperature pressure salinity")
CLOCK = layout("f4 offset; i4 deviation")
POSITION_ERROR = layout(
    "u4 seconds nanoseconds; f4 range_rms major_axis minor_axis orientation latitude longitude height"
)
DEPTH = layout("f4 depth raw offset scale; f8 latitude longitude")
HEAVE = layout("f4 heave")
DEPTH_EARLIER = layout("f4 depth offset scale; f8 latitude longitude")
