#include "viwo/sim/true_cameras.hpp"

#include "viwo/camera/camera_chain.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/sim/random.hpp"

namespace viwo::sim {

std::vector<CameraView> cameras_of_file(const std::filesystem::path& file, int n_cameras) {
  std::vector<CameraView> cameras = log::read_kalibr_cameras(file);
  const auto n = static_cast<std::size_t>(n_cameras);
  if (n > cameras.size()) {
    throw ParamError("n_cameras",
                     "there are only " + std::to_string(cameras.size()) + " in " + file.string());
  }
  cameras.resize(n);
  return cameras;
}

std::vector<CameraView> true_cameras(const TrueCameraParams& params,
                                     std::vector<CameraView> of_file,
                                     const HostServices& services) {
  const auto& clock_s = params.camera_clock_error_s;
  if (clock_s.size() != 1 && clock_s.size() != of_file.size()) {
    throw ParamError("camera_clock_error_s", "needs one number, or one for each of the " +
                                                 std::to_string(of_file.size()) + " cameras, not " +
                                                 std::to_string(clock_s.size()));
  }
  if (services.exact) return of_file;
  ChainedErrors turns(params.true_camera_relative), shifts(params.true_camera_relative);
  for (std::size_t k = 0; k < of_file.size(); ++k) {
    CameraView& camera = of_file[k];
    camera.t_CtoI_s += clock_s[clock_s.size() == 1 ? 0 : k];
    RandomStream random(services.seed, Stream::kTrueCameras, k);
    const auto three = [&random](double sigma) {
      Eigen::Vector3d out;
      for (double& value : out) value = sigma * random.gaussian();
      return out;
    };
    const Eigen::Vector3d dtheta =
        turns.next(camera.R_ItoC, three(params.sigma_true_camera_orientation_rad));
    camera.p_IinC += shifts.next(camera.R_ItoC, three(params.sigma_true_camera_position_m));
    // So that the file's numbers stay to the bit where nothing is drawn.
    if (!dtheta.isZero(0.)) camera.R_ItoC = exp_so3(-dtheta) * camera.R_ItoC;
    const double focal_px = params.sigma_true_camera_focal_px;
    const double distortion = params.sigma_true_camera_distortion;
    for (int i = 0; i < 8; ++i) {
      camera.intrinsics[i] += (i < 4 ? focal_px : distortion) * random.gaussian();
    }
  }
  return of_file;
}

std::vector<CalibrationSample> camera_truth(std::span<const CameraView> cameras,
                                            std::int64_t t_ns) {
  constexpr const char* kIntrinsics[] = {"fx", "fy", "cx", "cy", "d1", "d2", "d3", "d4"};
  std::vector<CalibrationSample> out;
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    const CameraView& camera = cameras[k];
    const std::string name = "cam" + std::to_string(k) + ".";
    const Eigen::Vector3d theta = log_so3(camera.R_ItoC);
    for (int i = 0; i < 3; ++i) out.push_back({t_ns, name + "theta_ItoC_" + "xyz"[i], theta[i]});
    for (int i = 0; i < 3; ++i) {
      out.push_back({t_ns, name + "p_IinC_" + "xyz"[i], camera.p_IinC[i]});
    }
    for (int i = 0; i < 8; ++i) out.push_back({t_ns, name + kIntrinsics[i], camera.intrinsics[i]});
    out.push_back({t_ns, name + "t_CtoI", camera.t_CtoI_s});
  }
  return out;
}

std::int64_t camera_stamp_ns(const CameraView& camera, std::int64_t t_imu_ns) {
  return t_imu_ns - to_ns(camera.image_offset_s());
}

}  // namespace viwo::sim
