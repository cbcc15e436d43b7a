#include "viwo/estimator/motion_window.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace viwo {
namespace {

// What a motion may differ from the ideal. They are wide: whether something can be learned is for
// the information to say, the motion only finds the words.
constexpr double kStillMPerS = 0.01;
constexpr double kStillRadPerS = 0.01;
constexpr double kNoYawRadPerS = 0.05;
constexpr double kFlatRadPerS = 0.01;  // of roll and pitch
/// Scatter of the twist, or of its direction, relative to the twist.
constexpr double kSteady = 0.1;
/// Below these, velocities and rates are not scaled up to be comparable.
constexpr double kLeastMPerS = 0.05;
constexpr double kLeastRadPerS = 0.05;

}  // namespace

void MotionWindow::add(const Eigen::Vector3d& v_OinO, const Eigen::Vector3d& w_OinO,
                       double sigma_w) {
  Sums& bin = bins_[bin_];
  const Eigen::Vector3d twist(v_OinO.x(), v_OinO.y(), w_OinO.z());
  bin.n += 1.;
  bin.twist += twist;
  bin.twist_twist += twist * twist.transpose();
  bin.tilt_rate += w_OinO.head<2>();
  bin.tilt_rate2 += w_OinO.head<2>().squaredNorm();
  bin.tilt_noise2 += 2. * sigma_w * sigma_w;
}

void MotionWindow::next_bin() {
  bin_ = (bin_ + 1) % bins_.size();
  bins_[bin_] = {};
}

MotionWindow::Sums MotionWindow::sum() const {
  Sums sum;
  for (const Sums& bin : bins_) {
    sum.n += bin.n;
    sum.twist += bin.twist;
    sum.twist_twist += bin.twist_twist;
    sum.tilt_rate += bin.tilt_rate;
    sum.tilt_rate2 += bin.tilt_rate2;
    sum.tilt_noise2 += bin.tilt_noise2;
  }
  return sum;
}

double MotionWindow::tilt_signal() const {
  const Sums sum = this->sum();
  if (sum.n == 0.) return 0.;
  // Twice: once for the noise, once for how much its square scatters.
  const double noise2 = 2. * sum.tilt_noise2 / sum.n;
  const double scatter2 = sum.tilt_scatter2();
  return scatter2 > noise2 ? 1. - noise2 / scatter2 : 0.;
}

std::array<bool, kDegeneracies> MotionWindow::classify() const {
  std::array<bool, kDegeneracies> is{};
  const Sums sum = this->sum();
  if (sum.n == 0.) return is;
  const Eigen::Vector3d mean = sum.twist / sum.n;
  const Eigen::Matrix3d moment = sum.twist_twist / sum.n;
  const double speed = std::sqrt(moment(0, 0) + moment(1, 1));
  const double yaw_rate = std::sqrt(moment(2, 2));
  const auto set = [&is](Degeneracy kind, bool value) {
    is[static_cast<std::size_t>(kind)] = value;
  };
  const bool still = speed < kStillMPerS && yaw_rate < kStillRadPerS;
  set(Degeneracy::kStandstill, still);
  if (still) return is;
  const bool turns = yaw_rate >= kNoYawRadPerS;
  set(Degeneracy::kNoYawRate, !turns);
  set(Degeneracy::kFlatGround, sum.tilt_scatter2() < kFlatRadPerS * kFlatRadPerS);
  // Velocity and rate in units of their own size.
  const double by_speed = 1. / std::max(speed, kLeastMPerS);
  const Eigen::Vector3d scale(by_speed, by_speed, 1. / std::max(yaw_rate, kLeastRadPerS));
  const Eigen::Matrix3d scaled = scale.asDiagonal() * moment * scale.asDiagonal();
  const Eigen::Vector3d scaled_mean = scale.cwiseProduct(mean);
  const double size2 = scaled.trace();
  const double scatter2 = size2 - scaled_mean.squaredNorm();
  set(Degeneracy::kSteadyVelocity, scatter2 < kSteady * kSteady * size2);
  const Eigen::Vector3d along =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scaled, Eigen::EigenvaluesOnly).eigenvalues();
  set(Degeneracy::kConstantSteering, turns && along[0] + along[1] < kSteady * kSteady * along[2]);
  return is;
}

}  // namespace viwo
