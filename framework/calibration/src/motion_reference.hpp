// What the wheels of a recording are compared with: poses, or the turn that a gyro measures.
#pragma once

#include <span>

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// The axis about which a base on flat ground turns, in I, pointing up (CAL-9): the principal one
/// of the gyro's scatter where it stands out, else what the accelerometer feels. Throws InputError
/// when the accelerometer does not tell which way is up.
Eigen::Vector3d turning_axis(std::span<const ImuSample> imu);

/// Yaw of I by its gyro, bias and all, from zero; positions are zero.
Trajectory yaw_of_gyro(std::span<const ImuSample> imu);

/// The same of a gyro that integrates for itself.
Trajectory yaw_of_headings(std::span<const HeadingSample> headings);

/// The reference of a recording. Throws InputError when there is none of the kind, or when the
/// labels distance_m or turn_deg are no such numbers.
MotionReference motion_reference(const Recording& label, const RunSetup& setup, const RunData& data,
                                 ReferenceKind kind);

}  // namespace viwo::calibration
