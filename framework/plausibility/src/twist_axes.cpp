// How the IMU is turned in the base, by forces and what the wheels say of them.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "twist_check.hpp"
#include "viwo/math/significant.hpp"

namespace viwo {
namespace {

/// Which axis of the base each of the accelerometer's is, and its sign.
struct Mounting {
  Eigen::Matrix2d P;
  const char* text;
};

/// About z of the base.
Eigen::Matrix3d embedded(const Eigen::Matrix2d& P) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  R.topLeftCorner<2, 2>() = P.transpose();
  return R;
}

Eigen::Matrix2d matrix(double a, double b, double c, double d) {
  return (Eigen::Matrix2d() << a, b, c, d).finished();
}

/// The first is as configured; from `kFirstOfOneAxis` on it is one axis alone.
constexpr std::size_t kMountings = 8, kFirstOfOneAxis = 6;

const std::array<Mounting, kMountings>& mountings() {
  static const std::array<Mounting, kMountings> all = {{
      {matrix(1, 0, 0, 1), ""},
      {matrix(-1, 0, 0, -1),
       "the IMU is turned: add 3.1416 to the yaw of wheels.rpy_ItoO_rad, or the base's x points "
       "backwards"},
      {matrix(0, 1, -1, 0), "the IMU is turned: add 1.5708 to the yaw of wheels.rpy_ItoO_rad"},
      {matrix(0, -1, 1, 0), "the IMU is turned: add -1.5708 to the yaw of wheels.rpy_ItoO_rad"},
      {matrix(0, 1, 1, 0), "axes exchanged; determinant -1: not a rotation"},
      {matrix(0, -1, -1, 0), "axes exchanged and reversed; determinant -1: not a rotation"},
      {matrix(-1, 0, 0, 1), "sign of the accelerometer's x"},
      {matrix(1, 0, 0, -1), "sign of the accelerometer's y, or of the base's"},
  }};
  return all;
}

/// Correlation of a force with what the wheels say of another.
double correlation(const Eigen::Matrix4d& M, int axis, int followed) {
  return M(axis, 2 + followed) / std::sqrt(M(axis, axis) * M(2 + followed, 2 + followed));
}

/// Each axis by itself: one that is reversed may be the one along which it hardly accelerates. On
/// hills that slow it down the force is opposite, too, but as many times as large as part of the
/// slope is lost.
bool follow_by_themselves(const Eigen::Matrix4d& M, const Eigen::Matrix2d& P) {
  constexpr double kFollows = 0.5, kMostTimes = 1.5;
  for (const int axis : {0, 1}) {
    const double times = M(axis, 2 + axis) / M(2 + axis, 2 + axis) * P(axis, axis);
    if (std::abs(correlation(M, axis, axis)) < kFollows || times > kMostTimes ||
        times < 1. / kMostTimes) {
      return false;
    }
  }
  return true;
}

}  // namespace

/// Covariance of [force, what the wheels say of it].
Eigen::Matrix4d TwistCheck::of_forces(const Eigen::MatrixXd& C) {
  Eigen::Matrix<double, 4, kEntries> S = Eigen::Matrix<double, 4, kEntries>::Zero();
  for (int i = 0; i < 2; ++i) {
    S(i, kForce + i) = 1.;
    S(2 + i, kChange + i) = S(2 + i, kTurn + i) = 1.;
  }
  return S * C * S.transpose();
}

/// Where it hardly turns, wheels still accelerate with the IMU, or opposite to it, or across.
void TwistCheck::find_turned(const Eigen::MatrixXd& C, Findings& out) const {
  if (gyro_is_ != Gyro::kMounted) return;
  const Eigen::Matrix4d M = of_forces(C);
  const double force = M(0, 0) + M(1, 1), wheels = M(2, 2) + M(3, 3);
  // Slopes are in the force, too, but have no direction: of 40 windows and more it is beyond
  // chance.
  constexpr double kLeast = kLeastForce * kLeastForce, kClear = 0.7;
  if (std::min(force, wheels) < kLeast) return;
  const double size = std::sqrt(force * wheels);
  const double along = (M(0, 2) + M(1, 3)) / size, across = (M(1, 2) - M(0, 3)) / size;
  if (along < -kClear) {
    out.push_back({imu_ + " axes", wheels_ + ": accelerate opposite to " + imu_ + " (correlation " +
                                       significant(along, 2) +
                                       "): sign of all drives, or the IMU is turned: add 3.1416 to "
                                       "the yaw of wheels.rpy_ItoO_rad"});
  } else if (std::abs(across) > kClear) {
    const bool is_left = across > 0.;
    out.push_back({imu_ + " axes",
                   imu_ + ": accelerates to the " + (is_left ? "left" : "right") + " where " +
                       wheels_ + " accelerate forwards (correlation " +
                       significant(std::abs(across), 2) + "): the IMU is turned: add " +
                       (is_left ? "-" : "") + "1.5708 to the yaw of wheels.rpy_ItoO_rad",
                   false,
                   {turned_by(embedded(is_left ? matrix(0, -1, 1, 0) : matrix(0, 1, -1, 0)))}});
  }
}

/// The rates agree: so should the accelerometer and what the wheels' velocity takes.
void TwistCheck::find_axes(const Eigen::MatrixXd& C, Findings& out) const {
  if (gyro_is_ != Gyro::kMounted) return;
  const Eigen::Matrix4d M = of_forces(C);
  if (!M.allFinite()) return;
  const double all = M(0, 0) + M(1, 1);
  std::array<double, kMountings> left{};
  for (std::size_t i = 0; i < left.size(); ++i) {
    Eigen::Matrix<double, 2, 4> h;
    h << Eigen::Matrix2d::Identity(), -mountings()[i].P;
    left[i] = (h * M * h.transpose()).trace();
  }
  std::array<double, kMountings> sorted = left;
  std::ranges::sort(sorted);
  const double second = sorted[1];
  const auto best = static_cast<std::size_t>(std::ranges::find(left, sorted[0]) - left.begin());
  const double least = kLeastForce * kLeastForce;
  if (best == 0 || M(2, 2) < least || M(3, 3) < least || left[best] > 0.7 * all) return;
  const auto followed = [&](int axis) { return mountings()[best].P(axis, 0) != 0. ? 0 : 1; };
  if (best < kFirstOfOneAxis) {
    if (left[0] < all || second - left[best] < 0.1 * all) return;
  } else {
    if (!follow_by_themselves(M, mountings()[best].P)) return;
    if (second - left[best] < std::min(M(0, 0), M(1, 1))) return;
  }
  const auto follows = [&](int axis) {
    return std::string(1, "xy"[axis]) +
           (axis == 0 ? " of the accelerometer follows " : " follows ") + "xy"[followed(axis)] +
           " of the wheels (correlation " + significant(correlation(M, axis, followed(axis)), 2) +
           ")";
  };
  out.push_back({imu_ + " axes",
                 imu_ + ": in the base's frame " + follows(0) + ", " + follows(1) + ": " +
                     mountings()[best].text,
                 false,
                 best >= 1 && best <= 3 ? std::vector{turned_by(embedded(mountings()[best].P))}
                                        : std::vector<Remedy>{}});
}

}  // namespace viwo
