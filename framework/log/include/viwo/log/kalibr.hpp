// Camera chains and IMU noises as Kalibr writes them (camchain-imucam.yaml, imu.yaml), also with
// OpenCV's first line "%YAML:1.0". Keys that are not needed here are ignored.
#pragma once

#include <filesystem>
#include <vector>

#include "viwo/api/filter_view.hpp"

namespace viwo::log {

/// Cameras cam0, cam1, ... in this order: camera_model pinhole, distortion_model radtan or
/// equidistant, intrinsics, distortion_coeffs, resolution, and the place on the IMU as T_cam_imu
/// (p_C = T_cam_imu p_I), T_imu_cam, or T_cn_cnm1 after a camera whose place is known. Rotations
/// may be off by 1e-3 (rounding in the file) and are made exact. timeshift_cam_imu [s] becomes
/// t_CtoI_s, line_delay_nanoseconds (of a rolling shutter, from row to row) line_delay_s.
/// InputError with all that is wrong, one line "file:line:column  what" each.
std::vector<CameraView> read_kalibr_cameras(const std::filesystem::path& file);

/// gyroscope_noise_density, gyroscope_random_walk, accelerometer_noise_density and
/// accelerometer_random_walk, at the top level or below `imu0`. InputError as above.
ImuNoise read_kalibr_imu(const std::filesystem::path& file);

}  // namespace viwo::log
