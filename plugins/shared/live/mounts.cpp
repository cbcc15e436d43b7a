#include "mounts.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

#include "viwo/log/text.hpp"
#include "viwo/math/rpy.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::live {
namespace {

// LIV-9: what a robot's description errs by when it is right.
constexpr double kErrM = 0.02;
constexpr double kErrRad = 0.03;
constexpr double kSigmas = 3.;

std::string list_text(const Eigen::VectorXd& v) {
  std::string text;
  for (const double value : v) text += (text.empty() ? "[" : ", ") + significant(value, 6);
  return text + "]";
}

/// To a thousandth of its unit.
std::string rounded(double value) { return significant(1e-3 * std::round(1e3 * value), 6); }

/// As Kalibr has it, with R_ItoC and p_IinC.
std::string matrix_text(const FramePose& pose) {
  std::string text = "[";
  for (Eigen::Index i = 0; i < 3; ++i) {
    text += list_text(Eigen::Vector4d(pose.R_AtoB(i, 0), pose.R_AtoB(i, 1), pose.R_AtoB(i, 2),
                                      pose.p_AinB(i))) +
            ", ";
  }
  return text + "[0, 0, 0, 1]]";
}

/// Three numbers of the calibration and the length of their sigmas, from `name` on.
struct Three {
  Eigen::Vector3d value;
  double sigma = 0.;
};
std::optional<Three> three_of(const EstimateSample& estimate, const std::string& name) {
  const auto& names = estimate.calibration_names;
  const auto at = std::find(names.begin(), names.end(), name + "_x");
  if (names.end() - at < 3) return std::nullopt;
  const auto i = static_cast<std::size_t>(at - names.begin());
  const auto vector_at = [i](const std::vector<double>& v) {
    return Eigen::Vector3d(v[i], v[i + 1], v[i + 2]);
  };
  return Three{vector_at(estimate.calibration), vector_at(estimate.calibration_sigma).norm()};
}

}  // namespace

std::vector<Mounts::Wanted> Mounts::wanted_by(const LiveParams& params) {
  std::vector<Wanted> all;
  if (params.imu_frame.empty()) return all;
  if (params.publish) all.push_back({Of::kBody, params.body_frame});
  if (!params.wheel_frame.empty()) all.push_back({Of::kWheels, params.wheel_frame});
  int camera = 0;
  for (const std::string& frame : params.camera_frames) {
    all.push_back({Of::kCamera, frame, camera++});
  }
  return all;
}

Mounts::Mounts(const LiveParams& params, const HostServices& services)
    : services_(services),
      imu_frame_(params.imu_frame),
      frames_(params.frames()),
      wanted_(wanted_by(params)) {
  find();  // a frame in itself is known
}

bool Mounts::are_known() const {
  const std::scoped_lock lock(mutex_);
  return std::all_of(wanted_.begin(), wanted_.end(),
                     [](const Wanted& wanted) { return wanted.imu_in_it.has_value(); });
}

std::optional<OutputFrames> Mounts::frames() const {
  const std::scoped_lock lock(mutex_);
  OutputFrames frames = frames_;
  for (const Wanted& wanted : wanted_) {
    if (wanted.of != Of::kBody) continue;
    if (!wanted.imu_in_it) return std::nullopt;
    frames.R_ItoB = wanted.imu_in_it->R_AtoB;
    frames.p_IinB = wanted.imu_in_it->p_AinB;
  }
  return frames;
}

void Mounts::take(const std::vector<bag::Transform>& transforms) {
  std::string why;  // the last of them: the rest is likely the same
  {
    const std::scoped_lock lock(mutex_);
    for (const bag::Transform& transform : transforms) {
      if (const std::string no = tree_.add(transform); !no.empty()) why = no;
    }
  }
  if (!why.empty()) say_useless("/tf_static: " + why);
  find();
}

void Mounts::take_description(const std::string& urdf) {
  FrameTree described;  // to read it takes time, which the estimate is not to wait for
  const std::string why = described.add_urdf(urdf);
  {
    const std::scoped_lock lock(mutex_);
    tree_.merge(described);
  }
  if (!why.empty()) say_useless(why);
  find();
}

void Mounts::say_useless(const std::string& why) {
  say_once(LogLevel::kWarning, why + "; it is not used");
}

void Mounts::find() {
  std::vector<std::string> news;
  {
    const std::scoped_lock lock(mutex_);
    for (Wanted& wanted : wanted_) {
      const auto found = tree_.find(imu_frame_, wanted.frame);
      if (!found) continue;
      const bool is_same = wanted.imu_in_it &&
                           found->R_AtoB.isApprox(wanted.imu_in_it->R_AtoB, 1e-9) &&
                           found->p_AinB.isApprox(wanted.imu_in_it->p_AinB, 1e-9);
      if (is_same) continue;
      wanted.imu_in_it = found;
      wanted.contradicts = false;
      news.push_back(text(wanted));
    }
  }
  for (const std::string& line : news) say_once(LogLevel::kInfo, line);
}

std::string Mounts::text(const Wanted& wanted) const {
  const FramePose& pose = *wanted.imu_in_it;
  const std::string is_in = "frame '" + imu_frame_ + "' is in '" + wanted.frame + "'";
  const std::string rpy = list_text(rpy_of_rotation(pose.R_AtoB));
  switch (wanted.of) {
    case Of::kBody:
      return is_in + " at p_IinB_m: " + list_text(pose.p_AinB) + ", rpy_ItoB_rad: " + rpy;
    case Of::kWheels:
      return is_in + ", wheels: {p_IinO_m: " + list_text(pose.p_AinB) + ", rpy_ItoO_rad: " + rpy +
             "}";
    case Of::kCamera:
      break;
  }
  return is_in + ", cam" + std::to_string(wanted.camera) + ": {T_cam_imu: " + matrix_text(pose) +
         "}";
}

std::string Mounts::nothing_says(const Wanted& wanted) const {
  return "nothing says where frame '" + imu_frame_ + "' is in '" + wanted.frame + "'";
}

void Mounts::say_missing() const {
  std::vector<std::string> lines;
  {
    const std::scoped_lock lock(mutex_);
    const auto names = tree_.names();
    for (const Wanted& wanted : wanted_) {
      if (wanted.imu_in_it) continue;
      std::string text = nothing_says(wanted);
      if (wanted.of == Of::kBody) text += ": no pose is published";
      bool are_there = true;
      for (const std::string& name : {plain_name(imu_frame_), plain_name(wanted.frame)}) {
        if (names.empty() || std::find(names.begin(), names.end(), name) != names.end()) continue;
        are_there = false;
        text += "; there is no '" + name + "'" + log::did_you_mean(name, names);
      }
      if (names.empty()) {
        text += " (no frame is known from /tf_static or the robot's description)";
      } else if (are_there) {
        text += ": both are there, but no fixed frames join them";
      }
      lines.push_back(text);
    }
  }
  for (const std::string& line : lines) services_.log(LogLevel::kWarning, line);
}

std::string Mounts::contradiction(const Wanted& wanted, const EstimateSample& estimate) const {
  const bool is_camera = wanted.of == Of::kCamera;
  const std::string owner = is_camera ? "cam" + std::to_string(wanted.camera) + "." : "";
  const auto theta = three_of(estimate, owner + (is_camera ? "theta_ItoC" : "theta_ItoO"));
  const auto p = three_of(estimate, owner + (is_camera ? "p_IinC" : "p_IinO"));
  if (!theta || !p) return {};
  if (theta->sigma == 0. && p->sigma == 0.) return {};  // held: it is not estimated
  const FramePose& said = *wanted.imu_in_it;
  const double apart_m = (p->value - said.p_AinB).norm();
  const double apart_rad = log_so3(exp_so3(theta->value) * said.R_AtoB.transpose()).norm();
  const bool agree =
      apart_m <= kErrM + kSigmas * p->sigma && apart_rad <= kErrRad + kSigmas * theta->sigma;
  if (agree) return {};
  return "the estimate of the IMU in frame '" + wanted.frame + "' is " + rounded(apart_m) +
         " m and " + rounded(apart_rad) + " rad from what the robot says";
}

std::string Mounts::trouble(const EstimateSample& estimate) {
  std::string all;
  std::vector<std::string> news;
  {
    const std::scoped_lock lock(mutex_);
    for (Wanted& wanted : wanted_) {
      std::string text;
      if (!wanted.imu_in_it) {
        if (wanted.of == Of::kBody) text = nothing_says(wanted);
      } else if (wanted.of != Of::kBody) {
        text = contradiction(wanted, estimate);
        if (!text.empty() && !wanted.contradicts) news.push_back(text);
        wanted.contradicts |= !text.empty();
      }
      if (!text.empty()) all += (all.empty() ? "" : "; ") + text;
    }
  }
  for (const std::string& line : news) say_once(LogLevel::kWarning, line);
  return all;
}

void Mounts::say_once(LogLevel level, const std::string& text) {
  constexpr std::size_t kMost = 20;
  {
    const std::scoped_lock lock(mutex_);
    if (said_.size() >= kMost || !said_.insert(text).second) return;
  }
  services_.log(level, text);
}

}  // namespace viwo::live
