#include "viwo/start/moving_start.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>

#include <Eigen/Dense>

#include "start_frame.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::int64_t kHalfNs = 50'000'000;  ///< velocities are means over twice of this
constexpr std::int64_t kMaxGapNs = 50'000'000;
constexpr double kMaxBridgedS = 0.02;
constexpr double kGate = 4.;  ///< sigmas
constexpr std::string_view kUnusableWheels =
    "encoder samples are missing in the window, or contradict each other";

/// What can be wrong with the inputs, as offsets on top of them (F-16).
enum Offset : Eigen::Index {
  kGyro = 0,
  kAccel = 3,
  kRate = 6,           // of O, mean over the window
  kFirstVelocity = 9,  // of O in O, at the start of the window ...
  kLastVelocity = 12,  // ... and at its end
  kMountTheta = 15,
  kMountPosition = 18,
  kClock = 21,
  kIntrinsics = 22,
};

/// What is found, at the end of the window, in I.
enum Output : Eigen::Index { kUp = 0, kVelocity = 3, kBias = 6, kGravity = 9, kOutputs = 10 };
using Outputs = Eigen::Matrix<double, kOutputs, 1>;

class Window {
 public:
  Window(std::span<const ImuSample> imu, std::span<const EncoderSample> encoders,
         const MovingStartOptions& options)
      : imu_(imu),
        encoders_(encoders),
        options_(options),
        preintegrator_(options.model, wheels()) {}

  /// The last window that the measurements fill without holes. What is in its way, or nothing.
  std::string_view find() {
    constexpr std::string_view kTooShort = "fewer measurements than start_window_s asks for";
    if (imu_.size() < 20) return kTooShort;
    if (encoders_.empty()) return "no encoder samples";
    const std::int64_t offset_ns = to_ns(options_.wheels.wheels.t_OtoI_s);
    constexpr std::int64_t kMarginNs = kHalfNs + 2'000'000;  // the clock is varied by a ms
    const std::int64_t latest_ns =
        std::min(imu_.back().t_ns, encoders_.back().end_ns + offset_ns) - kMarginNs;
    const auto stamp = [](const ImuSample& sample, std::int64_t t_ns) {
      return sample.t_ns <= t_ns;
    };
    const auto at_or_before = [&](std::int64_t t_ns) {
      return std::lower_bound(imu_.begin(), imu_.end(), t_ns, stamp) - imu_.begin() - 1;
    };
    const std::ptrdiff_t last = at_or_before(latest_ns);
    if (last < 0) return kTooShort;
    last_ = static_cast<std::size_t>(last);
    const std::int64_t earliest_ns =
        std::max(imu_.front().t_ns, encoders_.front().begin_ns + offset_ns) + kMarginNs;
    const std::ptrdiff_t first = at_or_before(imu_[last_].t_ns - to_ns(options_.window_s));
    if (first < 0 || imu_[static_cast<std::size_t>(first)].t_ns < earliest_ns) {
      return kTooShort;
    }
    first_ = static_cast<std::size_t>(first);
    for (std::size_t i = first_; i < last_; ++i) {
      if (imu_[i + 1].t_ns - imu_[i].t_ns > kMaxGapNs)
        return "a hole in the IMU of more than 0.05 s";
    }
    span_s_ = seconds_between(imu_[first_].t_ns, imu_[last_].t_ns);
    return {};
  }

  /// Measures at the prior estimate, decides how the bias is weighed, and how large the offsets
  /// are. Why the measurements cannot be used, or nothing.
  std::string_view measure() {
    const VectorXd none = VectorXd::Zero(kIntrinsics + options_.wheels.wheels.x_WI.size());
    preintegrator_.set_intrinsics(options_.wheels.wheels.x_WI);
    if (!integrate(none)) return kUnusableWheels;
    const double T = span_s_;
    covariance_ = MatrixXd::Zero(none.size(), none.size());
    const auto add = [&](Eigen::Index first, double variance) {
      covariance_.diagonal().segment<3>(first).array() += variance;
    };
    const ImuNoise& noise = options_.noise;
    add(kGyro, squared(noise.gyro_rad_per_s_sqrt_hz) / T +
                   squared(noise.gyro_walk_rad_per_s2_sqrt_hz) * T / 3.);
    add(kAccel, squared(noise.accel_m_per_s2_sqrt_hz) / T +
                    squared(noise.accel_walk_m_per_s3_sqrt_hz) * T / 3.);
    add(kRate, squared(options_.sigma_tilt_rate_rad_per_s));
    covariance_(kRate + 2, kRate + 2) =
        squared(options_.sigma_yaw_rate_rad_per_s) + window_.P_g(0, 0) / squared(T);
    add(kFirstVelocity, squared(options_.sigma_velocity_m_per_s));
    add(kLastVelocity, squared(options_.sigma_velocity_m_per_s));
    const double h = 2e-9 * kHalfNs;
    covariance_.block<2, 2>(kFirstVelocity, kFirstVelocity) +=
        begin_.P_g.bottomRightCorner<2, 2>() / squared(h);
    covariance_.block<2, 2>(kLastVelocity, kLastVelocity) +=
        end_.P_g.bottomRightCorner<2, 2>() / squared(h);
    const WheelsPrior& prior = options_.wheels;
    const Eigen::Index n = prior.wheels.x_WI.size();
    const MatrixXd& P = options_.P_wheels;
    const MatrixXd P_WI = P.topLeftCorner(n, n);
    covariance_.block<6, 6>(kMountTheta, kMountTheta) = P.bottomRightCorner<6, 6>();
    covariance_.block(kMountTheta, kIntrinsics, 6, n) = P.bottomLeftCorner(6, n);
    covariance_.block(kIntrinsics, kMountTheta, n, 6) = P.topRightCorner(n, 6);
    covariance_.block(kIntrinsics, kIntrinsics, n, n) = P_WI;
    covariance_(kClock, kClock) = squared(prior.sigma_time_offset_s);

    // (F-14): how much of what the rates differ by is the bias.
    Matrix3d V = covariance_.block<3, 3>(kRate, kRate) + covariance_.block<3, 3>(kGyro, kGyro);
    const double yaw_rate = window_.g[0] / T;
    V.topLeftCorner<2, 2>() +=
        squared(yaw_rate) * P.diagonal().segment<2>(n).reverse().asDiagonal();
    const Eigen::RowVectorXd by_WI = window_.J_g_WI.row(0);
    V(2, 2) += by_WI.dot(by_WI * P_WI) / squared(T);
    const double bias_variance = squared(options_.sigma_gyro_bias_rad_per_s);
    const Matrix3d S = V + bias_variance * Matrix3d::Identity();
    share_ = bias_variance * S.inverse();
    const Vector3d difference = rate_difference(none, prior.wheels.R_ItoO);
    if ((difference.cwiseAbs().array() < kGate * S.diagonal().cwiseSqrt().array()).all()) return {};
    return "gyro and wheels turn otherwise by more than four sigma";
  }

  /// Everything at the inputs with these offsets on top. False: no such measurement.
  bool solve(const VectorXd& offset, Outputs& out) {
    if (!integrate(offset)) return false;
    const WheelsView& wheels = options_.wheels.wheels;
    const Matrix3d R_ItoO = exp_so3(-offset.segment<3>(kMountTheta)) * wheels.R_ItoO;
    const Vector3d p_IinO = wheels.p_IinO + offset.segment<3>(kMountPosition);
    const Vector3d gyro_offset = offset.segment<3>(kGyro);
    const Vector3d accel_offset = offset.segment<3>(kAccel);
    const Vector3d bias = R_ItoO.transpose() * share_ * rate_difference(offset, R_ItoO);

    // (F-13): velocity of I in I.
    const auto velocity = [&](const PreintegratedPose& moved, std::size_t at, Offset first) {
      const Vector2d v_O = log_se2(moved.g).tail<2>() / moved.duration_s;
      const Vector3d w_O = R_ItoO * (mean_rate_around(at) + gyro_offset - bias);
      const Vector3d v = Vector3d(v_O.x(), v_O.y(), 0.) + offset.segment<3>(first);
      return Vector3d(R_ItoO.transpose() * (v + w_O.cross(p_IinO)));
    };
    const Vector3d v_first = velocity(begin_, first_, kFirstVelocity);
    const Vector3d v_last = velocity(end_, last_, kLastVelocity);

    // (F-15): the specific force in I as it is at the end, back through the window.
    Matrix3d R = Matrix3d::Identity();
    Vector3d sum = Vector3d::Zero();
    for (std::size_t i = last_; i > first_; --i) {
      const double dt = seconds_between(imu_[i - 1].t_ns, imu_[i].t_ns);
      const Vector3d rate = 0.5 * (gyro(i - 1) + gyro(i)) + gyro_offset - bias;
      sum += 0.5 * dt * (R * (accel(i) + accel_offset));
      R = R * exp_so3(-dt * rate);
      sum += 0.5 * dt * (R * (accel(i - 1) + accel_offset));
    }
    const Vector3d gravity = (sum - (v_last - R * v_first)) / span_s_;
    const double norm = gravity.norm();
    out.segment<3>(kUp) = gravity / norm;
    out.segment<3>(kVelocity) = v_last;
    out.segment<3>(kBias) = bias;
    out[kGravity] = norm;
    return out.allFinite();
  }

  const MatrixXd& covariance() const { return covariance_; }
  std::int64_t t_ns() const { return imu_[last_].t_ns; }

 private:
  static PreintegrationOptions wheels() {
    PreintegrationOptions options;
    options.twist.noise_weighted = true;
    options.parity = false;
    return options;
  }
  Vector3d gyro(std::size_t i) const { return to_vector(imu_[i].gyro_rad_per_s); }
  Vector3d accel(std::size_t i) const { return to_vector(imu_[i].accel_m_per_s2); }

  bool integrate(const VectorXd& offset) {
    const WheelsView& wheels = options_.wheels.wheels;
    preintegrator_.move_intrinsics(wheels.x_WI + offset.tail(wheels.x_WI.size()));
    const std::int64_t clock_ns = to_ns(wheels.t_OtoI_s + offset[kClock]);
    const std::int64_t first_ns = imu_[first_].t_ns - clock_ns;
    const std::int64_t last_ns = imu_[last_].t_ns - clock_ns;
    const auto run = [&](std::int64_t begin_ns, std::int64_t end_ns, PreintegratedPose& out) {
      return preintegrator_.integrate(encoders_, begin_ns, end_ns, out) && out.rejected == 0 &&
             out.bridged_s <= kMaxBridgedS && out.g.allFinite() && out.P_g.allFinite();
    };
    return run(first_ns - kHalfNs, first_ns + kHalfNs, begin_) &&
           run(last_ns - kHalfNs, last_ns + kHalfNs, end_) && run(first_ns, last_ns, window_);
  }

  /// In O: gyro minus wheels, mean over the window (F-14).
  Vector3d rate_difference(const VectorXd& offset, const Matrix3d& R_ItoO) const {
    Vector3d turned = Vector3d::Zero();
    for (std::size_t i = first_; i < last_; ++i) {
      turned += 0.5 * seconds_between(imu_[i].t_ns, imu_[i + 1].t_ns) * (gyro(i) + gyro(i + 1));
    }
    const Vector3d wheels(0., 0., window_.g[0] / span_s_);
    return R_ItoO * (turned / span_s_ + offset.segment<3>(kGyro)) - wheels -
           offset.segment<3>(kRate);
  }

  /// Mean of the readings that the velocity there is a mean over.
  Vector3d mean_rate_around(std::size_t at) const {
    Vector3d sum = gyro(at);
    int n = 1;
    const auto add = [&](std::size_t i) {
      sum += gyro(i);
      ++n;
    };
    for (std::size_t i = at; i > 0 && imu_[at].t_ns - imu_[i - 1].t_ns <= kHalfNs; --i) add(i - 1);
    for (std::size_t i = at + 1; i < imu_.size() && imu_[i].t_ns - imu_[at].t_ns <= kHalfNs; ++i) {
      add(i);
    }
    return sum / n;
  }

  std::span<const ImuSample> imu_;
  std::span<const EncoderSample> encoders_;
  const MovingStartOptions& options_;
  Preintegrator preintegrator_;
  std::size_t first_ = 0, last_ = 0;  // IMU samples at the ends of the window
  double span_s_ = 0.;
  PreintegratedPose begin_, end_, window_;
  Matrix3d share_ = Matrix3d::Zero();
  MatrixXd covariance_;  // of the offsets
};

/// Derivatives of the outputs by the offsets, central differences (F-16); columns without variance
/// stay zero.
bool differentiate(Window& window, MatrixXd& D) {
  const MatrixXd& covariance = window.covariance();
  D = MatrixXd::Zero(kOutputs, covariance.cols());
  VectorXd offset = VectorXd::Zero(covariance.cols());
  for (Eigen::Index k = 0; k < covariance.cols(); ++k) {
    const double sigma = std::sqrt(covariance(k, k));
    if (!(sigma > 0.)) continue;
    const double step = k < kMountTheta ? 1e-4 : (k == kClock ? 1e-3 : 0.1 * sigma);
    Outputs plus, minus;
    offset[k] = step;
    if (!window.solve(offset, plus)) return false;
    offset[k] = -step;
    if (!window.solve(offset, minus)) return false;
    offset[k] = 0.;
    D.col(k) = (plus - minus) / (2. * step);
  }
  return true;
}

/// Covariance of the errors of the outputs, then of the accelerometer bias (F-16).
Eigen::Matrix<double, kOutputs + 3, kOutputs + 3> covariance_of(const Window& window,
                                                                const MatrixXd& D,
                                                                const MovingStartOptions& options) {
  Eigen::Matrix<double, kOutputs + 3, kOutputs + 3> P;
  P.setZero();
  P.topLeftCorner<kOutputs, kOutputs>() = D * window.covariance() * D.transpose();
  // A bias is an offset of its readings, and a part of the truth.
  Eigen::Matrix<double, kOutputs + 3, 3> by_bias;
  by_bias << -D.middleCols<3>(kGyro), Matrix3d::Zero();
  by_bias.middleRows<3>(kBias) += Matrix3d::Identity();
  P += squared(options.sigma_gyro_bias_rad_per_s) * by_bias * by_bias.transpose();
  by_bias << -D.middleCols<3>(kAccel), Matrix3d::Identity();
  P += squared(options.sigma_accel_bias_m_per_s2) * by_bias * by_bias.transpose();
  return P;
}

}  // namespace

StartAttempt start_from_motion(std::span<const ImuSample> imu,
                               std::span<const EncoderSample> encoders,
                               const MovingStartOptions& options) {
  Window window(imu, encoders, options);
  Outputs found;
  MatrixXd D;
  for (const auto step : {&Window::find, &Window::measure}) {
    const std::string_view obstacle = (window.*step)();
    if (!obstacle.empty()) return no_start(obstacle);
  }
  if (!window.solve(VectorXd::Zero(window.covariance().cols()), found) ||
      !differentiate(window, D)) {
    return no_start(kUnusableWheels);
  }
  const auto P_found = covariance_of(window, D, options);
  const double gravity_off = found[kGravity] - options.gravity_m_per_s2;
  if (!(std::abs(gravity_off) < kGate * std::sqrt(P_found(kGravity, kGravity)))) {
    return no_start("what the wheels leave of the specific force is not gravity within four sigma");
  }

  ImuPrior prior;
  prior.t_ns = window.t_ns();
  const Vector3d z = found.segment<3>(kUp);
  prior.state.R_GtoI = R_GtoI_from_up(z);
  const Vector3d v = found.segment<3>(kVelocity);
  prior.state.v_IinG = prior.state.R_GtoI.transpose() * v;
  prior.state.gyro_bias = found.segment<3>(kBias);

  // (F-17): errors of the state from those of up, velocity and biases.
  Eigen::Matrix<double, kImuSize, kOutputs + 3> M;
  M.setZero();
  M.block<3, 3>(kThetaColumn, kUp) = -skew(z);
  M.block<3, 3>(kVelocityColumn, kUp) = prior.state.R_GtoI.transpose() * skew(v) * skew(z);
  M.block<3, 3>(kVelocityColumn, kVelocity) = prior.state.R_GtoI.transpose();
  M.block<3, 3>(kGyroBiasColumn, kBias).setIdentity();
  M.block<3, 3>(kAccelBiasColumn, kOutputs).setIdentity();
  // The yaw is that of G: the velocity in G turns with it.
  Eigen::Matrix<double, kImuSize, 1> by_yaw = Eigen::Matrix<double, kImuSize, 1>::Zero();
  by_yaw.segment<3>(kThetaColumn) = z;
  by_yaw.segment<3>(kVelocityColumn) = prior.state.R_GtoI.transpose() * z.cross(v);
  prior.P =
      M * P_found * M.transpose() + squared(options.sigma_yaw_rad) * by_yaw * by_yaw.transpose();
  prior.P.diagonal().segment<3>(kPositionColumn).setConstant(squared(options.sigma_position_m));
  return {prior, {}};
}

}  // namespace viwo
