// A small filter with some blocks, of which one group is watched, and random covariances for it.
#pragma once

#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
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

/// A pose: entries PREFIXtheta_x .. z, PREFIXp_x .. z.
inline BlockSpec pose_block(const std::string& name, const std::string& prefix,
                            const Eigen::Vector3d& turn, const Eigen::Vector3d& p,
                            const Eigen::VectorXd& sigma, const std::string& group = "") {
  BlockSpec block{.name = name, .group = group};
  block.add_rotation({prefix + "theta_x", prefix + "theta_y", prefix + "theta_z"}, exp_so3(turn),
                     sigma.head<3>());
  block.add(prefix + "p_x", "m", p.x(), sigma[3]);
  block.add(prefix + "p_y", "m", p.y(), sigma[4]);
  block.add(prefix + "p_z", "m", p.z(), sigma[5]);
  return block;
}

/// Numbers: entries STEM1, STEM2, ...
inline BlockSpec numbers_block(const std::string& name, const std::string& stem,
                               const std::vector<double>& values, const std::vector<double>& sigma,
                               const std::string& group = "") {
  BlockSpec block{.name = name, .group = group};
  for (std::size_t i = 0; i < values.size(); ++i) {
    block.add(stem + std::to_string(i + 1), "m", values[i], sigma[i]);
  }
  return block;
}

using Vector6 = Eigen::Matrix<double, 6, 1>;
inline const Vector6 kArmSigma = (Vector6() << 0.01, 0.02, 0.03, 0.1, 0.2, 0.3).finished();
inline const std::vector<double> kArmNumbersSigma{1., 2., 3., 4., 0.01, 0.02, 0.03, 0.04};
inline const Vector6 kBaseSigma = (Vector6() << 0.011, 0.012, 0.013, 0.04, 0.05, 0.06).finished();
inline constexpr double kClockSigma = 0.01;
/// The second one is held.
inline const std::vector<double> kBaseNumbersSigma{0.001, 0., 0.02};

inline BlockSpec arm_mount() {
  return pose_block("arm.mount", "arm.", {0.3, -0.2, 1.1}, {0.1, -0.2, 0.05}, kArmSigma);
}
inline BlockSpec arm_numbers() {
  return numbers_block("arm.numbers", "arm.n_", {400., 401., 320., 240., 0.1, -0.05, 1e-3, 2e-3},
                       kArmNumbersSigma);
}
inline BlockSpec base_mount() {
  BlockSpec block =
      pose_block("base.mount", "", {-0.1, 0.4, 0.7}, {0.05, 0.02, 0.15}, kBaseSigma, "base");
  for (const std::size_t i : {0u, 1u, 5u}) block.entries[i].needs = Excitation::kTilt;
  return block;
}
inline BlockSpec base_clock(double late_s = 0.004) {
  BlockSpec block{.name = "base.clock", .group = "base"};
  block.add("late", "s", late_s, kClockSigma, Excitation::kClock);
  return block;
}
inline BlockSpec base_numbers() {
  return numbers_block("base.numbers", "n_", {0.05, 0.06, 0.3}, kBaseNumbersSigma, "base");
}
inline std::vector<BlockSpec> fixture_blocks() {
  return {arm_mount(), arm_numbers(), base_mount(), base_clock(), base_numbers()};
}
inline constexpr BlockId kArmMountId{0}, kArmNumbersId{1}, kBaseMountId{2}, kBaseClockId{3},
    kBaseNumbersId{4};

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
// Columns of the filter with fixture_blocks().
inline constexpr int kClones = kImuSize;
inline constexpr int kArmMount = kClones + 4 * kPoseSize;
inline constexpr int kArmNumbers = kArmMount + 6;
inline constexpr int kBaseMount = kArmNumbers + 8;
inline constexpr int kBaseClock = kBaseMount + 6;
inline constexpr int kBaseNumbers = kBaseClock + 1;
inline constexpr int kSize = kBaseNumbers + 3;

inline Filter make_filter(const FilterOptions& options = kOptions,
                          std::vector<RoomSpec> rooms = {}) {
  return Filter(options, fixture_blocks(), std::move(rooms));
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
inline Filter running_filter(Random& random, int clones, const FilterOptions& options = kOptions,
                             std::vector<RoomSpec> rooms = {}) {
  Filter filter = make_filter(options, std::move(rooms));
  filter.initialize(imu_prior(random));
  for (int i = 0; i < clones; ++i) step(filter, random);
  return filter;
}

/// A factor that looks at a bit of everything.
inline ResidualFactor random_factor(Random& random) {
  ResidualFactor factor;
  factor.columns.add(0, kImuSize);
  factor.columns.add(kClones, 2 * kPoseSize);
  factor.columns.add(kArmMount, kSize - kArmMount);
  factor.set_rows(5);
  factor.H = random.matrix(5, factor.columns.size());
  factor.residual = 0.05 * random.matrix(5, 1);
  factor.R.setIdentity();
  return factor;
}

}  // namespace viwo::testing
