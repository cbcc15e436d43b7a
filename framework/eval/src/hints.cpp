#include "viwo/eval/hints.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "viwo/api/status.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::eval {
namespace {

/// Of the positions about their middle: the mean of the outer products.
Eigen::Matrix3d scatter_of(const Trajectory& poses) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const auto n = static_cast<double>(poses.size());
  for (const StampedPose& pose : poses) middle += pose.p_BinW / n;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const StampedPose& pose : poses) {
    const Eigen::Vector3d off = pose.p_BinW - middle;
    scatter += off * off.transpose() / n;
  }
  return scatter;
}

/// What was read as x y z w has been w x y z.
Trajectory reordered(Trajectory trajectory) {
  for (StampedPose& pose : trajectory) {
    const Eigen::Vector4d wxyz = pose.q_BtoW.coeffs();
    pose.q_BtoW = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  }
  return trajectory;
}

std::string order_hint(const Trajectory& reference, const Trajectory& estimate,
                       const Options& options, double ate_deg) {
  constexpr double kMuch_deg = 20., kPart = 0.25;
  if (!(ate_deg > kMuch_deg)) return "";
  const double by_estimate = evaluate(reference, reordered(estimate), options).ate_deg;
  const double by_reference = evaluate(reordered(reference), estimate, options).ate_deg;
  const bool is_estimate = by_estimate <= by_reference;
  const double best = is_estimate ? by_estimate : by_reference;
  if (!(best < kPart * ate_deg)) return "";
  return "orientations differ by " + significant(ate_deg, 3) + " deg, by " + significant(best, 3) +
         " deg where the quaternions of the " + (is_estimate ? "estimate" : "reference") +
         " are w x y z: TUM files have x y z w";
}

/// Of worlds of which one is not level, as a motion capture whose y is up: once one is tilted,
/// positions and orientations agree.
std::string tilt_hint(const Trajectory& reference, const Trajectory& estimate,
                      const Options& options, const Accuracy& level) {
  constexpr double kPart = 0.2, kMuch_deg = 20.;
  if (options.alignment != Alignment::kYawPosition || !(level.ate_deg > kMuch_deg)) return "";
  Options free = options;
  free.alignment = Alignment::kSe3;
  try {
    const Accuracy tilted = evaluate(reference, estimate, free);
    if (!(tilted.ate_m < kPart * level.ate_m && tilted.ate_deg < kPart * level.ate_deg)) return "";
    return "positions differ by " + significant(level.ate_m, 3) + " m, and by " +
           significant(tilted.ate_m, 3) +
           " m once the two worlds may be tilted: the z of one of them is not up";
  } catch (const InputError&) {  // what is on one line tells no tilt
    return "";
  }
}

}  // namespace

double extent_m(const Trajectory& poses) { return std::sqrt(scatter_of(poses).trace()); }

double way_m(const Trajectory& poses) {
  double way = 0.;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    way += (poses[i].p_BinW - poses[i - 1].p_BinW).norm();
  }
  return way;
}

bool bends(const Trajectory& path) {
  constexpr double kPart = 0.05;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter_of(path),
                                                              Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[1] > kPart * kPart * solver.eigenvalues()[2];
}

std::string size_contradiction(const Trajectory& of_reference, const Trajectory& of_estimate) {
  constexpr double kFar_m = 0.5, kMany = 5., kMostGap_s = 0.5;
  Trajectory reference, estimate;
  for (const StampedPose& pose : of_estimate) {
    const auto at = interpolate(of_reference, pose.t_ns, kMostGap_s);
    if (!at) continue;
    reference.push_back(*at);
    estimate.push_back(pose);
  }
  const double reference_m = extent_m(reference), estimate_m = extent_m(estimate);
  const double larger = std::max(reference_m, estimate_m);
  if (!(larger > kFar_m && larger > kMany * std::min(reference_m, estimate_m))) return "";
  return "it goes " + significant(reference_m, 3) +
         " m from its middle, root mean square, and the estimate " + significant(estimate_m, 3) +
         " m";
}

std::vector<std::string> world_hints(const Trajectory& reference, const Trajectory& estimate,
                                     const Options& options, const Accuracy& accuracy) {
  std::vector<std::string> lines;
  std::string order = order_hint(reference, estimate, options, accuracy.ate_deg);
  if (!order.empty()) lines.push_back(std::move(order));
  std::string tilt = tilt_hint(reference, estimate, options, accuracy);
  if (!tilt.empty()) lines.push_back(std::move(tilt));
  return lines;
}

std::vector<std::string> hints(const Trajectory& reference, const Trajectory& estimate,
                               const Options& options, const Accuracy& accuracy) {
  std::vector<std::string> lines = world_hints(reference, estimate, options, accuracy);
  const std::string size = size_contradiction(reference, estimate);
  if (!size.empty()) {
    lines.push_back("the reference: " + size + " - another unit of one, or another recording");
  }
  return lines;
}

}  // namespace viwo::eval
