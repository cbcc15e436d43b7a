// A small filter with one camera and one wheel set, and random covariances for it.
#pragma once

#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "viwo/filter/filter.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::testing {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double normal() { return normal_(engine_); }
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index cols) {
    return Eigen::MatrixXd::NullaryExpr(rows, cols, [this] { return normal(); });
  }
  Eigen::Vector3d vector3() { return matrix(3, 1); }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

inline CameraPrior camera_prior() {
  CameraPrior prior;
  prior.camera.width_px = 640;
  prior.camera.height_px = 480;
  prior.camera.intrinsics << 400., 401., 320., 240., 0.1, -0.05, 1e-3, 2e-3;
  prior.camera.R_ItoC = exp_so3({0.3, -0.2, 1.1});
  prior.camera.p_IinC << 0.1, -0.2, 0.05;
  prior.sigma_extrinsics << 0.01, 0.02, 0.03, 0.1, 0.2, 0.3;
  prior.sigma_intrinsics << 1., 2., 3., 4., 0.01, 0.02, 0.03, 0.04;
  return prior;
}

/// Three intrinsics, the second one held. The filter never calls the model.
inline WheelsPrior wheels_prior() {
  WheelsPrior prior;
  prior.wheels.R_ItoO = exp_so3({-0.1, 0.4, 0.7});
  prior.wheels.p_IinO << 0.05, 0.02, 0.15;
  prior.wheels.t_OtoI_s = 0.004;
  prior.wheels.x_WI = Eigen::Vector3d(0.05, 0.06, 0.3);
  prior.sigma_extrinsics << 0.011, 0.012, 0.013, 0.04, 0.05, 0.06;
  prior.sigma_time_offset_s = 0.01;
  prior.sigma_intrinsics = Eigen::Vector3d(0.001, 0., 0.02);
  return prior;
}

inline ImuPrior imu_prior(Random& random, std::int64_t t_ns = 1'000'000'000) {
  ImuPrior prior;
  prior.t_ns = t_ns;
  prior.state.R_GtoI = exp_so3(random.vector3());
  prior.state.p_IinG = random.vector3();
  prior.state.v_IinG = random.vector3();
  prior.state.gyro_bias = 0.01 * random.vector3();
  prior.state.accel_bias = 0.1 * random.vector3();
  const ImuMatrix A = 0.02 * random.matrix(kImuSize, kImuSize);
  prior.P = A * A.transpose() + 1e-4 * ImuMatrix::Identity();
  return prior;
}

/// At rest and level, with a variance of `variance` for everything.
inline ImuPrior level_prior(std::int64_t t_ns, double variance = 1e-4) {
  ImuPrior prior;
  prior.t_ns = t_ns;
  prior.P = variance * ImuMatrix::Identity();
  return prior;
}

inline ImuSample imu_sample(std::int64_t t_ns, Random& random) {
  ImuSample sample;
  sample.t_ns = t_ns;
  for (std::size_t i = 0; i < 3; ++i) {
    sample.gyro_rad_per_s[i] = 0.5 * random.normal();
    sample.accel_m_per_s2[i] = random.normal() + (i == 2 ? 9.81 : 0.);
  }
  return sample;
}

/// Direct observation of consecutive columns: H = 1.
inline ResidualFactor observation(int column, const Eigen::VectorXd& residual, double sigma) {
  ResidualFactor factor;
  const int count = static_cast<int>(residual.size());
  factor.columns.add(column, count);
  factor.set_rows(count);
  factor.H.setIdentity();
  factor.residual = residual;
  factor.R.diagonal().setConstant(sigma * sigma);
  return factor;
}

inline constexpr std::int64_t kPeriodNs = 100'000'000;
// Three clones and the newest one.
inline const FilterOptions kOptions = [] {
  FilterOptions options;
  options.clones = 3;
  return options;
}();
inline constexpr int kClones = kImuSize;
inline constexpr int kCameraExtrinsics = kClones + 4 * kPoseSize;
inline constexpr int kCameraIntrinsics = kCameraExtrinsics + 6;
inline constexpr int kWheelsExtrinsics = kCameraIntrinsics + 8;
inline constexpr int kTimeOffset = kWheelsExtrinsics + 6;
inline constexpr int kIntrinsics = kTimeOffset + 1;
inline constexpr int kSize = kIntrinsics + 3;

inline Filter make_filter(const FilterOptions& options = kOptions) {
  return {options, {camera_prior()}, {wheels_prior()}};
}

/// Propagates by one period with random readings and clones.
inline void step(Filter& filter, Random& random) {
  const ImuSample samples[] = {imu_sample(filter.t_ns(), random),
                               imu_sample(filter.t_ns() + kPeriodNs / 2, random),
                               imu_sample(filter.t_ns() + kPeriodNs, random)};
  filter.propagate(samples);
  filter.clone(samples[2]);
}

/// A filter that has been started and has `clones` clones.
inline Filter running_filter(Random& random, int clones, const FilterOptions& options = kOptions) {
  Filter filter = make_filter(options);
  filter.initialize(imu_prior(random));
  for (int i = 0; i < clones; ++i) step(filter, random);
  return filter;
}

/// A factor that looks at a bit of everything.
inline ResidualFactor random_factor(Random& random) {
  ResidualFactor factor;
  factor.columns.add(0, kImuSize);
  factor.columns.add(kClones, 2 * kPoseSize);
  factor.columns.add(kCameraExtrinsics, kSize - kCameraExtrinsics);
  factor.set_rows(5);
  factor.H = random.matrix(5, factor.columns.size());
  factor.residual = 0.05 * random.matrix(5, 1);
  factor.R.setIdentity();
  return factor;
}

}  // namespace viwo::testing
