// Whether a calibration is as sure as it says, from how its estimate moves.
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "calibration_scatter.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/random.hpp"

namespace viwo {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kSigma = 0.01;
constexpr int kEpochs = 1200, kEpochsOfFiveSeconds = 50;

/// A rotation far from any axis, and a number.
BlockSpec block(Process process) {
  BlockSpec spec;
  spec.name = "cam0";
  spec.add_rotation({"x", "y", "z"}, exp_so3(Vector3d(0.4, -2.1, 0.8)), Vector3d::Constant(0.1));
  spec.add("f", "px", 460., 0.1);
  spec.process = process;
  for (BlockEntry& entry : spec.entries) entry.process_sigma = 1e-4;
  return spec;
}

/// A filter that measures all entries of its block, every tenth of a second for two minutes, with
/// white noise of kSigma, as it knows, and with `lasting` times as much that stays for five
/// seconds.
class Measured {
 public:
  Measured(std::uint64_t seed, const Vector4d& lasting, Process process = Process::kConstant)
      : random_(seed, sim::Stream::kPixelNoise),
        lasting_(lasting),
        filter_({}, {block(process)}),
        truth_(exp_so3(Vector3d(0.03, -0.04, 0.05)) * filter_.blocks().views()[0].rotation()),
        scatter(filter_.blocks()) {}

  void run(std::int64_t begin_ns = 0) {
    for (int i = 0; i < kEpochs; ++i) {
      if (i % kEpochsOfFiveSeconds == 0) offset_ = kSigma * lasting_.cwiseProduct(gaussian());
      ImuPrior later;
      later.t_ns = begin_ns + 100'000'000LL * i;
      filter_.initialize(later);
      measure();
      scatter.epoch(filter_);
    }
  }

 private:
  Vector4d gaussian() {
    return {random_.gaussian(), random_.gaussian(), random_.gaussian(), random_.gaussian()};
  }

  void measure() {
    const BlockView& view = filter_.blocks().views()[0];
    ResidualFactor factor;
    factor.columns.add(view.column(), 4);
    factor.set_rows(4);
    factor.H.setIdentity();
    factor.R = kSigma * kSigma * Matrix4d::Identity();
    // R = Exp(-dtheta) R_hat.
    factor.residual.head<3>() = -log_so3(truth_ * view.rotation().transpose());
    factor.residual[3] = 460.05 - view.numbers()[0];
    factor.residual += kSigma * gaussian() + offset_;
    ASSERT_EQ(filter_.apply(factor), FactorResult::kApplied);
  }

  sim::RandomStream random_;
  Vector4d lasting_, offset_ = Vector4d::Zero();
  Filter filter_;
  Eigen::Matrix3d truth_;

 public:
  CalibrationScatter scatter;
};

TEST(CalibrationScatter, IsOneWhereTheNoiseIsWhite) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Measured measured(seed, Vector4d::Zero());
    measured.run();
    EXPECT_EQ(measured.scatter.factors(), (std::vector{1., 1., 1., 1.})) << "seed " << seed;
  }
}

TEST(CalibrationScatter, IsWhatNoiseThatLastsMakesOfTheSigma) {
  // GIVEN y of the rotation, and the number, with noise of which five seconds have one value
  const Vector4d lasting(0., 1., 0., 0.5);
  // 50 measurements: sigma^2/50 thought, that and the variance of the value had.
  const double y = std::sqrt(1. + 50. * 1.), f = std::sqrt(1. + 50. * 0.25);
  double mean_y = 0., mean_f = 0.;
  constexpr int kSeeds = 50;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    Measured measured(static_cast<std::uint64_t>(seed), lasting);
    measured.run();
    // THEN each of these, and nothing else, is told
    const std::vector<double> factors = measured.scatter.factors();
    EXPECT_EQ(factors[0], 1.);
    EXPECT_EQ(factors[2], 1.);
    EXPECT_GT(factors[1], 1.);
    EXPECT_GT(factors[3], 1.);
    mean_y += factors[1] * factors[1] / kSeeds;
    mean_f += factors[3] * factors[3] / kSeeds;
  }
  // AND by what it is: 22 stretches of each seed, of chi-square
  const double tolerance = 4. * std::sqrt(2. / (22. * kSeeds));
  EXPECT_NEAR(mean_y / (y * y), 1., tolerance);
  EXPECT_NEAR(mean_f / (f * f), 1., tolerance);
}

TEST(CalibrationScatter, SaysNothingOfWhatMayMove) {
  Measured measured(1, Vector4d::Constant(2.), Process::kRandomWalk);
  measured.run();
  EXPECT_EQ(measured.scatter.factors(), (std::vector{1., 1., 1., 1.}));
}

TEST(CalibrationScatter, GoesOnWithTheNextFilter) {
  // GIVEN one that has found its calibration, and others that begin with its prior
  Measured first(1, Vector4d::Zero()), white(2, Vector4d::Zero()), lasting(3, Vector4d::Ones());
  first.run();
  for (Measured* next : {&white, &lasting}) {
    next->scatter = first.scatter;
    next->scatter.begin_anew();
    next->run(120'000'000'000);
  }
  // THEN the jump back is not taken for scatter, and theirs is found
  EXPECT_EQ(white.scatter.factors(), (std::vector{1., 1., 1., 1.}));
  for (const double factor : lasting.scatter.factors()) EXPECT_GT(factor, 3.);
}

}  // namespace
}  // namespace viwo
