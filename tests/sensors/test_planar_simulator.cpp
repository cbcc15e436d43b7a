// The planar simulator: what it yields, and a round trip through a log folder.
#include <cmath>

#include "support.hpp"
#include "viwo/asl/asl.hpp"

namespace viwo {
namespace {

constexpr const char* kRobot =
    "robot: {type: differential, radius_left_m: 0.1, radius_right_m: 0.1, baseline_m: 0.5}";
constexpr const char* kSwerve =
    "robot: {type: four_wis_wid, x_m: [0.2, -0.2, -0.2, 0.2], y_m: [0.2, 0.2, -0.2, -0.2], "
    "radius_m: 0.1}";

std::string config(const std::string& robot, const std::string& rest) {
  return "{type: planar_simulator, " + robot + ", " + rest + "}";
}

TEST(PlanarSimulator, YieldsEncodersAndTrueOdometryPosesInTimeOrder) {
  const auto sensor = make_sensor(config(
      kRobot, "motion: circle, noise: false, duration_s: 10, reference_rate_hz: 50, start_ns: 7"));
  const auto all = play(*sensor);
  const auto encoders = only<EncoderSample>(all);
  const auto poses = only<PoseSample>(all);
  ASSERT_EQ(encoders.size(), 1001U);
  ASSERT_EQ(poses.size(), 501U);
  EXPECT_EQ(poses.front().p_BinW_m, (std::array{0., 0., 0.}));
  EXPECT_EQ(poses.back().t_ns, 10'000'000'007);
  const double yaw = 0.6 * 9.5;  // the ramp of 1 s takes half a second
  EXPECT_NEAR(poses.back().p_BinW_m[0], 0.5 / 0.6 * std::sin(yaw), 1e-10);
  EXPECT_NEAR(poses.back().p_BinW_m[1], 0.5 / 0.6 * (1. - std::cos(yaw)), 1e-10);
  EXPECT_NEAR(poses.back().q_BtoW_xyzw[2], std::sin(0.5 * yaw), 1e-10);
  EXPECT_NEAR(poses.back().q_BtoW_xyzw[3], std::cos(0.5 * yaw), 1e-10);
  EXPECT_NEAR(encoders.back().drive_rad_per_s[0], (0.5 - 0.25 * 0.6) / 0.1, 1e-12);
  EXPECT_NEAR(encoders.back().drive_rad_per_s[1], (0.5 + 0.25 * 0.6) / 0.1, 1e-12);
}

TEST(PlanarSimulator, MountsJointsAsItIsTold) {
  const auto right = play_only<EncoderSample>(config(kRobot, "motion: circle, duration_s: 2"));
  const auto wrong = play_only<EncoderSample>(
      config(kRobot, "motion: circle, duration_s: 2, drive_scale: [-1, 2], drive_channel: [2, 1]"));
  ASSERT_EQ(wrong.size(), right.size());
  EXPECT_EQ(wrong.back().drive_rad_per_s[0], 2. * right.back().drive_rad_per_s[1]);
  EXPECT_EQ(wrong.back().drive_rad_per_s[1], -right.back().drive_rad_per_s[0]);
  EXPECT_NE(error_of(config(kRobot, "motion: circle, drive_scale: [1]"))
                .find("sensor.drive_scale: has 1 number for 2 drive channels"),
            std::string::npos);
}

TEST(PlanarSimulator, DrawsTrueIntrinsicsFromTheSeedWhenAsked) {
  const std::string nominal = "motion: straight, noise: false, duration_s: 5";
  const std::string drawn = nominal + ", true_intrinsics_scale: 1";
  const double expected = 5.;
  EXPECT_NEAR(play_only<EncoderSample>(config(kRobot, nominal)).back().drive_rad_per_s[0], expected,
              1e-12);
  const double a = play_only<EncoderSample>(config(kRobot, drawn), 1).back().drive_rad_per_s[0];
  const double b = play_only<EncoderSample>(config(kRobot, drawn), 2).back().drive_rad_per_s[0];
  EXPECT_GT(std::abs(a - expected), 1e-6);
  EXPECT_GT(std::abs(a - b), 1e-6);
  EXPECT_EQ(a, play_only<EncoderSample>(config(kRobot, drawn), 1).back().drive_rad_per_s[0]);
}

TEST(PlanarSimulator, IsExactWhenThatIsAskedForWhateverItsParametersSay) {
  const auto sensor = make_sensor(config(kRobot,
                                         "motion: circle, duration_s: 2, true_intrinsics_scale: 1, "
                                         "outlier_probability: 0.3, slip_start_s: [1], "
                                         "drive_resolution_rad_per_s: 0.1"),
                                  1, true);
  EXPECT_TRUE(sensor->can_be_exact());
  const auto exact = only<EncoderSample>(play(*sensor));
  const auto quiet =
      play_only<EncoderSample>(config(kRobot, "motion: circle, duration_s: 2, noise: false"));
  ASSERT_EQ(exact.size(), quiet.size());
  for (std::size_t k = 0; k < exact.size(); ++k) {
    EXPECT_EQ(exact[k].drive_rad_per_s, quiet[k].drive_rad_per_s) << k;
  }
}

TEST(PlanarSimulator, ASwerveBaseGoesThroughEveryMotion) {
  for (const char* motion : {"icr_sweep", "straight", "lateral", "circle", "stationary",
                             "figure_eight", "crab_varying", "spin", "constant_steering"}) {
    const auto samples =
        play_only<EncoderSample>(config(kSwerve, "duration_s: 20, motion: " + std::string(motion)));
    ASSERT_EQ(samples.size(), 2001U) << motion;
    // Slip turns a wheel by at most 0.2 rad either way, the motions by less than 0.02 per sample:
    // no wheel flips over.
    for (std::size_t k = 1; k < samples.size(); ++k) {
      for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_LT(std::abs(samples[k].steer_rad[i] - samples[k - 1].steer_rad[i]), 0.43)
            << motion << " sample " << k;
      }
    }
  }
}

TEST(PlanarSimulator, SaysWhatItRefusesAndWhere) {
  EXPECT_EQ(error_of(config(kRobot, "motion: lateral")),
            "test.yaml:1:121  sensor.motion: this base cannot follow motion 'lateral' (v = [0, "
            "4.93e-06] m/s, omega = 0 rad/s after 0.01 s)");
  EXPECT_EQ(error_of(config(kRobot, "slip_wheel: 3")),
            "test.yaml:1:125  sensor.slip_wheel: 3 is not one of the robot's 2 wheels");
  EXPECT_NE(error_of(config(kRobot, "motion: circel")).find("did you mean 'circle'?"),
            std::string::npos);
}

TEST(PlanarSimulator, AWrittenSimulationReadsBackToTheSameMeasurements) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "viwo_planar_simulator";
  std::filesystem::remove_all(folder);
  const auto simulated = play(*make_sensor(config(
      kSwerve, "motion: icr_sweep, duration_s: 3, rate_hz: 70, start_ns: 1700000000000000001")));
  log::AslWriter writer(folder);
  for (const Measurement& measurement : simulated) EXPECT_TRUE(writer.write(measurement));
  writer.close();
  const auto encoders =
      play_only<EncoderSample>("{type: asl_encoders, path: " + (folder / "wheels0").string() + "}");
  const auto expected = only<EncoderSample>(simulated);
  ASSERT_EQ(encoders.size(), expected.size());
  for (std::size_t k = 0; k < encoders.size(); ++k) {
    EXPECT_EQ(encoders[k].t_ns, expected[k].t_ns);
    EXPECT_EQ(encoders[k].begin_ns, expected[k].begin_ns);
    EXPECT_EQ(encoders[k].end_ns, expected[k].end_ns);
    EXPECT_EQ(encoders[k].drive_rad_per_s, expected[k].drive_rad_per_s);
    EXPECT_EQ(encoders[k].steer_rad, expected[k].steer_rad);
  }
  const auto poses = play_only<PoseSample>(
      "{type: asl_pose, path: " + (folder / "state_groundtruth_estimate0").string() + "}");
  const auto expected_poses = only<PoseSample>(simulated);
  ASSERT_EQ(poses.size(), expected_poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    EXPECT_EQ(poses[k].t_ns, expected_poses[k].t_ns);
    EXPECT_EQ(poses[k].p_BinW_m, expected_poses[k].p_BinW_m);
    EXPECT_EQ(poses[k].q_BtoW_xyzw, expected_poses[k].q_BtoW_xyzw);
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace viwo
