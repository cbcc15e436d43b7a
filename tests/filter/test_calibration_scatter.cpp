// What the scatter of a calibration (F-42) is worth, where the truth is known: errors in sigmas of
// wheels on tyres, which are off for seconds on end, and of wheels as the filter thinks them.
#include <cmath>

#include <gtest/gtest.h>

#include "filter_runs.hpp"

namespace viwo {
namespace {

/// Root mean squares over parameters and seeds.
struct Errors {
  double in_sigmas = 0.;
  double with_scatter = 0.;
  int parameters = 0, scattering = 0;
};

Errors errors_of(const std::string& name) {
  Errors errors;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    RunSetup setup = testing::run_setup(name, {}, seed);
    const RunResult result = run(setup, collect(setup));
    EXPECT_EQ(result.status, RunStatus::kOk) << result.cause;
    for (const CalibrationTrack& track : result.calibration) {
      // The lag of tyres that is always the same is a part of the clock.
      if (!(track.sigma.back() > 0.) || track.name == "t_OtoI") continue;
      const double error = track.final_error / track.sigma.back();
      errors.in_sigmas += error * error;
      errors.with_scatter += error * error / (track.scatter * track.scatter);
      ++errors.parameters;
      if (track.scatter > 1.) ++errors.scattering;
    }
  }
  errors.in_sigmas = std::sqrt(errors.in_sigmas / errors.parameters);
  errors.with_scatter = std::sqrt(errors.with_scatter / errors.parameters);
  return errors;
}

TEST(CalibrationScatter, FindsHowWrongTheSigmasOfWheelsOnTyresAre) {
  const Errors errors = errors_of("runs/viwo_contact.yaml");
  ASSERT_EQ(errors.parameters, 4 * 19);
  EXPECT_GT(errors.in_sigmas, 3.);
  EXPECT_LT(errors.with_scatter, 2.);
  EXPECT_GT(errors.with_scatter, 0.7);
}

TEST(CalibrationScatter, IsOneOfWheelsAsTheFilterThinksThem) {
  const Errors errors = errors_of("runs/viwo_swerve.yaml");
  ASSERT_EQ(errors.parameters, 4 * 19);
  EXPECT_EQ(errors.scattering, 0);
}

}  // namespace
}  // namespace viwo
