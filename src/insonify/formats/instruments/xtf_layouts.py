"""Records of eXtended Triton Format (XTF) files.

Triton Imaging (2016), XTF file format, rev. X41, tables C-J and P; little-endian, packed to 1 byte.
"""

from insonify.formats.instruments.columns import layout

FILE = layout(
    "u1 format system; S8 program version; S16 sonar; u2 sonar_type; S64 note name; u2 navigation_units sonar_channels "
    "bathymetry_channels; u1 snippet_channels forward_arrays; u2 strength_channels; u1 interferometry_channels spare1;"
    "u2 spare2; f4 reference_height; V22 projection; i4 latency; f4 origin_y origin_x navigation_forward "
    "navigation_starboard navigation_down navigation_yaw motion_forward motion_starboard motion_down motion_yaw "
    "motion_pitch motion_roll"
)
CHANNEL = layout(
    "u1 kind number; u2 correction unipolar sample_size; u4 samples; S16 name; f4 volts frequency along_beam_width "
    "tilt across_beam_width starboard forward down yaw pitch roll; u2 beams; u1 sample_format; V53 spare"
)
PACKET = layout("u2 magic; u1 kind channel; u2 channels; V4 spare; u4 size")
DATE = "u2 year; u1 month day hour minute second"
PING = layout(
    "u2 magic; u1 kind channel; u2 channels; V4 spare; u4 size;" + DATE + " hundredths; u2 julian_day; u4 event ping;"
    "f4 sound_speed tide; V4 spare2; f4 conductivity_frequency temperature_frequency pressure_frequency "
    "pressure_temperature conductivity temperature pressure computed_sound_speed; V36 sensors; f4 speed_log turbidity "
    "ship_speed ship_heading; f8 ship_latitude ship_longitude; u2 ship_altitude ship_depth;"
    "u1 fix_hour fix_minute fix_second fix_hundredths; f4 speed kp;"
    "f8 latitude longitude; u2 status range_to_fish bearing_to_fish cable_out; f4 layback cable_tension sensor_depth "
    "altitude auxiliary_altitude pitch roll heading heave yaw; u4 attitude_tag; f4 off_track; u4 fix_tag; V20 rest"
)
PING_CHANNEL = layout(
    "u2 channel downsampling; f4 slant_range ground_range time_delay time_duration ping_interval; u2 processing "
    "frequency initial_gain gain bandwidth; V8 contact; u4 samples; u2 millivolts; V10 contact2; i2 weight; V4 spare"
)
ATTITUDE = layout(
    "u2 magic; u1 kind channel; u2 channels; V4 spare; u4 size; V8 spare2; u4 microseconds epoch; f4 pitch roll heave "
    "yaw; u4 tag; f4 heading;" + DATE + "; u2 milliseconds; u1 spare3"
)
NAVIGATION = layout(
    "u2 magic; u1 kind; V7 spare; u4 size;"
    + DATE
    + "; u4 microseconds epoch tag; f8 latitude longitude height; u1 flag;"
    "V6 spare2"
)
RAW_POSITION = layout(
    "u2 magic; u1 kind channel; u2 channels; V4 spare; u4 size;" + DATE + "; u2 tenths; f8 latitude longitude height;"
    "f4 pitch roll heave heading; u1 spare2"
)
NOTE = layout("u2 magic; u1 kind channel; u2 channels; V4 spare; u4 size;" + DATE + "; V35 spare2; S200 text")
MULTIBEAM_BEAM = layout("i4 beam; f8 intensity; i4 quality; f8 travel_time delta_time beam_angle tilt; V16 spare")
