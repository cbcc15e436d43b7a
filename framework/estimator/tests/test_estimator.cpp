// When the estimator makes epochs, and what it hands to the updates.
#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo {
namespace {

using testing::Bench;
using testing::Counts;
using testing::expect_same;
using testing::FakeUpdate;
using testing::imu_at;
using testing::kMs;
using testing::kStart;
using testing::level_prior;
using testing::observation;
using testing::Random;
using testing::Seen;

TEST(Estimator, MakesEpochsAtTicksBetweenImuSamples) {
  Bench bench = Bench::started();
  bench.imu(-10, 400);
  for (const std::int64_t t : {113, 120, 124, 227, 339}) bench.tick(t);
  EXPECT_EQ(bench.steps(), 5);
  std::int64_t last_ns = kStart;
  for (const Seen& seen : bench.update->seen) {
    EXPECT_EQ(seen.begin_ns, last_ns);
    ASSERT_GE(seen.imu.size(), 2u);
    EXPECT_EQ(seen.imu.front().t_ns, seen.begin_ns);
    EXPECT_EQ(seen.imu.back().t_ns, seen.end_ns);
    EXPECT_EQ(seen.clones.back(), seen.end_ns);
    for (std::size_t i = 0; i < seen.imu.size(); ++i) {
      if (i > 0) {
        EXPECT_LT(seen.imu[i - 1].t_ns, seen.imu[i].t_ns);
      }
      expect_same(seen.imu[i], imu_at(seen.imu[i].t_ns), 1e-12);
      // All samples in between are there, as they are.
      const bool inside = i > 0 && i + 1 < seen.imu.size();
      if (inside) {
        EXPECT_EQ(seen.imu[i].t_ns % (10 * kMs), 0);
      }
    }
    const std::int64_t first = seen.begin_ns / (10 * kMs), last = (seen.end_ns - 1) / (10 * kMs);
    EXPECT_EQ(static_cast<std::int64_t>(seen.imu.size()) - 2, last - first);
    ASSERT_EQ(seen.ticks.size(), 1u);
    EXPECT_EQ(seen.ticks[0].t_ns, seen.end_ns);
    EXPECT_EQ(seen.ticks[0].values[1], 200.);
    last_ns = seen.end_ns;
  }
  EXPECT_EQ(last_ns, kStart + 339 * kMs);
  EXPECT_EQ(bench.estimator.epochs(), 5);
  EXPECT_EQ(bench.rejected(), Counts{});
}

TEST(Estimator, MovesTheStateAsOnePropagationOverTheWholeTimeWould) {
  Bench bench = Bench::started();
  bench.imu(-10, 300);
  for (const std::int64_t t : {57, 113, 200}) bench.tick(t);
  EXPECT_EQ(bench.steps(), 3);
  ImuState expected = level_prior(kStart).state;
  std::vector<ImuSample> samples;
  for (std::int64_t t = 0; t <= 200; t += 10) samples.push_back(imu_at(kStart + t * kMs));
  propagate(samples, {}, 9.81, expected);
  EXPECT_LT((bench.estimator.filter().imu().R_GtoI - expected.R_GtoI).norm(), 1e-9);
  EXPECT_LT((bench.estimator.filter().imu().v_IinG - expected.v_IinG).norm(), 1e-7);
  EXPECT_LT((bench.estimator.filter().imu().p_IinG - expected.p_IinG).norm(), 1e-8);
}

TEST(Estimator, TakesTicksOfOneStampTogether) {
  Bench bench = Bench::started();
  bench.imu(-10, 100);
  bench.tick(100, 0);
  EXPECT_EQ(bench.steps(), 0) << "that of the other channel may be on its way";
  bench.tick(100, 1);
  EXPECT_EQ(bench.steps(), 0);
  bench.imu(100, 110);
  EXPECT_EQ(bench.steps(), 1);
  const Seen& seen = bench.update->seen.at(0);
  ASSERT_EQ(seen.ticks.size(), 2u);
  EXPECT_EQ(seen.ticks[0].channel, 0);
  EXPECT_EQ(seen.ticks[1].channel, 1);
  EXPECT_EQ(seen.ticks[1].values[0], 101.);
  bench.tick(100, 2);
  EXPECT_EQ(bench.rejected(), (Counts{{"ticks: at or before the present epoch", 1}}));
}

TEST(Estimator, MakesEpochsWithoutTicksWhereNoneCome) {
  EstimatorOptions options;
  options.schedule.max_epoch_s = 0.2;
  Bench bench = Bench::started({}, {}, options);
  bench.imu(-10, 1000);
  bench.tick(450);
  EXPECT_EQ(bench.steps(), 5);
  std::vector<std::int64_t> ends;
  std::vector<std::size_t> ticks;
  for (const Seen& seen : bench.update->seen) {
    ends.push_back((seen.end_ns - kStart) / kMs);
    ticks.push_back(seen.ticks.size());
  }
  EXPECT_EQ(ends, (std::vector<std::int64_t>{200, 400, 450, 650, 850}));
  EXPECT_EQ(ticks, (std::vector<std::size_t>{0, 0, 1, 0, 0}));
}

TEST(Estimator, NamesTheStagesInTheOrderTheyRun) {
  const auto first = std::make_shared<FakeUpdate>(), second = std::make_shared<FakeUpdate>();
  Estimator estimator({}, {{"one", first, nullptr, ""}, {"two", second, nullptr, ""}});
  EXPECT_EQ(estimator.stage_names(),
            (std::vector<std::string>{"propagate", "one", "two", "marginalise"}));
  ASSERT_EQ(estimator.stage_ms().size(), 4u);
  estimator.start(level_prior(kStart));
  for (std::int64_t t = 0; t <= 300; t += 10) estimator.add(imu_at(kStart + t * kMs));
  ASSERT_TRUE(estimator.step());
  for (const double ms : estimator.stage_ms()) EXPECT_GT(ms, 0.);
  EXPECT_EQ(first->seen.size(), 1u);
  EXPECT_EQ(second->seen.size(), 1u);
}

TEST(Estimator, TellsUpdatesHowLargeTheStateIs) {
  EstimatorOptions options;
  options.filter.clones = 5;
  const Bench bench({.cells = true}, {}, options);
  EXPECT_EQ(bench.update->setup.max_clones, 6);
  EXPECT_EQ(bench.update->setup.max_state_size, bench.estimator.filter().size());
  EXPECT_EQ(bench.estimator.filter().size(), kImuSize + 6 * kPoseSize + 6 + 8 + 6 + 1 + 3);
}

TEST(Estimator, DropsTheOldestCloneWhenTheWindowIsFull) {
  EstimatorOptions options;
  options.filter.clones = 3;
  options.growing_window = false;
  Bench bench = Bench::started({}, {}, options);
  bench.imu(-10, 700);
  for (std::int64_t t = 100; t <= 600; t += 100) bench.tick(t);
  EXPECT_EQ(bench.steps(), 6);
  for (std::size_t k = 0; k < 6; ++k) {
    const Seen& seen = bench.update->seen[k];
    EXPECT_EQ(seen.clones.size(), std::min<std::size_t>(k + 1, 4));
    EXPECT_EQ(seen.oldest_leaves, k >= 3);
    EXPECT_EQ(seen.clones.front(), kStart + (k < 4 ? 100 : 100 * (static_cast<int>(k) - 2)) * kMs);
  }
  EXPECT_EQ(bench.estimator.filter().clones().size(), 3u);
}

TEST(Estimator, BeginsWithThreeClonesAndAddsOneEveryThirdEpoch) {
  EstimatorOptions options;
  options.filter.clones = 5;
  Bench bench = Bench::started({}, {}, options);
  bench.imu(-10, 1600);
  for (std::int64_t t = 100; t <= 1500; t += 100) bench.tick(t);
  ASSERT_EQ(bench.steps(), 15);
  const std::vector<std::size_t> expected{1, 2, 3, 3, 4, 4, 4, 5, 5, 5, 6, 6, 6, 6, 6};
  for (std::size_t k = 0; k < 15; ++k) {
    const Seen& seen = bench.update->seen[k];
    EXPECT_EQ(seen.clones.size(), expected[k]) << k;
    EXPECT_EQ(seen.oldest_leaves, k >= 2 && expected[k] == std::min<std::size_t>(3 + k / 3, 6))
        << k;
  }
}

TEST(Estimator, StopsWhenTheFilterHasDiverged) {
  Bench bench = Bench::started({}, [](const FilterView&, FactorSink& sink) {
    ResidualFactor factor = observation(kPositionColumn, Eigen::VectorXd::Constant(1, 1e308), 1e-9);
    factor.H(0, 0) = 0.1;
    sink.add_residual() = factor;
  });
  bench.imu(-10, 500);
  for (const std::int64_t t : {100, 200, 300}) bench.tick(t);
  EXPECT_EQ(bench.steps(), 1);
  EXPECT_EQ(bench.estimator.failure(), "the estimate or its covariance is not finite any more");
  EXPECT_EQ(bench.estimator.epochs(), 1);
}

/// Writes down in which order it is told what.
class WritingObserver final : public EstimatorObserver {
 public:
  void on_clone(const Filter& filter, const ImuMatrix& Phi) override {
    told.push_back("clone of " + std::to_string((filter.t_ns() - kStart) / kMs));
    EXPECT_EQ(filter.clones().back().t_ns, filter.t_ns());
    EXPECT_NEAR(Phi(kPositionColumn, kVelocityColumn), 0.1, 1e-12);
  }
  void on_factor(const Filter&, const UpdateEntry& update, const ResidualFactor& factor) override {
    told.push_back(update.name + ", " + std::to_string(factor.residual.size()) + " rows");
  }
  void on_factor(const Filter&, const UpdateEntry& update,
                 const InformationFactor& factor) override {
    told.push_back(update.name + ", information of " + std::to_string(factor.columns.size()));
  }
  void on_epoch(const Filter& filter, const EpochData& data) override {
    told.push_back("epoch with " + std::to_string(filter.clones().size()) + " clones and " +
                   std::to_string(data.imu.size()) + " readings");
  }
  std::vector<std::string> told;
};

TEST(Estimator, TellsItsObserverWhatHappensInTheOrderItHappens) {
  Bench bench = Bench::started({}, [](const FilterView&, FactorSink& sink) {
    InformationFactor& information = sink.add_information();
    information.columns.add(kPositionColumn, 6);
    information.Lambda.topLeftCorner(6, 6).setIdentity();
    information.eta.head(6).setZero();
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Zero(), 1.);
  });
  WritingObserver observer;
  bench.estimator.observe(&observer);
  bench.imu(-10, 210);
  bench.tick(100);
  ASSERT_EQ(bench.steps(), 1);
  EXPECT_EQ(observer.told,
            (std::vector<std::string>{"clone of 100", "fake, 3 rows", "fake, information of 6",
                                      "epoch with 1 clones and 11 readings"}));
  bench.estimator.observe(nullptr);
  bench.tick(200);
  ASSERT_EQ(bench.steps(), 1);
  EXPECT_EQ(observer.told.size(), 4u);
}

/// State and covariance after a run with pseudo-random measurements and factors.
std::pair<Eigen::VectorXd, Eigen::MatrixXd> random_run() {
  Random random(12);
  EstimatorOptions options;
  options.filter.clones = 4;
  Bench bench = Bench::started(
      {.cells = true},
      [&](const FilterView& view, FactorSink& sink) {
        ResidualFactor& factor = sink.add_residual();
        factor.columns.add(0, kImuSize);
        factor.columns.add(view.clones.front().column, kPoseSize);
        factor.columns.add(view.block(testing::kBaseMountId).column(), 10);
        factor.set_rows(4);
        factor.H = random.matrix(4, factor.columns.size());
        factor.residual = 0.01 * random.matrix(4, 1);
        factor.R.setIdentity();
      },
      options);
  for (std::int64_t t = 0; t <= 2000; t += 10) {
    bench.estimator.add(testing::imu_sample(kStart + t * kMs, random));
    bench.add(testing::cell_at(kStart + t * kMs));
    if (t % 70 == 35) bench.tick(t);
    bench.steps();
  }
  const Filter& filter = bench.estimator.filter();
  Eigen::VectorXd state(15);
  state << filter.imu().p_IinG, filter.imu().v_IinG, filter.imu().R_GtoI.row(0).transpose(),
      filter.imu().gyro_bias, filter.blocks().view(testing::kBaseMountId).numbers();
  return {state, filter.covariance()};
}

TEST(Estimator, GivesTheSameBitsTwiceInARow) {
  const auto first = random_run(), second = random_run();
  EXPECT_EQ(first.first, second.first);
  EXPECT_EQ(first.second, second.second);
  EXPECT_TRUE(first.first.allFinite());
}

}  // namespace
}  // namespace viwo
