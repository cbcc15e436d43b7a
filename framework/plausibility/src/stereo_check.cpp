#include "stereo_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <Eigen/Geometry>

#include "viwo/camera/camera_model.hpp"
#include "viwo/math/significant.hpp"

namespace viwo {

StereoCheck::StereoCheck(const std::vector<CameraPrior>& cameras) {
  if (cameras.size() < 2) return;
  for (std::size_t i = 0; i < 2; ++i) cameras_.push_back(cameras[i].camera);
}

void StereoCheck::add(const std::string& sensor, const FeatureSample& sample) {
  if (cameras_.empty() || sample.camera < 0 || sample.camera > 1) return;
  if (sensor_.empty()) sensor_ = sensor;
  if (sensor != sensor_) return;
  if (sample.camera != last_.camera && std::abs(sample.t_ns - last_.t_ns) <= kSameInstantNs) {
    compare(sample);
  }
  last_ = sample;
  if (last_.points.size() > kMostPoints) last_.points.resize(kMostPoints);
}

/// Where the rays of two cameras through one point come nearest to each other.
void StereoCheck::compare(const FeatureSample& other) {
  const CameraView& a = cameras_[static_cast<std::size_t>(last_.camera)];
  const CameraView& b = cameras_[static_cast<std::size_t>(other.camera)];
  const Eigen::Matrix3d R_atob = b.R_ItoC * a.R_ItoC.transpose();
  const Eigen::Vector3d p_ainb = b.p_IinC - R_atob * a.p_IinC;
  for (const FeaturePoint& point : last_.points) {
    const auto same = std::find_if(other.points.begin(), other.points.end(),
                                   [&](const FeaturePoint& p) { return p.id == point.id; });
    if (same == other.points.end()) continue;
    const auto ray_a = unproject(a, {point.u_px, point.v_px});
    const auto ray_b = unproject(b, {same->u_px, same->v_px});
    if (!ray_a || !ray_b) continue;
    const Eigen::Vector3d u = R_atob * *ray_a;
    const Eigen::Vector3d& v = *ray_b;
    const double c = u.dot(v);
    const double squared_sine = 1. - c * c;
    constexpr double kLeastSine = 0.01;  // of far points the pixel noise decides
    if (squared_sine < kLeastSine * kLeastSine) continue;
    // p_ainb + s u = t v, in the least squares sense
    const double pu = p_ainb.dot(u), pv = p_ainb.dot(v);
    const double s = (c * pv - pu) / squared_sine;
    const double t = (pv - c * pu) / squared_sine;
    s < 0. && t < 0. ? ++behind_ : ++before_;
  }
}

void StereoCheck::findings(Findings& out) const {
  const std::int64_t all = before_ + behind_;
  if (all < 200 || 5 * behind_ < 4 * all) return;
  const double share = static_cast<double>(behind_) / static_cast<double>(all);
  out.push_back({sensor_ + " stereo",
                 sensor_ + ": points seen by cam0 and cam1 lie behind both (" +
                     significant(100. * share, 2) +
                     " %): the two cameras are swapped, or both images upside down",
                 false,
                 {},
                 true});
}

}  // namespace viwo
