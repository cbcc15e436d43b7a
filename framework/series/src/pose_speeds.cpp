#include "viwo/series/pose_speeds.hpp"

#include <algorithm>
#include <cmath>

#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/series/rate_grid.hpp"
#include "viwo/wheel/drive_ranges.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo::series {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Nearly straight: the chord is the path, wherever the body is on the base.
constexpr double kStraight_rad = 0.1;

/// Of a body that is upright, whose axes are those of O as far as that is known.
Eigen::Matrix3d axes_of(const Wheels& wheels, const Poses& poses) {
  return poses.of_imu ? wheels.prior.wheels.R_ItoO : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

/// What wheels and poses say of some time.
struct SpeedWindow {
  double path_m = 0.;                   ///< of the wheels
  Vector2d along_m = Vector2d::Zero();  ///< sum of their velocities, in O
  double yaw_rad = 0.;                  ///< by which they turn the base
  double angle_rad = 0.;                ///< by which the poses turn
  double turned_rad = 0.;               ///< likewise, about the z axis
  Vector3d moved_m = Vector3d::Zero();  ///< of the poses, in B with the axes of O
  bool is_upright = false;
};

/// Whether wheels and poses turn together on the whole. Windows in which they do not are then those
/// of a pose that is wrong: matches of scans that failed are all the straight way that there is of
/// a robot that turns on the spot.
bool turn_together(const std::vector<SpeedWindow>& windows) {
  constexpr double kMost_rad = 2., kLeastCorrelation = 0.9;
  constexpr int kFewest = 20;
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Vector2d sum = Vector2d::Zero();
  int n = 0;
  for (const SpeedWindow& window : windows) {
    const Vector2d turned(window.yaw_rad, window.turned_rad);
    if (turned.cwiseAbs().maxCoeff() > kMost_rad) continue;
    squares += turned * turned.transpose();
    sum += turned;
    ++n;
  }
  if (n < kFewest) return false;
  const Eigen::Matrix2d C = squares - sum * sum.transpose() / n;
  return C(0, 1) > kLeastCorrelation * std::sqrt(C(0, 0) * C(1, 1));
}

/// Windows in which wheels turn and poses are known.
std::vector<SpeedWindow> windows_of(const Wheels& wheels, const Poses& of, const WindowSize& size) {
  const Trajectory& poses = of.poses;
  const Eigen::Matrix3d R_BtoO = axes_of(wheels, of);
  std::vector<SpeedWindow> windows;
  TwistSolver solver(wheels.model, {});
  solver.set_intrinsics(wheels.prior.wheels.x_WI);
  TwistSolution solution;
  // As long as it takes to get somewhere: where few windows of a slow robot were long enough,
  // errors of its poses would be taken for way.
  constexpr double kLongest_s = 30.;
  const auto clock_ns = to_ns(wheels.prior.wheels.t_OtoI_s);
  const double gap_s = std::max(0.5, 2.5 * period_of(series::turns_of(poses)));
  SpeedWindow window;
  double time_s = 0., turned_rad = 0.;
  std::int64_t begin_ns = 0;
  for (const EncoderSample& sample : wheels.samples) {
    if (time_s == 0.) begin_ns = sample.begin_ns;
    const double dt_s = seconds_between(sample.begin_ns, sample.end_ns);
    if (solver.solve(sample, solution) != Status::kOk || solution.rank_deficient) continue;
    window.path_m += solution.xi.head<2>().norm() * dt_s;
    window.along_m += solution.xi.head<2>() * dt_s;
    window.yaw_rad += solution.xi[2] * dt_s;
    time_s += dt_s;
    turned_rad += fastest_of(sample) * dt_s;
    const double window_s = seconds_between(begin_ns, sample.end_ns);
    if (window_s < size.length_s) continue;
    const auto from = interpolate(poses, begin_ns + clock_ns, gap_s);
    const auto to = interpolate(poses, sample.end_ns + clock_ns, gap_s);
    const bool goes = from && to && (to->p_BinW - from->p_BinW).norm() > size.way_m;
    if (from && to && !goes && window_s < kLongest_s) continue;
    const bool is_whole = time_s > 0.9 * window_s;
    // Poses of a base that stands still can be corrected meanwhile.
    constexpr double kTurns_rad = 0.1, kUpright = 0.94;  // 20 deg
    if (goes && is_whole && turned_rad > kTurns_rad) {
      const Eigen::Quaterniond q_WtoB = from->q_BtoW.conjugate();
      const Vector3d turn = R_BtoO * log_so3((q_WtoB * to->q_BtoW).toRotationMatrix());
      window.angle_rad = turn.norm();
      window.turned_rad = turn.z();
      window.moved_m = R_BtoO * (q_WtoB * (to->p_BinW - from->p_BinW));
      window.is_upright = Vector3d(R_BtoO * (q_WtoB * Vector3d::UnitZ())).z() > kUpright;
      windows.push_back(window);
    }
    window = {};
    time_s = turned_rad = 0.;
  }
  return windows;
}

}  // namespace

Vector2d Speeds::mean_direction() const {
  Vector2d sum = Vector2d::Zero();
  double way_m = 0.;
  for (const Vector2d& one : direction) {
    sum += one;
    way_m += one.norm();
  }
  return sum / way_m;
}

Speeds speeds_of(const Wheels& wheels, const Poses& poses, const WindowSize& size) {
  const std::vector<SpeedWindow> windows = windows_of(wheels, poses, size);
  const bool both_turn = turn_together(windows);
  Speeds speeds;
  for (const SpeedWindow& window : windows) {
    if (window.angle_rad >= kStraight_rad) continue;
    if (both_turn && std::abs(window.yaw_rad) >= 2. * kStraight_rad) continue;
    const double moved_m = window.moved_m.norm();
    speeds.ratio.push_back(window.path_m / moved_m);
    speeds.path_m += moved_m;
    const Vector2d in_B = window.moved_m.head<2>();
    if (!window.is_upright || !(window.along_m.norm() > 0.) || !(in_B.norm() > 0.)) continue;
    const Vector2d a = in_B.normalized(), b = window.along_m.normalized();
    speeds.direction.push_back(moved_m * Vector2d(a.dot(b), a.x() * b.y() - a.y() * b.x()));
  }
  return speeds;
}

}  // namespace viwo::series
