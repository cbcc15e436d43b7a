// The parity factor: its cost against the sum over samples, where it lands, gate, consistency.
#include <algorithm>
#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "allocations.hpp"
#include "calibration_runs.hpp"
#include "filter_fixture.hpp"
#include "rejections.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo {
namespace {

using Eigen::VectorXd;

constexpr std::int64_t kMs = 1'000'000;

/// Encoder samples of an ICR sweep, and a filter with clones at 1.0 and 1.5 s.
class ParityInterval : public ::testing::Test {
 protected:
  ParityInterval()
      : model_(testing::load_model(testing::swerve("four_wis_wid"))),
        filter_(testing::free_wheels({}, model_.get())) {
    drive("icr_sweep", 1);
    filter_.clones.resize(2);
    for (int k = 0; k < 2; ++k) {
      filter_.clones[static_cast<std::size_t>(k)].t_ns = (1000 + 500 * k) * kMs;
      filter_.clones[static_cast<std::size_t>(k)].slot = k;
    }
    filter_.layout();
    first_ = filter_.column(filter_.wheels.intrinsics);
    filter_.P.diagonal().tail(model_->n_intrinsics()) = model_->prior_sigma().cwiseAbs2();
  }

  void drive(const std::string& how, std::uint64_t seed) {
    const sim::PlanarMotion motion(how, {.ramp_s = 0.});
    sim::EncoderSimulation simulation;
    simulation.duration_s = 4.;
    encoders_ =
        sim::simulate_encoders(model_->model(), model_->nominal(), motion, simulation, seed);
  }

  void run(Update& update, testing::SmallFilter filter, FactorSink& sink) const {
    filter.start(update);
    EpochData data = filter.epoch(encoders_);
    FilterView view = filter.view();
    view.clones = view.clones.first(1);
    update.update(view, data, sink);
    EXPECT_EQ(sink.information(), nullptr);
    data.end_ns = filter.clones.back().t_ns;
    update.update(filter.view(), data, sink);
  }

  double chi2_at(const Intrinsics& x) const {
    Preintegrator preintegrator(model_, {.twist = {.noise_weighted = true}});
    preintegrator.set_intrinsics(x);
    PreintegratedPose pose;
    EXPECT_TRUE(preintegrator.integrate(encoders_, 1000 * kMs, 1500 * kMs, pose));
    return pose.parity.chi2;
  }

  std::shared_ptr<const WheelModel> model_;
  std::vector<EncoderSample> encoders_;
  testing::SmallFilter filter_;
  int first_ = 0;
};

TEST_F(ParityInterval, HasTheGradientOfTheParityCostAndLeavesOutTheGauge) {
  // A tight prior: the factor is linearised at the estimate.
  filter_.P *= 1e-8;
  const auto update = testing::load_update(
      "{type: wheel_parity, period_s: 0, max_iterations: 1, second_order_noise: false, "
      "gate_probability: 0}");
  filter_.x_WI() = sim::perturbed_intrinsics(model_->description(), 0.02, 4);
  FactorSink sink(1, 60);
  run(*update, filter_, sink);
  ASSERT_NE(sink.information(), nullptr);
  EXPECT_EQ(sink.applied(), 1);
  const InformationFactor& factor = *sink.information();
  ASSERT_EQ(factor.columns.size(), 13);
  int k = 0;
  for (const ColumnRange block : factor.columns.blocks()) {
    for (int i = 0; i < block.count; ++i, ++k) {
      const int entry = block.first + i - first_;
      const double sigma = model_->prior_sigma()[entry];
      EXPECT_GT(sigma, 0.);
      Intrinsics forward = filter_.x_WI(), backward = forward;
      forward[entry] += 1e-4 * sigma;
      backward[entry] -= 1e-4 * sigma;
      // d cost / d x = -2 eta. The factor's derivative is at the fitted signal, that of the cost at
      // the measured one: they differ by the noise.
      const double gradient = (chi2_at(forward) - chi2_at(backward)) / (2e-4 * sigma);
      EXPECT_NEAR(-2. * factor.eta[k] * sigma, gradient * sigma,
                  0.01 * std::abs(gradient * sigma) + 30.)
          << model_->description().intrinsics[static_cast<std::size_t>(entry)].name;
    }
  }
}

TEST_F(ParityInterval, LandsWhereThePriorAndTheWheelsMeetAndNeverMovesTheGauge) {
  filter_.x_WI() = sim::perturbed_intrinsics(model_->description(), 2., 9);
  const Intrinsics start = filter_.x_WI();
  const auto landed_chi2 = [&](const std::string& more) {
    testing::SmallFilter filter = filter_;
    const auto update = testing::load_update(
        "{type: wheel_parity, second_order_noise: false, gate_probability: 0" + more + "}");
    FactorSink sink(1, 60);
    run(*update, filter, sink);
    filter.apply(sink);
    for (const char* held : {"x_1", "y_1", "delta_o1"}) {
      EXPECT_EQ(filter.x_WI()[model_->find(held)], start[model_->find(held)]);
    }
    return chi2_at(filter.x_WI());
  };
  EXPECT_GT(chi2_at(start), 1e4);
  EXPECT_LT(landed_chi2(", max_iterations: 10"), 400.);  // 250 samples x dof, less 13
  EXPECT_GT(landed_chi2(", max_iterations: 1"), 1.2 * landed_chi2(", max_iterations: 10"));
}

TEST_F(ParityInterval, IsLinearisedOnceAndAddsNoNoiseWhenItIsToBeExactWhateverTheParametersSay) {
  filter_.x_WI() = sim::perturbed_intrinsics(model_->description(), 1., 9);
  const auto information = [&](const std::string& more, bool exact = false) {
    FactorSink sink(1, 60);
    run(*testing::load_update("{type: wheel_parity, gate_probability: 0" + more + "}", exact),
        filter_, sink);
    EXPECT_NE(sink.information(), nullptr);
    const auto n = sink.information()->columns.size();
    Eigen::MatrixXd all(n, n + 1);
    all << sink.information()->Lambda.topLeftCorner(n, n), sink.information()->eta.head(n);
    return all;
  };
  const Eigen::MatrixXd exact = information(", max_iterations: 10, second_order_noise: true", true);
  EXPECT_TRUE(exact == information(", max_iterations: 1, second_order_noise: false"));
  // Otherwise both are seen.
  EXPECT_FALSE(exact == information(", second_order_noise: false"));
  EXPECT_FALSE(exact == information(", max_iterations: 1"));
}

TEST_F(ParityInterval, OfAStraightLineTellsOffsetsAndNotWhatTheNoiseOfTheTurnRateSays) {
  // Linearised once, at the truth.
  const auto update = testing::load_update(
      "{type: wheel_parity, period_s: 0, second_order_noise: false, find_noise: false, "
      "max_iterations: 1}");
  Preintegrator preintegrator(model_, {.twist = {.noise_weighted = true, .motion_sigmas = 5.}});
  PreintegratedPose pose;
  // Of all intervals together: what the factors say, and what the measured derivatives would.
  const std::array<int, 3> entries{model_->find("y_2"), model_->find("x_3"),
                                   model_->find("delta_o3")};
  Eigen::Array3d told = Eigen::Array3d::Zero(), measured = told;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    drive("straight", seed);
    FactorSink sink(1, 60);
    run(*update, filter_, sink);
    ASSERT_NE(sink.information(), nullptr);
    ASSERT_TRUE(preintegrator.integrate(encoders_, 1000 * kMs, 1500 * kMs, pose));
    int k = 0;
    for (const ColumnRange block : sink.information()->columns.blocks()) {
      for (int i = 0; i < block.count; ++i, ++k) {
        const auto entry =
            std::find(entries.begin(), entries.end(), block.first + i - first_) - entries.begin();
        if (entry < 3) told[entry] += sink.information()->Lambda(k, k);
      }
    }
    for (int i = 0; i < 3; ++i) {
      const auto entry = entries[static_cast<std::size_t>(i)];
      measured[i] += pose.parity.Lambda(entry, entry);
    }
  }
  const Eigen::Array3d share = told / measured;
  EXPECT_LT(share[0], 0.05);
  EXPECT_LT(share[1], 0.05);
  EXPECT_GT(share[2], 0.9);
}

TEST_F(ParityInterval, GatesASlippingWheelButNotWrongIntrinsics) {
  filter_.x_WI() = sim::perturbed_intrinsics(model_->description(), 1., 9);
  FactorSink sink(1, 60);
  run(*testing::load_update("{type: wheel_parity, period_s: 0}"), filter_, sink);
  EXPECT_EQ(sink.applied(), 1);
  EXPECT_EQ(sink.rejected(), 0);
  for (std::size_t i = 110; i < 130; ++i) encoders_[i].drive_rad_per_s[2] *= 1.1;
  sink.clear();
  const auto update =
      testing::load_update("{type: wheel_parity, period_s: 0, wheel_check_probability: 0}");
  run(*update, filter_, sink);
  EXPECT_EQ(sink.applied(), 0);
  EXPECT_EQ(sink.rejected(), 1);
  EXPECT_EQ(sink.information(), nullptr);
  // THEN what the run lists as rejected has it, with the time of the first
  EXPECT_THAT(testing::rejections_of(*update),
              ::testing::ElementsAre("interval dropped by the chi-square gate | 1 | t = 1.500 s"));
}

TEST_F(ParityInterval, DoesNotAllocateInTheSteadyState) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const auto update = testing::load_update("{type: wheel_parity, period_s: 0}");
  filter_.x_WI() = sim::perturbed_intrinsics(model_->description(), 1., 9);
  filter_.start(*update);
  FactorSink sink(1, 60);
  const EpochData data = filter_.epoch(encoders_);
  long allocated = 0;
  std::int64_t applied = 0;
  for (int k = 0; k < 20; ++k) {
    filter_.clones[0] = filter_.clones[1];
    filter_.clones[1].t_ns += 100 * kMs;
    filter_.clones[1].slot = k % 2;
    filter_.layout();
    sink.clear();
    const FilterView view = filter_.view();
    const long before = testing::allocations();
    update->update(view, data, sink);
    if (k >= 3) allocated += testing::allocations() - before;
    applied += sink.applied() + sink.rejected();
  }
  EXPECT_EQ(allocated, 0);
  EXPECT_GE(applied, 18);
}

TEST(WheelParity, IsConsistentWithTheRelativePoseAndNotAsAPlainUpdateOrWithAWrongNoise) {
  const std::string odometry = "{type: wheel_odometry}";
  const auto result = testing::run_calibration(
      {.updates = {odometry, "{type: wheel_parity, period_s: 0}"}, .extrinsics = false});
  // 99 % bounds of chi-square / dof for 12 seeds of 13.
  EXPECT_GT(result.nees_intrinsics, 0.73);
  EXPECT_LT(result.nees_intrinsics, 1.32);
  EXPECT_LT(result.rejected, 12);  // 1 % of 12 x 99
  EXPECT_LT(result.rms.tail(4).maxCoeff(), 0.05);
  EXPECT_LT(result.rms.segment(4, 8).maxCoeff(), 0.1);
  EXPECT_LT(result.rms.head(4).maxCoeff(), 0.3);
  RecordProperty("microseconds", static_cast<int>(result.microseconds));

  const auto plain = testing::run_calibration(
      {.updates =
           {odometry,
            "{type: wheel_parity, period_s: 0, max_iterations: 1, second_order_noise: false, "
            "gate_probability: 0}"},
       .extrinsics = false});
  EXPECT_GT(plain.nees_intrinsics, 2.);
  const auto wrong_noise =
      testing::run_calibration({.updates = {odometry,
                                            "{type: wheel_parity, period_s: 0, noise_scale: 0.5, "
                                            "gate_probability: 0, find_noise: false}"},
                                .extrinsics = false});
  EXPECT_GT(wrong_noise.nees_intrinsics, 2.);
}

}  // namespace
}  // namespace viwo
