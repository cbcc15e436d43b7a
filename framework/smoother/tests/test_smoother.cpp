// Whole simulated recordings: what is found, and how sure it is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "smoothed_swerve.hpp"

namespace viwo {
namespace {

using smoother::Smoothed;
using testing::swerve_run;
using ::testing::ThrowsMessage;

TEST(Smoother, FindsWhatTheFilterIsTooFarFrom) {
  double by_filter = 0., by_smoother = 0.;
  constexpr std::uint64_t kSeeds = 4;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const config::Node run = swerve_run(seed, "figure_eight", testing::far_away());
    const RunResult filter = testing::filtered(run);
    const Smoothed smoothed = testing::smoothed({run});
    EXPECT_TRUE(smoothed.converged) << seed;
    by_filter += testing::mean_square(*filter.final_calibration, filter) / kSeeds;
    by_smoother += testing::mean_square(smoothed.calibration, filter) / kSeeds;
  }
  // 20 parameters of a seed, which go together, over four seeds: about 20 independent squares,
  // whose mean is within these bounds in 99 of 100 cases. The filter's Jacobians, taken where it
  // begins, are wrong by far.
  EXPECT_GT(by_smoother, 0.37);
  EXPECT_LT(by_smoother, 2.0);
  EXPECT_GT(by_filter, 2.0);
}

TEST(Smoother, IsAsSureAsAFilterThatIsLinearisedThere) {
  const Smoothed smoothed = testing::smoothed({swerve_run(1, "figure_eight")});
  // Another way to the covariance: not by normal equations of the whole recording but epoch by
  // epoch.
  const RunResult& last = smoothed.runs.front();
  for (const CalibrationEntry& entry : testing::entries_of(smoothed.calibration)) {
    const auto track = std::find_if(last.calibration.begin(), last.calibration.end(),
                                    [&](const auto& one) { return one.name == entry.name; });
    EXPECT_NEAR(entry.sigma, track->sigma.back(), 1e-4 * entry.sigma) << entry.name;
  }
}

TEST(Smoother, TwoRecordingsTellMoreThanEach) {
  const config::Node one = swerve_run(1, "figure_eight", {"seed=1"}),
                     other = swerve_run(1, "icr_sweep", {"seed=1"});
  const auto both = testing::entries_of(testing::smoothed({one, other}).calibration);
  for (const config::Node& alone : {one, other}) {
    const auto entries = testing::entries_of(testing::smoothed({alone}).calibration);
    ASSERT_EQ(entries.size(), both.size());
    for (std::size_t i = 0; i < both.size(); ++i) {
      EXPECT_LT(both[i].sigma, 1.02 * entries[i].sigma) << both[i].name;
    }
  }
}

TEST(Smoother, GivesTheSameBitsTwice) {
  const auto one = testing::entries_of(testing::smoothed({swerve_run(2, "circle")}).calibration);
  const auto two = testing::entries_of(testing::smoothed({swerve_run(2, "circle")}).calibration);
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].estimate, two[i].estimate);
    EXPECT_EQ(one[i].sigma, two[i].sigma);
  }
}

TEST(Smoother, TakesAllCamerasWithIt) {
  const config::Node run = swerve_run(3, "figure_eight", {"cameras.calibrate=true"});
  const Smoothed smoothed = testing::smoothed({run});
  EXPECT_TRUE(smoothed.converged);
  const CalibrationEntry* const fx = find(smoothed.calibration.cameras, "cam0.fx");
  ASSERT_NE(fx, nullptr);
  EXPECT_GT(fx->sigma, 0.);
  // Simulated exactly as the file says.
  EXPECT_LT(std::abs(fx->estimate - fx->nominal), 4. * fx->sigma);
}

TEST(Smoother, SaysWhatItCannotSmooth) {
  EXPECT_THAT(
      [] { testing::smoothed({swerve_run(1, "circle", {"estimator.type=dead_reckoning"})}); },
      ThrowsMessage<InputError>("recording '1': smoother: the run needs a section 'updates'"));
  EXPECT_THAT(
      [] {
        testing::smoothed(
            {swerve_run(1, "circle"), swerve_run(1, "circle", {"wheels.sigma_t_OtoI_s=0"})});
      },
      ThrowsMessage<InputError>(
          "recording '2': smoother: it estimates other parameters than the first one"));
  // As many, but others.
  EXPECT_THAT(
      [] {
        testing::smoothed({swerve_run(1, "circle", {"wheels.sigma_p_IinO_m=[0.01, 0, 0.01]"}),
                           swerve_run(1, "circle", {"wheels.sigma_t_OtoI_s=0"})});
      },
      ThrowsMessage<InputError>(
          "recording '2': smoother: it estimates other parameters than the first one"));
}

}  // namespace
}  // namespace viwo
