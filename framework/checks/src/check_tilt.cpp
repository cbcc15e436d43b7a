#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "viwo/checks/checks.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::inspect {

using series::Recording;

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// What may have been done to the gyro: its reading is M^-1 times what it should be.
struct GyroHypothesis {
  Matrix3d M;
  std::string text;
  double squares = 0.;  ///< of how much the direction of gravity wanders in what it integrates to
};

std::string axes_text(const Matrix3d& M) {
  std::string text;
  for (int row = 0; row < 3; ++row) {
    int column = 0;
    M.row(row).cwiseAbs().maxCoeff(&column);
    text += std::string(row > 0 ? ", " : "") + (M(row, column) < 0. ? "-" : "") + "xyz"[column];
  }
  return "(" + text + ")";
}

/// As it is, no rotation at all, degrees, and all exchanges of axes and signs.
std::vector<GyroHypothesis> gyro_hypotheses() {
  std::vector<GyroHypothesis> all = {
      {Matrix3d::Identity(), ""},
      {Matrix3d::Zero(), ""},
      {Matrix3d::Identity() * std::numbers::pi / 180., "it is in deg/s"}};
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d M = Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) {
        M(row, order[static_cast<std::size_t>(row)]) = (signs >> row & 1) != 0 ? -1. : 1.;
      }
      if (M.isIdentity()) continue;
      all.push_back({M, "its axes (x, y, z) are " + axes_text(M) + " of it"});
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

/// Directions of the mean specific force over windows of half a second, in the frame that the
/// integrated gyro says to stand still; a gap begins anew.
double wandering(const std::vector<ImuSample>& imu, const Matrix3d& M, double& windows) {
  constexpr double kWindow_s = 0.5, kGap_s = 0.1;
  Matrix3d R = Matrix3d::Identity();
  std::array<Vector3d, 2> before;
  std::size_t n_before = 0, first = 0;
  Vector3d sum = Vector3d::Zero();
  double squares = 0.;
  windows = 0.;
  constexpr std::size_t kMost = 200'000;
  for (std::size_t i = 1; i < std::min(imu.size(), kMost); ++i) {
    const double dt_s = seconds_between(imu[i - 1].t_ns, imu[i].t_ns);
    if (dt_s > kGap_s) {
      n_before = 0;
      first = i;
      sum.setZero();
      continue;
    }
    const Vector3d rate =
        0.5 * (to_vector(imu[i - 1].gyro_rad_per_s) + to_vector(imu[i].gyro_rad_per_s));
    R *= exp_so3(dt_s * (M * rate));
    sum += R * to_vector(imu[i].accel_m_per_s2);
    if (seconds_between(imu[first].t_ns, imu[i].t_ns) < kWindow_s) continue;
    const Vector3d now = sum.normalized();
    // A second apart: what the robot accelerates has mostly passed.
    if (n_before >= 2) {
      squares += (now - before[n_before % 2]).squaredNorm();
      windows += 1.;
    }
    before[n_before++ % 2] = now;
    first = i;
    sum.setZero();
  }
  return windows > 0. ? squares / windows : 0.;
}

}  // namespace

void check_tilt(const Recording& recording, Findings& out) {
  if (recording.imu.empty()) return;
  const std::string label = recording.label<ImuSample>(recording.imu_sensor);
  std::vector<GyroHypothesis> all = gyro_hypotheses();
  double windows = 0.;
  constexpr double kLeastTilt = 0.1, kFewestWindows = 20.;  // rad, root of the mean square
  all[1].squares = wandering(recording.imu, all[1].M, windows);
  if (windows < kFewestWindows || all[1].squares < kLeastTilt * kLeastTilt) return;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i != 1) all[i].squares = wandering(recording.imu, all[i].M, windows);
  }
  const auto best = std::min_element(
      all.begin(), all.end(),
      [](const GyroHypothesis& a, const GyroHypothesis& b) { return a.squares < b.squares; });
  double second = INFINITY;
  for (const GyroHypothesis& other : all) {
    if (&other != &*best) second = std::min(second, other.squares);
  }
  const double none = std::sqrt(all[1].squares), as_is = std::sqrt(all[0].squares);
  const double least = std::sqrt(best->squares);
  Finding finding{label,
                  Severity::kFits,
                  "tilt",
                  "gyro and accelerometer tilt alike",
                  {{"tilt per second", none, "rad"},
                   {"left with the gyro as it is", as_is, "rad"},
                   {"left with the best", least, "rad"},
                   {"left with the next", std::sqrt(second), "rad"}}};
  // The gyro explains half of what tilts; what any other reading of it leaves is 1.5 times as much.
  constexpr double kClearly = 2.;
  if (best == all.begin()) {
    if (none > kClearly * as_is) out.push_back(finding);
    return;
  }
  if (none < kClearly * least || as_is < kClearly * least || second < 1.5 * 1.5 * best->squares) {
    return;
  }
  finding.severity = Severity::kFault;
  finding.what = "the gyro contradicts the tilt of the accelerometer by " + significant(as_is, 2) +
                 " rad in a second, and by " + significant(least, 2) + " rad if " + best->text;
  out.push_back(finding);
}

}  // namespace viwo::inspect
