#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

void CalibrationOptions::bind(ParamBinder& b) {
  b(VIWO_PARAM(reference),
    {{"auto", ReferenceKind::kAuto},
     {"poses", ReferenceKind::kPoses},
     {"gyro", ReferenceKind::kGyro},
     {"smoother", ReferenceKind::kSmoother},
     {"none", ReferenceKind::kNone}},
    {.help = "what the wheels are compared with: reference poses, the turn by the gyro, all that "
             "the filter of the base takes (smoother: cameras, mount and clocks are calibrated as "
             "the base asks for; what stands below is not for it), or nothing but each "
             "other; auto: poses where there are any, else the gyro. A label distance_m "
             "of a recording says how far it was driven, along the path of O, a label turn_deg by "
             "how much it has turned from start to end, whole turns with it"});
  b(VIWO_PARAM(segments),
    {{"auto", Segments::kAuto},
     {"whole", Segments::kWhole},
     {"length", Segments::kLength},
     {"poses", Segments::kPoses},
     {"trajectory", Segments::kTrajectory}},
    {.help = "what is compared: segments of the length whose estimate is the surest, whole "
             "recordings, segments of segment_s, from each reference pose to the next, or from the "
             "start to every segment_s"});
  b(VIWO_PARAM(segment_s),
    {.unit = "s", .min = 0., .help = "length of the segments; alone it means segments: length"});
  b(VIWO_PARAM(parity), {.help = "use the parity residual: how the wheels contradict each other"});
  b(VIWO_PARAM(find_steering_zeros),
    {.help = "search the zeros of the steering encoders on the whole circle, whatever is nominal"});
  b(VIWO_PARAM(find_drive_signs),
    {.help = "search for drives that turn backwards; of a steered wheel with find_steering_zeros "
             "that is a zero half a turn away"});
  b(VIWO_PARAM(estimate_extrinsics),
    {.help = "estimate where O is in the reference body; then the gauge entries are held"});
  b(VIWO_PARAM(extrinsics_x_m_y_m_yaw_rad),
    {.unit = "m, m, rad", .help = "where O nominally is in the reference body"});
  b(VIWO_PARAM(prior_sigma_extrinsics_m),
    {.unit = "m",
     .above = 0.,
     .help = "how well the position of O in the reference body is known"});
  b(VIWO_PARAM(prior_sigma_extrinsics_rad),
    {.unit = "rad", .above = 0., .help = "how well the yaw of O in the reference body is known"});
  b(VIWO_PARAM(prior_sigma_clock_offset_s),
    {.unit = "s",
     .min = 0.,
     .max = 1.,
     .help = "prior of one clock offset per recording; 0: it is exactly what is configured"});
  b(VIWO_PARAM(prior_sigma_gyro_bias_rad_per_s),
    {.unit = "rad/s", .above = 0., .help = "prior of the gyro's bias, one per recording"});
  b(VIWO_PARAM(sigma_distance_m),
    {.unit = "m", .above = 0., .help = "how well the label distance_m is measured"});
  b(VIWO_PARAM(sigma_turn_deg),
    {.unit = "deg", .above = 0., .help = "how well the label turn_deg is measured"});
}

}  // namespace viwo::calibration
