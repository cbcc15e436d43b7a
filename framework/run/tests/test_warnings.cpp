// What is suspicious of a run as a whole.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulated.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/run/warnings.hpp"

namespace viwo {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::registry;

TEST(Warnings, OfSamplesAreDoubtsWhereTheFilterHasFoundTheSame) {
  const Findings findings{{"a", "imu0: a gap"}, {"b", "imu0: turned", false, {{"rpy", "0"}}}};
  const auto doubts_with = [&](double found, std::int64_t count) {
    RunResult result;
    result.noises = {{"wheels.noise_scale", "", 1., found, count}};
    add_findings(findings, result);
    EXPECT_EQ(result.doubts.size() + result.warnings.size(), 2U);
    return result.doubts;
  };
  EXPECT_THAT(doubts_with(5., 1000), IsEmpty());
  EXPECT_THAT(doubts_with(50., 10), IsEmpty());
  EXPECT_THAT(doubts_with(50., 1000), ElementsAre("imu0: turned"));
}

TEST(Warnings, OfUpdatesThatCouldUseNothingAreDoubtsWhereNoOtherCould) {
  RunResult result;
  result.status = RunStatus::kOk;
  result.updates.resize(2);
  result.updates[0].name = "visual_features";
  result.updates[1].name = "zero_velocity";  // was given nothing
  const auto reject = [&](const char* reason, std::int64_t count) {
    RejectionCount rejection;
    rejection.reason = reason;
    rejection.count = count;
    result.rejections.emplace_back("estimator", rejection);
  };
  reject("visual_features: point out of the sight of one of its cameras", 500);
  reject("visual_features: track beyond max_features", 30);
  RunResult with_other = result;
  doubt(result);
  EXPECT_EQ(result.warnings.size(), 0U);
  ASSERT_EQ(result.doubts.size(), 1U);
  EXPECT_EQ(
      result.doubts[0],
      "nothing of what visual_features was given could be used; 500 x point out of the sight of "
      "one of its cameras: the estimate is that of the IMU alone");
  with_other.updates[1].total.applied = 3;
  RunResult used = with_other;
  doubt(with_other);
  EXPECT_EQ(with_other.doubts.size(), 0U);
  ASSERT_EQ(with_other.warnings.size(), 1U);
  used.updates[0].total.applied = 1;
  doubt(used);
  EXPECT_TRUE(used.doubts.empty() && used.warnings.empty());
}

TEST(Warnings, OfCalibrationFarFromItsPriorAreDoubtsWhereANoiseIsFarOffToo) {
  RunResult result;
  result.calibration = {{"r_1", "m", {0.1, 0.16}, {0.01, 0.01}},
                        {"r_2", "m", {0.1, 0.14}, {0.01, 0.01}}};
  add_far_from_prior({}, result);
  EXPECT_THAT(result.doubts, IsEmpty());
  EXPECT_THAT(result.warnings, ElementsAre(HasSubstr("r_1: 0.16 m was found, 6 prior sigmas")));
  result.noises = {{"wheels.noise_scale", "", 1., 50., 1000}};
  add_far_from_prior({}, result);
  EXPECT_THAT(result.doubts, ElementsAre(HasSubstr("r_1: 0.16 m was found")));
}

// The vector of a rotation by half a turn jumps, the rotation does not.
TEST(Warnings, OfARotationFarFromItsPriorCountTheAnglesBetween) {
  const auto with = [](const Eigen::Vector3d& by) {
    const Eigen::Vector3d first(3.141, 0.02, -0.01);
    const Eigen::Vector3d last = log_so3(exp_so3(by) * exp_so3(first));
    RunResult result;
    for (const int axis : {0, 1, 2}) {
      result.calibration.push_back({std::string("cam0.theta_ItoC_") + "xyz"[axis],
                                    "rad",
                                    {first[axis], last[axis]},
                                    {0.005, 0.001}});
    }
    EXPECT_LT(last.x(), 0.);
    add_far_from_prior({}, result);
    return result;
  };
  EXPECT_THAT(with({0.004, 0.004, -0.004}).doubts, IsEmpty());
  EXPECT_THAT(with({0.004, 0.004, -0.004}).warnings, IsEmpty());
  EXPECT_THAT(with({0.004, 0.06, -0.004}).doubts,
              ElementsAre(AllOf(HasSubstr("theta_ItoC_y"), HasSubstr("12 prior sigmas"))));
}

TEST(Warnings, OfCalibrationFarFromItsPriorAreDoubtsWhereOneMovesAsItIsLearned) {
  RunResult result;
  result.calibration = {{"r_1", "m", {0.1, 0.16}, {0.01, 0.01}},
                        {"y_1", "m", {0.1, 0.1}, {0.01, 0.01}}};
  result.calibration[1].scatter = 8.;
  add_far_from_prior({}, result);
  EXPECT_THAT(result.doubts, IsEmpty());
  result.calibration[1].scatter = 12.;
  add_far_from_prior({}, result);
  EXPECT_THAT(result.doubts, ElementsAre(HasSubstr("r_1: 0.16 m was found")));
}

TEST(Warnings, OfCalibrationTenSigmasFromItsPriorAreDoubts) {
  RunResult result;
  result.calibration = {{"r_1", "m", {0.1, 0.199}, {0.01, 0.01}},
                        {"r_2", "m", {0.1, 0.21}, {0.01, 0.01}}};
  add_far_from_prior({}, result);
  EXPECT_THAT(result.doubts, ElementsAre(HasSubstr("r_2: 0.21 m was found, 11 prior sigmas")));
  EXPECT_THAT(result.warnings, ElementsAre(HasSubstr("r_1")));
}

TEST(Warnings, NameTheParametersThatScatterMost) {
  RunResult result;
  for (const auto& [name, scatter] :
       {std::pair{"cam0.fx", 3.}, {"r_1", 1.}, {"x_2", 2.5}, {"y_2", 8.}, {"t_OtoI", 2.1}}) {
    result.calibration.emplace_back().name = name;
    result.calibration.back().scatter = scatter;
  }
  EXPECT_THAT(
      too_sure(result),
      ElementsAre(AllOf(HasSubstr("y_2 8 times, cam0.fx 3 times, x_2 2.5 times, and 1 more"),
                        Not(HasSubstr("intrinsics_wander")))));
  // Wheels may be said to give way, unless they are.
  result.final_calibration.emplace().intrinsics = {{"x_2", 0.1, 0.01, 0.1, "m", {}, {}}};
  EXPECT_THAT(too_sure(result), ElementsAre(HasSubstr("intrinsics_wander: 0.5")));
  result.calibration.emplace_back().name = "wander_x_2";
  EXPECT_THAT(too_sure(result), ElementsAre(Not(HasSubstr("intrinsics_wander"))));
  for (CalibrationTrack& track : result.calibration) track.scatter = 1.;
  EXPECT_THAT(too_sure(result), IsEmpty());
}

/// A run of a swerve robot of 0.6 m by 0.5 m on a figure eight, that differs from its configuration
/// as `robot` says.
RunResult run_of(const std::string& robot, const std::string& held_are_exact = "false") {
  const std::string base =
      "type: four_wis_wid, y_m: [0.25, 0.25, -0.25, -0.25], radius_m: 0.05, "
      "sigma_drive_rad_per_s: 0.02, sigma_steer_rad: 0.002, sigma_lateral_m_per_s: 0.003, ";
  RunSetup setup = read_run(
      config::parse("sensors:\n  simulator0: {type: simulator, motion: figure_eight, "
                    "duration_s: 60, features: 0, robot: {" +
                        base + robot +
                        "}}\n"
                        "kinematics: {" +
                        base +
                        "x_m: [0.3, -0.3, -0.3, 0.3], prior_sigma_radius_m: 0.001, "
                        "prior_sigma_position_m: 0.003, prior_sigma_steer_offset_rad: 0.02}\n"
                        "wheels: {sigma_R_ItoO_rad: [0.02, 0.02, 0.02], held_are_exact: " +
                        held_are_exact +
                        "}\n"
                        "estimator: {start: reference}\n"
                        "updates: {wheel_odometry: {}, wheel_parity: {}, planar_motion: {}}\n",
                    "run.yaml"),
      registry(), 1);
  const RunData data = collect(setup);
  return viwo::run(setup, data);
}

// Three prior sigmas of the zero of the first steering are ten and more of each other wheel's
// place.
TEST(Warnings, OfPriorsKnowWhatTheFirstWheelMayBeOffBy) {
  const std::string robot = "x_m: [0.3, -0.3, -0.3, 0.3], steer_offset_rad: [0.06, 0, 0, 0]";
  const RunResult result = run_of(robot);
  EXPECT_THAT(result.doubts, IsEmpty());
  EXPECT_THAT(result.warnings, Not(Contains(HasSubstr("prior sigmas from"))));
  EXPECT_THAT(run_of(robot, "true").doubts, Contains(HasSubstr("prior sigmas from")));
}

TEST(Warnings, OfPriorsKnowThatOneWheelAloneIsElsewhere) {
  EXPECT_THAT(run_of("x_m: [0.3, -0.3, -0.36, 0.3]").doubts, Contains(HasSubstr("x_3: -0.34")));
}

}  // namespace
}  // namespace viwo
