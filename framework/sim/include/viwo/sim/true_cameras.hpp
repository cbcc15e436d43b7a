// Cameras that differ from what the configuration says of them, and the truth of them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "viwo/api/host_services.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/rig.hpp"

namespace viwo::sim {

/// How cameras differ from what the configuration says of them.
struct TrueCameraParams {
  std::vector<double> camera_clock_error_s{0.};
  double sigma_true_camera_orientation_rad = 0.;
  double sigma_true_camera_position_m = 0.;
  double true_camera_relative = 0.1;
  double sigma_true_camera_focal_px = 0.;
  double sigma_true_camera_distortion = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(camera_clock_error_s),
      {.unit = "s",
       .min = -10.,
       .max = 10.,
       .help = "true t_CtoI less timeshift_cam_imu of the file: [of all cameras] or one for "
               "each; stamps are in the true clock"});
    b(VIWO_PARAM(sigma_true_camera_orientation_rad),
      {.unit = "rad",
       .min = 0.,
       .help = "of what is drawn to turn the true cameras from the file's, per axis"});
    b(VIWO_PARAM(sigma_true_camera_position_m),
      {.unit = "m", .min = 0., .help = "the same of p_IinC, per axis"});
    b(VIWO_PARAM(true_camera_relative),
      {.min = 0.,
       .max = 1.,
       .help = "part of what is drawn for their poses by which true cameras are off against the "
               "first; 1: each by itself"});
    b(VIWO_PARAM(sigma_true_camera_focal_px),
      {.unit = "px", .min = 0., .help = "the same of fx, fy, cx and cy"});
    b(VIWO_PARAM(sigma_true_camera_distortion),
      {.min = 0., .help = "the same of the distortion coefficients"});
  }
};

/// The first `n_cameras` of the file; ParamError for "n_cameras" when there are less.
std::vector<CameraView> cameras_of_file(const std::filesystem::path& file, int n_cameras);

/// The cameras as they are: the clock by what is given,
/// R_ItoC = Exp(-dtheta) R_ItoC of the file, everything else by adding what is drawn. The draw of
/// a camera depends on seed and index alone; its pose moves with that of the first (F-44). With
/// `services.exact` they are those of the file. ParamError for a list of a wrong length.
std::vector<CameraView> true_cameras(const TrueCameraParams& params,
                                     std::vector<CameraView> of_file, const HostServices& services);

/// Of each camera k: cam<k>.theta_ItoC_x .. z = Log(R_ItoC), .p_IinC_x .. z, .fx, .fy, .cx, .cy,
/// .d1 .. .d4 and .t_CtoI.
std::vector<CalibrationSample> camera_truth(std::span<const CameraView> cameras, std::int64_t t_ns);

/// Stamp in the camera's own clock of the image whose middle row is of that time.
std::int64_t camera_stamp_ns(const CameraView& camera, std::int64_t t_imu_ns);

}  // namespace viwo::sim
