// Cameras that differ from what the configuration says of them, and the truth of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "viwo/api/host_services.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/rig.hpp"

namespace viwo::sim {

/// The first `n_cameras` of the file `cameras`; ParamError when there are less.
std::vector<CameraView> cameras_of_file(const ParamSet& params);

/// The cameras as they are, by the parameters of kTrueCameraParams: the clock by what is given,
/// R_ItoC = Exp(-dtheta) R_ItoC of the file, everything else by adding what is drawn. The draw of
/// a camera depends on seed and index alone. With `services.exact` they are those of the file.
/// ParamError for a list of a wrong length.
std::vector<CameraView> true_cameras(const ParamSet& params, std::vector<CameraView> of_file,
                                     const HostServices& services);

/// Of each camera k: cam<k>.theta_ItoC_x .. z = Log(R_ItoC), .p_IinC_x .. z, .fx, .fy, .cx, .cy,
/// .d1 .. .d4 and .t_CtoI.
std::vector<CalibrationSample> camera_truth(std::span<const CameraView> cameras, std::int64_t t_ns);

/// Stamp in the camera's own clock.
std::int64_t camera_stamp_ns(const CameraView& camera, std::int64_t t_imu_ns);

// clang-format off
inline constexpr std::array kTrueCameraParams{
    ParamSpec{.name = "camera_clock_error_s", .type = ParamType::kNumbers, .unit = "s",
              .fallback = "[0]", .min = -10., .max = 10.,
              .help = "true t_CtoI less timeshift_cam_imu of the file: [of all cameras] or one for "
                      "each; stamps are in the true clock"},
    ParamSpec{.name = "sigma_true_camera_orientation_rad", .type = ParamType::kNumber,
              .unit = "rad", .fallback = "0", .min = 0.,
              .help = "of what is drawn to turn the true cameras from the file's, per axis"},
    ParamSpec{.name = "sigma_true_camera_position_m", .type = ParamType::kNumber, .unit = "m",
              .fallback = "0", .min = 0., .help = "the same of p_IinC, per axis"},
    ParamSpec{.name = "sigma_true_camera_focal_px", .type = ParamType::kNumber, .unit = "px",
              .fallback = "0", .min = 0., .help = "the same of fx, fy, cx and cy"},
    ParamSpec{.name = "sigma_true_camera_distortion", .type = ParamType::kNumber,
              .fallback = "0", .min = 0., .help = "the same of the distortion coefficients"},
};
// clang-format on

}  // namespace viwo::sim
