// The checks of a recording, each by itself. What they need is in the recording or it is not there:
// then they say nothing, or a note why.
#pragma once

#include <string>
#include <vector>

#include "viwo/checks/finding.hpp"
#include "viwo/series/recording.hpp"

namespace viwo::inspect {

/// How a camera turns, in the axes and the time of the IMU as they are configured.
std::vector<series::Turn> turns_in_imu(const series::Recording& recording,
                                       const series::CameraTurns& camera);

/// What texts call one of the cameras that have tracks.
std::string label_of(const series::Recording& recording, const series::CameraTurns& camera);

/// Rate, jitter, gaps, what readers have rejected, sensors that broke off, what is in common.
void check_stamps(const series::Recording& recording, Findings& out);
/// Gravity at rest, biases, channels that repeat.
void check_imu(const series::Recording& recording, Findings& out);
/// Unit, signs and axes of the gyro against the tilt that the accelerometer shows.
void check_tilt(const series::Recording& recording, Findings& out);
/// White noise and random walk at rest, by Allan deviations, against the configuration.
void check_imu_noise(const series::Recording& recording, Findings& out);
/// Headings that were set to another value on the way.
void check_headings(const series::Recording& recording, Findings& out);
/// Clock, sign and scale of the wheels' yaw rate against the gyro's.
void check_wheel_clocks(const series::Recording& recording, Findings& out);
/// Clock and axes of each camera against the gyro.
void check_camera_clocks(const series::Recording& recording, Findings& out);
/// Clock, sign and speed of poses against gyro and wheels.
void check_poses(const series::Recording& recording, Findings& out);
/// How good poses are as a reference, by the IMU: noise of their orientations, their vertical.
void check_references(const series::Recording& recording, Findings& out);

}  // namespace viwo::inspect
