#include "camera_check.hpp"

#include <algorithm>
#include <cmath>

#include "viwo/log/kalibr.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

/// "fx [px] of cam0 is 285 and 300"; "" for the same camera, but for what is lost in writing it.
std::string first_difference(const CameraView& a, const CameraView& b, std::size_t index) {
  const std::string of = " of cam" + std::to_string(index);
  if (a.distortion != b.distortion) return "distortion_model" + of + " is another";
  if (a.width_px != b.width_px || a.height_px != b.height_px) return "resolution" + of + " differs";
  std::string text;
  const auto compare = [&](const char* what, double x, double y) {
    if (!text.empty() || std::abs(x - y) <= 1e-6 * std::max(1., std::abs(x))) return;
    text = what + of + " is " + significant(x, 6) + " and " + significant(y, 6);
  };
  constexpr const char* kIntrinsics[] = {"fx [px]",          "fy [px]",          "cx [px]",
                                         "cy [px]",          "distortion no. 1", "distortion no. 2",
                                         "distortion no. 3", "distortion no. 4"};
  for (int i = 0; i < 8; ++i) compare(kIntrinsics[i], a.intrinsics[i], b.intrinsics[i]);
  const double turn = log_so3(a.R_ItoC * b.R_ItoC.transpose()).norm();
  if (text.empty() && turn > 1e-6) {
    text = "orientation on the IMU" + of + " differs by " + significant(turn, 3) + " rad";
  }
  constexpr const char* kPlace[] = {"x [m] of the IMU in", "y [m] of the IMU in",
                                    "z [m] of the IMU in"};
  for (int i = 0; i < 3; ++i) compare(kPlace[i], a.p_IinC[i], b.p_IinC[i]);
  compare("timeshift_cam_imu [s]", a.t_CtoI_s, b.t_CtoI_s);
  compare("line_delay_nanoseconds", 1e9 * a.line_delay_s, 1e9 * b.line_delay_s);
  return text;
}

/// The cameras that a sensor is configured with; none if its section says nothing of that kind.
std::vector<CameraView> cameras_of(const config::Node& section) {
  const config::Node* file = section.find("cameras");
  if (file == nullptr || !file->is_scalar()) return {};
  std::vector<CameraView> cameras;
  try {
    cameras = log::read_kalibr_cameras(file->scalar());
  } catch (const InputError&) {
    return {};  // `cameras` of this sensor is something else
  }
  const config::Node* n = section.find("n_cameras");
  if (n != nullptr && n->is_scalar() && n->scalar() == "1") cameras.resize(1);
  return cameras;
}

}  // namespace

std::vector<std::string> compare_cameras(const RunSetup& setup) {
  std::vector<std::string> lines;
  // Cameras that were made wrong on purpose differ.
  if (!setup.filter || setup.filter->drawn_from.contains("cam0.fx")) return lines;
  for (const SensorEntry& entry : setup.sensors) {
    const std::vector<CameraView> known = cameras_of(entry.sensor.resolved);
    std::string difference;
    for (std::size_t i = 0; i < std::min(known.size(), setup.filter->cameras.size()); ++i) {
      difference = first_difference(known[i], setup.filter->cameras[i].camera, i);
      if (!difference.empty()) break;
    }
    if (difference.empty()) continue;
    lines.push_back("sensors." + entry.name + ".cameras and cameras.kalibr differ: " + difference);
  }
  return lines;
}

}  // namespace viwo
