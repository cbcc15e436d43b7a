// An epoch of the whole filter does not touch the heap in the steady state.
#include <gtest/gtest.h>

#include "allocations.hpp"
#include "filter_runs.hpp"

namespace viwo {
namespace {

/// Allocations after the first `warm_up_s` of a run, and how many epochs there were then.
struct Counted {
  long allocations = 0;
  std::int64_t epochs = 0;
  std::int64_t applied = 0;
};
Counted count(const std::vector<std::string>& assignments, double warm_up_s) {
  auto setup = testing::run_setup("runs/viwo_swerve.yaml", assignments);
  const auto data = collect(setup);
  const auto measurements = testing::in_time_order(data);
  Estimator estimator = testing::make_estimator(setup, data.states().front());
  Counted counted;
  for (const testing::Given& given : measurements) {
    const bool warm =
        seconds_between(measurements.front().sample.t_ns(), given.sample.t_ns()) > warm_up_s;
    const long before = testing::allocations();
    testing::add(estimator, setup, given);
    while (estimator.step()) counted.epochs += warm ? 1 : 0;
    if (warm) counted.allocations += testing::allocations() - before;
  }
  EXPECT_EQ(estimator.failure(), "");
  EXPECT_EQ(estimator.filter().clones().size(), 11u);
  counted.applied = estimator.counts().front().applied;
  for (const UpdateCounts& counts : estimator.counts()) EXPECT_GT(counts.applied, 0);
  return counted;
}

TEST(FilterAllocations, ThereAreNoneInTheSteadyStateWithVisionAndWheels) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const Counted counted = count({"sensors.simulator0.duration_s=12"}, 4.);
  EXPECT_EQ(counted.allocations, 0);
  EXPECT_GT(counted.epochs, 70);
  EXPECT_GT(counted.applied, 1000);
}

TEST(FilterAllocations, ThereAreNoneWithFewFeaturesAndOneCamera) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const Counted counted =
      count({"sensors.simulator0.duration_s=12", "sensors.simulator0.features=30",
             "sensors.simulator0.n_cameras=1", "cameras.use=1"},
            4.);
  EXPECT_EQ(counted.allocations, 0);
  EXPECT_GT(counted.epochs, 70);
}

TEST(FilterAllocations, ThereAreNoneWhileUnexcitedDirectionsAreHeld) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  // The straight begins at 20 s; its warnings are given by 30 s.
  const Counted counted =
      count({"sensors.simulator0.duration_s=40", "sensors.simulator0.motion=sweep_then_straight",
             "estimator.hold_unexcited=true"},
            30.);
  EXPECT_EQ(counted.allocations, 0);
  EXPECT_GT(counted.epochs, 90);
}

TEST(FilterAllocations, CountingSeesAnAllocationOfEigen) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const long before = testing::allocations();
  Eigen::MatrixXd matrix(50, 50);
  matrix.setZero();
  EXPECT_EQ(matrix.sum(), 0.);
  EXPECT_GT(testing::allocations() - before, 0);
}

}  // namespace
}  // namespace viwo
