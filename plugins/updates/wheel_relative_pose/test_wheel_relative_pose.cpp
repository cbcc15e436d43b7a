// The factor: derivatives through the retraction of the filter, gate, what is left out.
#include <cmath>

#include <gtest/gtest.h>

#include "allocations.hpp"
#include "filter_fixture.hpp"
#include "rejections.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::int64_t kMs = 1'000'000;

/// A sweep over a tilted plane, and a filter with two clones 0.1 s apart.
class Sweep : public ::testing::Test {
 protected:
  explicit Sweep(const std::string& model = "four_wis_wid")
      : model_(testing::load_model(testing::swerve(model))),
        motion_("icr_sweep", {.ramp_s = 0.}),
        truth_(testing::free_wheels(drive_, model_.get(), 0.02)) {
    sim::PoseIntegrator pose(motion_);
    for (int k = 0; k < 2; ++k) {
      const double t = 1. + 0.1 * k;
      truth_.clones.push_back(
          drive_.clone((1000 + 100 * k) * kMs, k, pose.advance_to(t), motion_.twist(t)));
    }
    truth_.layout();
    truth_.P.setZero();
  }

  std::vector<EncoderSample> encoders(bool noise, int seed, double rate_hz = 100.) const {
    sim::EncoderSimulation simulation;
    simulation.duration_s = 3.;
    simulation.time_offset_s = 0.02;
    simulation.noise = noise;
    simulation.rate_hz = rate_hz;
    return sim::simulate_encoders(model_->model(), model_->nominal(), motion_, simulation,
                                  static_cast<std::uint64_t>(seed));
  }

  static std::string update(const std::string& more) {
    return "{type: wheel_relative_pose" + more + "}";
  }

  ResidualFactor factor(testing::SmallFilter filter, const std::vector<EncoderSample>& encoders,
                        const std::string& more = "") const {
    const auto plugin = testing::load_update(update(more));
    filter.start(*plugin);
    FactorSink sink(2, 60);
    plugin->update(filter.view(), filter.epoch(encoders), sink);
    EXPECT_EQ(sink.residuals().size(), 1u);
    return sink.residuals()[0];
  }

  std::vector<RejectionCount> rejections(const std::vector<EncoderSample>& encoders,
                                         const std::string& more = "") {
    const auto plugin = testing::load_update(update(more));
    truth_.start(*plugin);
    FactorSink sink(2, 60);
    plugin->update(truth_.view(), truth_.epoch(encoders), sink);
    EXPECT_EQ(sink.residuals().size(), 0u);
    return testing::all_rejections(*plugin);
  }

  std::shared_ptr<const WheelModel> model_;
  testing::TiltedDrive drive_;
  sim::PlanarMotion motion_;
  testing::SmallFilter truth_;
};

TEST_F(Sweep, HasTheDerivativesOfItsResidualThroughTheRetractionAtTheMeasuredReadings) {
  // Noisy readings and wrong intrinsics: the wheels contradict each other.
  const auto noisy = encoders(true, 1);
  testing::SmallFilter at = truth_;
  const auto size = at.P.rows();
  const int clock = at.column(at.wheels.clock);
  VectorXd off = VectorXd::Zero(size);
  off.tail(16).setConstant(2e-4);
  at.plus(off);
  at.first_estimates();
  const auto residual = [&](const VectorXd& d) -> VectorXd {
    testing::SmallFilter moved = at;
    moved.plus(d);
    return factor(moved, noisy).residual;
  };
  MatrixXd numeric = testing::central_difference(residual, VectorXd::Zero(size), 1e-5);
  const ResidualFactor one = factor(at, noisy);
  MatrixXd H = testing::SmallFilter::spread(one.columns, one.H, size);
  // The column of the clock is not the derivative of the residual: the residual moves with the cut
  // of the encoder samples, whose noise its difference has; the published column is that of the
  // prediction.
  EXPECT_GT((H.col(clock) + numeric.col(clock)).norm(), 1e-3);
  H.col(clock).setZero();
  numeric.col(clock).setZero();
  EXPECT_EQ(testing::jacobian_mismatch(-H, numeric, {}, 1e-5), "");
}

TEST_F(Sweep, HasTheClocksDerivativeOfTheCutWhereReadingsAreWithoutNoise) {
  const auto clean = encoders(false, 1, 2000.);
  const auto size = truth_.P.rows();
  const int clock = truth_.column(truth_.wheels.clock);
  const auto moved = [&](double later_s) -> Vector3d {
    testing::SmallFilter filter = truth_;
    VectorXd d = VectorXd::Zero(size);
    d[clock] = later_s;
    filter.plus(d);
    return factor(filter, clean, ", reading: cell").residual;
  };
  const Vector3d numeric = (moved(0.005) - moved(-0.005)) / 0.01;
  const ResidualFactor one = factor(truth_, clean, ", reading: cell");
  const MatrixXd H = testing::SmallFilter::spread(one.columns, one.H, size);
  EXPECT_GT(numeric.norm(), 1e-2);
  EXPECT_LT((H.col(clock) + numeric).norm(), 2e-3 * numeric.norm());
}

TEST_F(Sweep, HasNoResidualAtTheTruthOnATiltedPlaneButThatOfTheHeldReadings) {
  const auto clean = encoders(false, 1);
  EXPECT_LT(factor(truth_, clean, ", reading: cell").residual.norm(), 1e-4);
  EXPECT_LT(factor(truth_, encoders(false, 1, 2000.), ", reading: cell").residual.norm(), 5e-7);
  // Held from the stamp, the readings are half a period late: so is the residual.
  const Vector3d late = factor(truth_, clean).residual;
  const ResidualFactor one = factor(truth_, clean, ", reading: cell");
  const MatrixXd H = testing::SmallFilter::spread(one.columns, one.H, truth_.P.rows());
  const Vector3d expected = -0.005 * H.col(truth_.column(truth_.wheels.clock));
  EXPECT_GT(expected.norm(), 1e-4);
  EXPECT_LT((late - expected).norm(), 0.2 * expected.norm());
}

TEST_F(Sweep, TakesTheClonesDerivativesAtFirstEstimatesIfTheHostHasThem) {
  const auto clean = encoders(false, 1);
  testing::SmallFilter moved = truth_;
  VectorXd off = VectorXd::Zero(truth_.P.rows());
  off.segment(kImuSize, 12).setConstant(0.01);
  moved.plus(off);
  const MatrixXd at_truth = factor(truth_, clean).H;
  EXPECT_LT((factor(moved, clean).H - at_truth).leftCols(12).norm(), 1e-12);
  moved.first_estimates();
  EXPECT_GT((factor(moved, clean).H - at_truth).leftCols(12).norm(), 1e-4);
}

TEST_F(Sweep, LeavesOutWhatTheFilterHolds) {
  WheelsPrior prior = testing::free_wheels(drive_, model_.get(), 0.02);
  prior.sigma_extrinsics.setZero();
  prior.sigma_intrinsics.setZero();
  testing::SmallFilter filter(prior);
  filter.clones = truth_.clones;
  filter.layout();
  const auto clean = encoders(false, 1);
  const ResidualFactor held = factor(filter, clean);
  EXPECT_EQ(held.columns.size(), 13);
  const ResidualFactor all = factor(truth_, clean);
  EXPECT_TRUE(held.H.leftCols(12) == all.H.leftCols(12));
  EXPECT_TRUE(held.H.col(12) == all.H.col(18));
}

TEST_F(Sweep, GatesByChiSquareOfThreeOneOfTwentyIntervalsThatAreRight) {
  const auto square = [&](const ResidualFactor& one) {
    return one.residual.dot(one.R.llt().solve(one.residual));
  };
  const double gate = chi2_quantile(0.95, 3);
  constexpr int kDraws = 1000;
  int beyond = 0;
  for (int i = 0; i < kDraws; ++i) {
    const ResidualFactor one = factor(truth_, encoders(true, i), ", reading: cell");
    EXPECT_EQ(one.gate_probability, 0.05);
    EXPECT_FALSE(one.heavy_tailed) << "dropped, not weighed down";
    EXPECT_EQ(one.noise, nullptr) << "the noise is as configured";
    beyond += square(one) > gate ? 1 : 0;
  }
  // 99.9 % of the binomial distribution.
  EXPECT_NEAR(beyond, 0.05 * kDraws, 3.29 * std::sqrt(0.05 * 0.95 * kDraws));
  auto slipping = encoders(true, 1);
  for (EncoderSample& y : slipping) y.drive_rad_per_s[2] *= 1.3;
  EXPECT_GT(square(factor(truth_, slipping, ", reading: cell")), 100. * gate);
}

TEST_F(Sweep, AddsTheFloorToTheCovarianceOfTheEncoders) {
  const auto noisy = encoders(true, 1);
  const Eigen::Matrix3d R = factor(truth_, noisy).R;
  const Eigen::Matrix3d more =
      factor(truth_, noisy, ", sigma_floor_yaw_rad: 0.1, sigma_floor_position_m: 0.2").R;
  const Eigen::Matrix3d floor = Vector3d(0.01, 0.04, 0.04).asDiagonal();
  EXPECT_LT((more - R - floor).norm(), 1e-12);
}

TEST_F(Sweep, CountsWhatItLeavesOut) {
  const auto clean = encoders(false, 1);
  const auto expect_one = [](const std::vector<RejectionCount>& counts, const char* reason) {
    ASSERT_FALSE(counts.empty());
    EXPECT_EQ(counts[0].reason, reason);
    EXPECT_EQ(counts[0].count, 1);
  };
  expect_one(rejections(std::vector(clean.begin() + 150, clean.end())),
             "interval left out: the encoder samples do not reach over it");
  auto other = clean;
  for (EncoderSample& y : other) y.n_drive = 2;
  expect_one(rejections(other),
             "interval left out: encoder samples without the channels of the model");
  auto broken = clean;
  for (EncoderSample& y : broken) y.drive_rad_per_s[1] = std::nan("");
  const auto counts = rejections(broken);
  expect_one(counts, "interval left out: one encoder sample would have to do for too long");
  ASSERT_EQ(counts.size(), 2u);
  EXPECT_EQ(counts[1].reason, "encoder sample without a twist (replaced by the one before)");
  const auto gated = rejections(encoders(true, 1), ", residual_gate_m_per_s: 1e-6");
  ASSERT_EQ(gated.size(), 2u);
  EXPECT_EQ(gated[1].reason,
            "encoder sample beyond residual_gate_m_per_s (replaced by the one before)");
}

TEST_F(Sweep, DoesNotAllocateAfterTheStart) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const auto noisy = encoders(true, 1);
  const auto plugin = testing::load_update(update(""));
  truth_.start(*plugin);
  FactorSink sink(2, 60);
  const FilterView view = truth_.view();
  const EpochData data = truth_.epoch(noisy);
  plugin->update(view, data, sink);
  sink.clear();
  const auto before = testing::allocations();
  plugin->update(view, data, sink);
  EXPECT_EQ(testing::allocations() - before, 0);
}

}  // namespace
}  // namespace viwo
