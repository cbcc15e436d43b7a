// The checks of a recording, each by itself. What they need is in the recording or it is not there:
// then they say nothing, or a note why.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "viwo/inspect/inspection.hpp"
#include "viwo/series/recording.hpp"

namespace viwo::inspect {

/// Whether `check` has found a fault of a sensor already.
bool is_fault(const Findings& findings, std::string_view sensor, std::string_view check);

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
/// By how much the rows of the wheels contradict each other with these intrinsics, rms, m/s; NaN
/// where none can be told.
double contradiction_of(const series::Wheels& wheels, const Intrinsics& x_WI);
/// Drives and steerings that never change.
void check_still_channels(const series::Recording& recording, Findings& out);
/// Wheels that the others contradict, noises against the configuration.
void check_wheels(const series::Recording& recording, Findings& out);
/// Headings that were set to another value on the way.
void check_headings(const series::Recording& recording, Findings& out);
/// Angles of drives that begin anew after a turn, rates that no wheel has, zeros in their place.
void check_turns(const series::Recording& recording, Findings& out);
/// Signs, gears and order of the channels: by what the wheels contradict each other, and by the
/// gyro's rate.
void check_order(const series::Recording& recording, Findings& out);
/// Times in which the wheels turn otherwise than the gyro, and else as it does.
void check_slip(const series::Recording& recording, Findings& out);
/// Constant offsets of steering angles that stop the wheels from contradicting each other.
void check_steer_offsets(const series::Recording& recording, Findings& out);
/// Steering angles that are of another time than the drives.
void check_steer_lag(const series::Recording& recording, Findings& out);
/// Clock, sign and scale of the wheels' yaw rate against the gyro's.
void check_wheel_clocks(const series::Recording& recording, Findings& out);
/// Clock and axes of each camera against the gyro.
void check_camera_clocks(const series::Recording& recording, Findings& out);
/// Clock, sign and speed of poses against gyro and wheels.
void check_poses(const series::Recording& recording, Findings& out);
/// How good poses are as a reference, by the IMU: noise of their orientations, their vertical.
void check_references(const series::Recording& recording, Findings& out);

}  // namespace viwo::inspect
