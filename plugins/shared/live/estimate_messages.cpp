#include "estimate_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Geometry>

#include "viwo/math/arrays.hpp"
#include "viwo/math/number_text.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::live {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix9d = Eigen::Matrix<double, 9, 9, Eigen::RowMajor>;

void set_covariance(std::array<double, 36>& to, const Matrix6d& from) {
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index j = 0; j < 6; ++j) {
      to[static_cast<std::size_t>(6 * i + j)] = 0.5 * (from(i, j) + from(j, i));
    }
  }
}

}  // namespace

Odometry odometry_of(const EstimateSample& estimate, const OutputFrames& frames,
                     double sigma_rate_rad_per_s) {
  const Eigen::Quaterniond q_ItoG = to_quaternion(estimate.q_ItoG_xyzw);
  const Eigen::Matrix3d R_ItoG = q_ItoG.toRotationMatrix();
  const Eigen::Matrix3d R_BtoG = R_ItoG * frames.R_ItoB.transpose();
  const Eigen::Vector3d lever_G = R_BtoG * frames.p_IinB;
  const Eigen::Vector3d v_IinI = R_ItoG.transpose() * to_vector(estimate.v_IinG_m_per_s);
  const Eigen::Vector3d w_B = frames.R_ItoB * to_vector(estimate.w_IinI_rad_per_s);
  const Matrix9d P = Eigen::Map<const Matrix9d>(estimate.covariance.data());

  Odometry message;
  message.pose.t_ns = estimate.t_ns;
  message.world = frames.world;
  message.body = frames.body;
  // (LIV-4)
  Eigen::Vector3d::Map(message.pose.p_BinG_m.data()) = to_vector(estimate.p_IinG_m) - lever_G;
  const Eigen::Quaterniond q_BtoG(R_BtoG);
  message.pose.q_BtoG_xyzw = {q_BtoG.x(), q_BtoG.y(), q_BtoG.z(), q_BtoG.w()};
  // (LIV-5)
  Eigen::Vector3d::Map(message.v_BinB_m_per_s.data()) =
      frames.R_ItoB * v_IinI - w_B.cross(frames.p_IinB);
  Eigen::Vector3d::Map(message.w_BinB_rad_per_s.data()) = w_B;

  // (LIV-6), (LIV-7)
  Eigen::Matrix<double, 6, 9> J_pose = Eigen::Matrix<double, 6, 9>::Zero();
  J_pose.block<3, 3>(0, 0) = skew(lever_G) * R_ItoG;
  J_pose.block<3, 3>(0, 3).setIdentity();
  J_pose.block<3, 3>(3, 0) = R_ItoG;
  set_covariance(message.pose_covariance, J_pose * P * J_pose.transpose());

  // (LIV-8)
  Eigen::Matrix<double, 3, 9> J_v = Eigen::Matrix<double, 3, 9>::Zero();
  J_v.block<3, 3>(0, 0) = frames.R_ItoB * skew(v_IinI);
  J_v.block<3, 3>(0, 6) = frames.R_ItoB * R_ItoG.transpose();
  const double rate_variance = sigma_rate_rad_per_s * sigma_rate_rad_per_s;
  const Eigen::Matrix3d J_v_w = skew(frames.p_IinB);
  Matrix6d twist;
  twist.topLeftCorner<3, 3>() =
      J_v * P * J_v.transpose() + rate_variance * J_v_w * J_v_w.transpose();
  twist.topRightCorner<3, 3>() = rate_variance * J_v_w;
  twist.bottomLeftCorner<3, 3>() = rate_variance * J_v_w.transpose();
  twist.bottomRightCorner<3, 3>() = rate_variance * Eigen::Matrix3d::Identity();
  set_covariance(message.twist_covariance, twist);
  return message;
}

Diagnostics diagnostics_of(const EstimateSample& estimate, const Health& health) {
  Diagnostics message;
  std::string trouble;
  const auto warn = [&trouble](const std::string& text) {
    trouble += (trouble.empty() ? "" : "; ") + text;
  };
  if (estimate.latency_s > health.warn_latency_s) {
    warn("latency " + number_text(std::round(estimate.latency_s * 1e3) * 1e-3) + " s");
  }
  if (!health.trouble.empty()) warn(health.trouble);
  for (const std::string& topic : health.silent_topics) warn("nothing on topic '" + topic + "'");
  const auto is_finite = [](double value) { return std::isfinite(value); };
  if (!std::all_of(estimate.covariance.begin(), estimate.covariance.end(), is_finite) ||
      !std::all_of(estimate.p_IinG_m.begin(), estimate.p_IinG_m.end(), is_finite)) {
    warn("the estimate is not finite");
    message.fails = true;
  }
  for (const std::string& text : estimate.warnings) warn(text);
  message.t_ns = estimate.t_ns;
  message.warns = !trouble.empty();
  message.message = trouble.empty() ? "ok" : trouble;
  const auto add = [&message](const std::string& key, double value) {
    message.values.emplace_back(key, number_text(value));
  };
  if (std::isfinite(estimate.latency_s)) add("latency_s", estimate.latency_s);
  add("started anew", estimate.piece);
  if (health.rejected >= 0) add("rejections", static_cast<double>(health.rejected));
  const auto sigma = [&estimate](std::size_t first) {
    double variance = 0.;
    for (std::size_t i = first; i < first + 3; ++i) variance += estimate.covariance[10 * i];
    return std::sqrt(variance);
  };
  add("sigma orientation [rad]", sigma(0));
  add("sigma position [m]", sigma(3));
  add("sigma velocity [m/s]", sigma(6));
  for (std::size_t i = 0; i < estimate.calibration_names.size(); ++i) {
    add(estimate.calibration_names[i], estimate.calibration.at(i));
    add("sigma " + estimate.calibration_names[i], estimate.calibration_sigma.at(i));
  }
  return message;
}

Diagnostics diagnostics_without_estimate(std::int64_t t_ns, std::optional<std::int64_t> lost_s,
                                         const Health& health,
                                         const std::vector<RejectionCount>& rejected) {
  constexpr std::size_t kMostCauses = 3;
  Diagnostics message;
  message.t_ns = t_ns;
  message.warns = true;
  message.fails = lost_s.has_value();
  message.message = "no estimate " + (lost_s ? "for " + std::to_string(*lost_s) + " s" : "yet");
  if (!health.trouble.empty()) message.message += "; " + health.trouble;
  for (const std::string& topic : health.silent_topics) {
    message.message += "; nothing on topic '" + topic + "'";
  }
  for (std::size_t i = 0; i < std::min(rejected.size(), kMostCauses); ++i) {
    message.message += "; " + std::to_string(rejected[i].count) + " x " + rejected[i].reason;
  }
  message.values.emplace_back("rejections", std::to_string(health.rejected));
  return message;
}

bool Path::add(const Pose& pose, int piece) {
  if (piece != piece_) poses_.clear();
  piece_ = piece;
  if (!poses_.empty() && seconds_between(poses_.back().t_ns, pose.t_ns) < kPeriodS) return false;
  if (poses_.size() == kMost) poses_.erase(poses_.begin());
  poses_.push_back(pose);
  return true;
}

}  // namespace viwo::live
