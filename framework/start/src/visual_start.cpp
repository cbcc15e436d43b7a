#include "viwo/start/visual_start.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <Eigen/Dense>

#include "linear_start.hpp"
#include "refined_start.hpp"
#include "start_frame.hpp"
#include "visual_window.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::string_view kUncertain =
    "images and accelerometer do not tell velocity and scale well enough";
constexpr double kLeastParallaxRad = 0.01;
constexpr double kLeastInFront = 0.9;
constexpr double kMostSightPx = 3.;
constexpr double kBiasGate = 4.;  ///< sigmas
constexpr double kMostTiltRad = 0.05;
constexpr double kMostScale = 0.05;  ///< relative sigma
/// Of the IMU's residuals, which then are three times their noise.
constexpr double kMostImuRatio = 9.;

double largest_sigma(const ImuMatrix& P, int column) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(P.block<3, 3>(column, column));
  return std::sqrt(std::max(eigen.eigenvalues()[2], 0.));
}

/// What is wrong with what was found, or nothing.
std::string_view objection(const RefinedStart& found, std::size_t n_tracks,
                           const VisualStartOptions& options) {
  if (found.sigma_px > kMostSightPx || found.imu_ratio > kMostImuRatio ||
      10 * found.n_tracks < 6 * n_tracks) {
    return "images and IMU contradict each other";
  }
  const auto is_beyond = [&](const Vector3d& bias, int column, double sigma) {
    const auto own = found.P.diagonal().segment<3>(column).cwiseSqrt();
    return ((bias.cwiseAbs() - kBiasGate * own).array() > kBiasGate * sigma).any();
  };
  if (is_beyond(found.state.gyro_bias, kGyroBiasColumn, options.sigma_gyro_bias_rad_per_s) ||
      is_beyond(found.state.accel_bias, kAccelBiasColumn, options.sigma_accel_bias_m_per_s2)) {
    return "images and IMU agree only with a bias beyond four sigma";
  }
  const double speed = found.state.v_IinG.norm();
  if (!(found.sigma_scale < kMostScale) ||
      !(largest_sigma(found.P, kVelocityColumn) < 0.05 + 0.1 * speed)) {
    return kUncertain;
  }
  if (!(largest_sigma(found.P, kThetaColumn) < kMostTiltRad)) {
    return "images and IMU do not tell well enough where down is";
  }
  return {};
}

/// The start in its own G: where the IMU is, with yaw zero (F-38).
ImuPrior prior_of(const RefinedStart& found, std::int64_t t_ns, const VisualStartOptions& options) {
  ImuPrior prior;
  prior.t_ns = t_ns;
  const Vector3d z = found.state.R_GtoI.col(2);
  prior.state.R_GtoI = R_GtoI_from_up(z);
  const Matrix3d turn = prior.state.R_GtoI.transpose() * found.state.R_GtoI;
  prior.state.v_IinG = turn * found.state.v_IinG;
  prior.state.gyro_bias = found.state.gyro_bias;
  prior.state.accel_bias = found.state.accel_bias;
  ImuMatrix T = ImuMatrix::Identity();
  T.block<3, 3>(kPositionColumn, kPositionColumn) = turn;
  T.block<3, 3>(kVelocityColumn, kVelocityColumn) = turn;
  // The yaw is that of G: the velocity in G turns with it.
  Eigen::Matrix<double, kImuSize, 1> by_yaw = Eigen::Matrix<double, kImuSize, 1>::Zero();
  by_yaw.segment<3>(kThetaColumn) = z;
  by_yaw.segment<3>(kVelocityColumn) = Vector3d::UnitZ().cross(prior.state.v_IinG);
  // An IMU that is noisier than it is said to be has vibration that its data sheet does not know.
  prior.P = std::max(1., found.imu_ratio) * (T * found.P * T.transpose()) +
            squared(options.sigma_yaw_rad) * by_yaw * by_yaw.transpose();
  prior.P.diagonal().segment<3>(kPositionColumn).array() += squared(options.sigma_position_m);
  return prior;
}

StartAttempt attempt(std::span<const ImuSample> imu, std::span<const FeatureSample> tracks,
                     double window_s, const VisualStartOptions& options) {
  VisualWindow window;
  const std::string_view obstacle = find_visual_window(imu, tracks, window_s, options, window);
  if (!obstacle.empty()) return no_start(obstacle);
  const Vector3d gyro_bias = epipolar_gyro_bias(window, options);
  if (parallax_rad(window, gyro_bias, options) < kLeastParallaxRad) {
    return no_start("the images show too little parallax");
  }
  const auto linear = solve_linear_start(window, gyro_bias, options);
  if (!linear || linear->in_front < kLeastInFront) {
    return no_start("no motion explains images and IMU");
  }
  const std::size_t n_tracks = window.tracks.size();
  const auto found = refine_start(window, *linear, gyro_bias, options);
  if (!found) return no_start("no motion explains images and IMU");
  const std::string_view why_not = objection(*found, n_tracks, options);
  if (!why_not.empty()) return no_start(why_not);
  return {prior_of(*found, window.keys.back().t_ns, options), {}};
}

}  // namespace

StartAttempt start_from_images(std::span<const ImuSample> imu,
                               std::span<const FeatureSample> tracks,
                               const VisualStartOptions& options) {
  StartAttempt first = attempt(imu, tracks, options.window_s, options);
  if (first.prior) return first;
  StartAttempt longer = attempt(imu, tracks, 2. * options.window_s, options);
  return longer.prior ? longer : first;
}

}  // namespace viwo
