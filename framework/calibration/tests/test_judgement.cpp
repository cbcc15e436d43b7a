// A calibration that misleads says so.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "joint_search.hpp"
#include "judgement.hpp"
#include "message_of.hpp"
#include "setpoints.hpp"
#include "unknown_swerve.hpp"

namespace viwo {
namespace {

using namespace calibration;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// A differential drive on a figure eight with a gyro, whose nominal values may be wrong.
CalibrationSetup differential(const std::string& nominal) {
  return testing::gyro_setup(
      "type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.3",
      "type: differential, baseline_m: 0.3, " + nominal, 1);
}

const std::string kRight = "radius_left_m: 0.05, radius_right_m: 0.05";

TEST(Judgement, TrustsWhatIsRight) {
  CalibrationSetup setup = differential(kRight);
  const CalibrationResult result = calibrate(setup);
  EXPECT_THAT(result.doubts, IsEmpty());
  EXPECT_THAT(result.warnings, ElementsAre(HasSubstr("nothing tells the scale")));
  EXPECT_FALSE(result.lengths.empty());
}

TEST(Judgement, DoubtsAFitOfFewResiduals) {
  CalibrationSetup setup = differential(kRight);
  setup.options.segments = Segments::kWhole;
  EXPECT_THAT(calibrate(setup).doubts, Contains(HasSubstr("only 1 residuals for 5 unknowns")));
}

TEST(Judgement, DoubtsAChangeThatThePriorExcludes) {
  CalibrationSetup setup = differential(kRight);
  testing::scale_drives(setup, 1.1);
  const CalibrationResult result = calibrate(setup);
  EXPECT_THAT(result.doubts, Contains(HasSubstr("prior sigmas from its nominal value")));
}

TEST(Judgement, WarnsOfAClockThatThePriorExcludes) {
  CalibrationSetup setup = differential(kRight);
  ASSERT_EQ(setup.options.prior_sigma_clock_offset_s, 0.01) << "it is estimated unless said";
  testing::change_wheels(setup, [](EncoderSample& sample) {
    for (std::int64_t* t_ns : {&sample.t_ns, &sample.begin_ns, &sample.end_ns}) {
      *t_ns -= 100'000'000;
    }
  });
  const CalibrationResult late = calibrate(setup);
  EXPECT_THAT(late.warnings, Contains(HasSubstr("ms later than the wheels")));
  EXPECT_GT(late.all.clock_offset_s.at(0), 0.05);
}

TEST(Judgement, DoubtsAMirroredBaseWhichBoundsExclude) {
  CalibrationSetup setup = differential(kRight + ", prior_sigma_radius_m: 0.1");
  reverse_drives(setup, {-1, -1});
  const CalibrationResult result = calibrate(setup);
  const WheelModel& model = *setup.recordings[0].setup.model;
  for (const char* name : {"r_left", "r_right", "baseline"}) {
    EXPECT_GE(result.all.x_WI[model.find(name)], 0.) << name;
  }
  EXPECT_FALSE(result.is_trusted());
}

TEST(Judgement, DoubtsWhatNothingWasLearnedOf) {
  CalibrationSetup setup = differential(kRight);
  testing::scale_drives(setup, 0.);
  EXPECT_THAT(calibrate(setup).doubts, Contains(HasSubstr("tell less than the priors of all")));
  // Driven straight on, no zero of a steering shows.
  CalibrationSetup straight = testing::unknown_swerve(1, "straight");
  straight.options.find_steering_zeros = true;
  EXPECT_FALSE(calibrate(straight).is_trusted());
}

TEST(Judgement, RefusesStampsOfTwoClocks) {
  CalibrationSetup setup = differential(kRight);
  constexpr std::int64_t kDay_ns = 86'400'000'000'000, kThen_ns = 30'000'000'000;
  testing::change_wheels(setup, [](EncoderSample& sample) {
    if (sample.t_ns < kThen_ns) return;
    for (std::int64_t* stamp : {&sample.t_ns, &sample.begin_ns, &sample.end_ns}) *stamp += kDay_ns;
  });
  for (StampedPose& pose : setup.recordings[0].motion.poses) {
    if (pose.t_ns >= kThen_ns) pose.t_ns += kDay_ns;
  }
  EXPECT_THAT(testing::error_of([&] { calibrate(setup); }),
              HasSubstr("their stamps are of two clocks, or of another unit"));
}

TEST(Judgement, DoubtsADriveThatIsStuck) {
  CalibrationSetup setup = differential(kRight + ", prior_sigma_radius_m: 0.1");
  testing::change_wheels(setup, [](EncoderSample& sample) { sample.drive_rad_per_s[1] = 0.; });
  EXPECT_THAT(calibrate(setup).doubts,
              Contains(HasSubstr("drive_2 reads 0 rad/s all the time, while another turns")));
}

/// Half-way the zero of a steering changes: the fit lies between the two, off by more than sigmas.
TEST(Judgement, DoubtsASteeringThatJumps) {
  const auto jumps_by = [](double jump_rad) {
    const std::string right = testing::kPlaces + "radius_m: 0.0255";
    CalibrationSetup setup = testing::gyro_setup(right, right, 1);
    testing::change_wheels(setup, [&](EncoderSample& sample) {
      if (sample.t_ns > 30'000'000'000) sample.steer_rad[0] += jump_rad;
    });
    return calibrate(setup).doubts;
  };
  EXPECT_THAT(jumps_by(0.2), Contains(HasSubstr("steer_1 is contradicted by all others in")));
  EXPECT_THAT(jumps_by(0.), IsEmpty());
}

/// The geometry that they have is the one that was configured: they would confirm it.
TEST(Judgement, DoubtsWhatAProgramCommanded) {
  const std::string right = testing::kPlaces + "radius_m: 0.0255";
  CalibrationSetup setup = testing::gyro_setup(right, right, 1);
  testing::change_wheels(
      setup, [](EncoderSample& sample) { testing::make_setpoints(sample, 0.1125, 0.0255); });
  EXPECT_THAT(calibrate(setup).doubts, Contains(HasSubstr("the wheels agree exactly")));
}

TEST(Judgement, DoubtsADistanceThatTheWheelsContradict) {
  CalibrationSetup setup =
      differential(kRight + ", prior_sigma_radius_m: 1e-4, prior_sigma_baseline_m: 1e-4");
  MotionReference& motion = setup.recordings[0].motion;
  motion.distance_m = 100.;
  EXPECT_THAT(calibrate(setup).doubts, Contains(HasSubstr("the wheels miss its distance_m")));
  motion.distance_m = {};
  motion.turn_rad = 3.;
  EXPECT_FALSE(calibrate(setup).is_trusted());
}

TEST(Judgement, DoubtsAGyroThatWouldNeedAGreatBias) {
  CalibrationSetup setup = differential(kRight);
  constexpr double kBias_rad_per_s = 0.2;
  Trajectory& poses = setup.recordings[0].motion.poses;
  for (StampedPose& pose : poses) {
    const double turned = kBias_rad_per_s * seconds_between(poses.front().t_ns, pose.t_ns);
    pose.q_BtoW = Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitZ()) * pose.q_BtoW;
  }
  EXPECT_THAT(calibrate(setup).doubts, Contains(HasSubstr("the gyro would need a bias of")));
}

TEST(Judgement, DoubtsAGyroThatTurnsTheOtherWay) {
  CalibrationSetup setup = differential(kRight);
  testing::scale_turns(setup.recordings[0].motion.poses, -1.);
  EXPECT_THAT(calibrate(setup).doubts,
              Contains(HasSubstr("the reference turns the other way than the wheels")));
}

TEST(Judgement, DoubtsAGyroInAnotherUnit) {
  CalibrationSetup setup = differential(kRight);
  testing::scale_turns(setup.recordings[0].motion.poses, M_PI / 180.);
  EXPECT_THAT(calibrate(setup).doubts, Contains(HasSubstr("times as far as the wheels: units")));
}

TEST(Judgement, KnowsNoSideOfADriveThatDoesNotTurn) {
  const std::string right = testing::kPlaces + "radius_m: 0.0255";
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CalibrationSetup setup = testing::gyro_setup(right, right, seed, "straight");
    EXPECT_THAT(calibrate(setup).doubts, Not(Contains(HasSubstr("turns")))) << seed;
    CalibrationSetup two = testing::gyro_setup(
        "type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.3",
        "type: differential, baseline_m: 0.3, " + kRight, seed, "straight");
    EXPECT_THAT(calibrate(two).doubts, Not(Contains(HasSubstr("turns")))) << seed;
  }
}

TEST(Judgement, OfFewResidualsKnowsItsSigmasRoughly) {
  EXPECT_NEAR(most_by_chance(1000000, 1), 3., 1e-3);
  EXPECT_NEAR(most_by_chance(2, 1), 19.2, 0.1);  // tables of Student's t
  EXPECT_NEAR(most_by_chance(8, 1), 4.28, 0.02);
  EXPECT_GT(most_by_chance(8, 10), 5.);
}

}  // namespace
}  // namespace viwo
