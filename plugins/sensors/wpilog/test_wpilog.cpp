// What wpilog makes of the entries of a log.
#include <cmath>

#include "test_fixture.hpp"

namespace viwo::wpilog {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kStates = "struct:SwerveModuleState[]";
const std::string kRadius = "wheel_radius_m: 0.05";

TEST_F(WpiLog, ModulesOfOneEntryAreSpeedsInTheOrderOfTheWheels) {
  Writer out("what the program says");
  out.geometry();
  for (int k = 0; k < 3; ++k) {
    out.add("/Drive/Modules", kStates, 1'000'000 + 20 * k * kMs,
            numbers({1. + k, 0.1, 2. + k, -0.2, 3. + k, 3., -4., -3.}));
  }
  const auto sensor = make_sensor(log(out.bytes, "module_entries: [/Drive/Modules], " + kRadius));
  EXPECT_THAT(kinds_of(*sensor), ElementsAre("encoders"));
  const auto samples = only<EncoderSample>(play(*sensor));
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[1].t_ns, 1'020'000'000);
  EXPECT_EQ(samples[1].begin_ns, 1'010'000'000);
  EXPECT_EQ(samples[1].n_drive, 4);
  EXPECT_EQ(samples[1].n_steer, 4);
  EXPECT_DOUBLE_EQ(samples[1].drive_rad_per_s[0], 40.);
  EXPECT_DOUBLE_EQ(samples[1].drive_rad_per_s[3], -80.);
  EXPECT_EQ(samples[1].steer_rad[1], -0.2);
  EXPECT_EQ(samples[1].steer_rad[3], -3.);
  EXPECT_THAT(rejections_of(*sensor), IsEmpty());
}

TEST_F(WpiLog, DistancesOfModulesAreAngles) {
  Writer out;
  out.geometry();
  for (int k = 0; k < 3; ++k) {
    for (const char* name : {"/left", "/right"}) {
      out.add(name, "struct:SwerveModulePosition", 20 * k * kMs, numbers({0.01 * k * k, 0.1 * k}));
    }
  }
  const auto samples =
      play_only<EncoderSample>(log(out.bytes, "module_entries: [/left, /right], " + kRadius));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[1].n_drive, 2);
  EXPECT_EQ(samples[1].t_ns, 30'000'000);
  EXPECT_NEAR(samples[1].drive_rad_per_s[0], 0.03 / 0.05 / 0.02, 1e-9);
  EXPECT_NEAR(samples[1].steer_rad[1], 0.15, 1e-12);
}

TEST_F(WpiLog, NumbersOfOldLogsArePairsOfAngleAndSpeed) {
  Writer out;
  out.add("NT:/states", "double[]", 0, numbers({90., 1., -45., 2.}));
  out.add("NT:/states", "double[]", 20 * kMs, numbers({90., 1., -45., 2.}));
  const auto samples = play_only<EncoderSample>(
      log(out.bytes, "module_entries: [\"NT:/states\"], steer_unit: deg, " + kRadius));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_DOUBLE_EQ(samples[0].drive_rad_per_s[1], 40.);
  EXPECT_DOUBLE_EQ(samples[0].steer_rad[0], M_PI / 2.);
  EXPECT_DOUBLE_EQ(samples[0].steer_rad[1], -M_PI / 4.);
}

TEST_F(WpiLog, PlainNumbersMayBeOfAnyTypeAndStandWithinOthers) {
  Writer out;
  out.geometry();
  out.schema("Motors", "enum {off=0} uint8 mode;int16 rpm[2]");
  for (int k = 0; k < 2; ++k) {
    const std::int64_t t = 20 * k * kMs;
    out.add("/a", "double", t, number(60.));
    out.add("/b", "int64", t, bytes_of(static_cast<std::uint64_t>(-120), 8));
    out.add("/c", "struct:Motors", t, "\1" + bytes_of(0, 2) + bytes_of(180, 2));
    out.add("/d", "double[]", t, numbers({0., 0., 240.}));
    out.add("/e", "float", t, bytes_of(0x3f000000, 4));
    out.add("/f", "struct:Rotation2d", t, number(0.25));
    out.add("/g", "struct:Rotation2d[]", t, numbers({0., 0.75}));
  }
  const auto samples =
      play_only<EncoderSample>(log(out.bytes,
                                   "drive_entries: [/a, /b, /c/rpm/1, /d/2], drive_unit: rpm, "
                                   "steer_entries: [/e, /f, /g/1/value]"));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].n_drive, 4);
  EXPECT_EQ(samples[0].n_steer, 3);
  for (const auto& [i, turns] : {std::pair{0, 1.}, {1, -2.}, {2, 3.}, {3, 4.}}) {
    EXPECT_NEAR(samples[0].drive_rad_per_s[static_cast<std::size_t>(i)], 2. * M_PI * turns, 1e-12);
  }
  EXPECT_EQ(samples[0].steer_rad[0], 0.5);
  EXPECT_EQ(samples[0].steer_rad[1], 0.25);
  EXPECT_EQ(samples[0].steer_rad[2], 0.75);
}

TEST_F(WpiLog, AValueHoldsUntilTheNextAndTheCycleEntrySaysWhenThereAreReadings) {
  Writer out;
  const auto drive = [&](const char* name, std::int64_t ms, double value) {
    out.add(name, "double", ms * kMs, number(value));
  };
  // Both are written when they change, a bit behind the entry of the cycle.
  for (int k = 0; k < 10; ++k) {
    out.add("/Timestamp", "int64", 100 * k * kMs, bytes_of(0, 8));
    if (k == 1) drive("/l", 101, 1.);
    if (k == 2) drive("/r", 200, 2.);
    if (k == 9) drive("/l", 901, 3.);
  }
  const std::string rest = "drive_entries: [/l, /r], drive_unit: rad, ";
  const auto sensor = make_sensor(log(out.bytes, rest + "cycle_entry: /Timestamp"));
  const auto samples = only<EncoderSample>(play(*sensor));
  ASSERT_EQ(samples.size(), 8U);
  EXPECT_EQ(samples[0].t_ns, 200'000'000);
  EXPECT_EQ(samples[0].drive_rad_per_s[0], 1.);
  EXPECT_EQ(samples[0].drive_rad_per_s[1], 2.);
  EXPECT_EQ(samples[6].drive_rad_per_s[0], 1.);
  EXPECT_EQ(samples[7].drive_rad_per_s[0], 3.) << "what comes within the spread is of the cycle";
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(HasSubstr("wheels: cycle before the first value of each entry | 2 | ")));
  // Without it, readings are where something was written, and a hole is a gap.
  const auto written = make_sensor(log(out.bytes, rest + "max_gap_s: 0.2"));
  EXPECT_EQ(play(*written).size(), 2U);
  EXPECT_THAT(rejections_of(*written),
              ElementsAre(HasSubstr("cycle before the first value of each entry | 1"),
                          HasSubstr("wheels: gap longer than 0.2 s | 1 | ")));
}

TEST_F(WpiLog, RecordsNeedNotBeInTheOrderOfTimeAndStampsMayBeNegative) {
  Writer out;
  for (const int k : {3, 1, -1, 2, 0}) {
    out.add("/d", "double", 20 * k * kMs, number(k));
  }
  const auto samples =
      play_only<EncoderSample>(log(out.bytes, "drive_entries: [/d], drive_unit: rad"));
  ASSERT_EQ(samples.size(), 5U);
  EXPECT_EQ(samples[0].t_ns, -20'000'000);
  for (int k = 0; k < 5; ++k) {
    EXPECT_EQ(samples[static_cast<std::size_t>(k)].drive_rad_per_s[0], k - 1);
  }
}

TEST_F(WpiLog, TwoValuesOfOneEntryWithinACycleAreCountedAndTooManyAreAnError) {
  Writer out;
  for (int k = 0; k < 20; ++k) {
    out.add("/right", "double", 20 * k * kMs, number(k));
    if (k % 4 == 0) out.add("/right", "double", 20 * k * kMs + 500, number(k));  // the same again
    if (k % 4 == 1) out.add("/right", "double", 20 * k * kMs + 500, number(-k));
  }
  const std::string rest = "drive_entries: [/right], drive_unit: rad";
  EXPECT_THAT(error_of(log(out.bytes, rest)),
              HasSubstr("a.wpilog  the entry '/right' has two values within 0.002 s 5 times in 30 "
                        "records (first at byte "));
  const auto sensor = make_sensor(log(out.bytes, rest + ", max_rejected_fraction: 0.2"));
  const auto samples = only<EncoderSample>(play(*sensor));
  ASSERT_EQ(samples.size(), 20U);
  EXPECT_EQ(samples[1].drive_rad_per_s[0], -1.);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(HasSubstr("wheels: '/right': two values within a cycle, the first not "
                                    "used | 5 | a.wpilog: byte ")));
  EXPECT_EQ(play_only<EncoderSample>(log(out.bytes, rest + ", cycle_spread_s: 0")).size(), 30U);
}

TEST_F(WpiLog, PosesComeFromStructsArraysAndNumbers) {
  Writer out;
  out.geometry();
  const double h = std::sqrt(0.5);
  out.add("/p2", "struct:Pose2d", 0, numbers({1., 2., M_PI / 2.}));
  out.add("/p3", "struct:Pose3d", 0, numbers({1., 2., 3., h, 0., 0., h}));
  out.add("/one", "struct:Pose3d[]", 0, "");
  out.add("/one", "struct:Pose3d[]", 0, numbers({1., 2., 3., h, 0., 0., h}));
  out.add("/old2", "double[]", 0, numbers({1., 2., 90.}));
  out.add("/old3", "double[]", 0, numbers({1., 2., 3., h, 0., 0., h}));
  out.add("/x", "double", 0, number(1.));
  out.add("/y", "double", 0, number(2.));
  out.add("/h", "double", 1, number(90.));
  for (const auto& [rest, z] :
       std::vector<std::pair<std::string, double>>{{"[/p2]", 0.},
                                                   {"[/p3]", 3.},
                                                   {"[/one]", 3.},
                                                   {"[/old2], yaw_unit: deg", 0.},
                                                   {"[/old3]", 3.},
                                                   {"[/x, /y, /h], yaw_unit: deg", 0.}}) {
    const auto samples = play_only<PoseSample>(log(out.bytes, "pose_entries: " + rest));
    ASSERT_EQ(samples.size(), 1U) << rest;
    EXPECT_EQ(samples[0].p_BinW_m, (std::array{1., 2., z})) << rest;
    EXPECT_NEAR(samples[0].q_BtoW_xyzw[2], h, 1e-12) << rest;
    EXPECT_NEAR(samples[0].q_BtoW_xyzw[3], h, 1e-12) << rest;
  }
}

TEST_F(WpiLog, AGyroOfTheYawIsAHeading) {
  Writer out;
  out.geometry();
  out.add("/gyro", "double", 0, number(-90.));
  out.add("/turn", "struct:Rotation2d", 0, numbers({M_PI / 2.}));
  const double h = std::sqrt(0.5);
  out.add("/turn3", "struct:Rotation3d", 0, numbers({h, 0., 0., h}));
  out.add("/turn3", "struct:Rotation3d", 20 * kMs, numbers({0., 0., 0., 0.}));  // not yet known
  out.add("/pose3", "struct:Pose3d", 0, numbers({1., 2., 3., h, 0., 0., h}));
  for (const char* rest : {"/gyro, yaw_unit: deg, heading_scale: -1", "/turn",
                           "/turn3, max_rejected_fraction: 0.6", "/pose3/rotation"}) {
    const auto samples =
        play_only<HeadingSample>(log(out.bytes, std::string("heading_entry: ") + rest));
    ASSERT_EQ(samples.size(), 1U) << rest;
    EXPECT_NEAR(samples[0].yaw_rad, M_PI / 2., 1e-12) << rest;
  }
}

TEST_F(WpiLog, AGyroInDegreesLeavesThePosesOfTheProgramInRad) {
  Writer out;
  out.geometry();
  out.add("/gyro", "double", 0, number(90.));
  out.add("/wrong", "struct:Rotation2d", 0, numbers({90.}));  // a program that takes it for degrees
  out.add("/p2", "struct:Pose2d", 0, numbers({1., 2., M_PI / 2.}));
  const double h = std::sqrt(0.5);
  for (const char* heading : {"/gyro", "/wrong"}) {
    const auto samples =
        play(*make_sensor(log(out.bytes, std::string("pose_entries: [/p2], yaw_unit: deg, ") +
                                             "heading_entry: " + heading)));
    const auto headings = only<HeadingSample>(samples);
    const auto poses = only<PoseSample>(samples);
    ASSERT_EQ(headings.size(), 1U) << heading;
    ASSERT_EQ(poses.size(), 1U) << heading;
    EXPECT_NEAR(headings[0].yaw_rad, M_PI / 2., 1e-12) << heading;
    EXPECT_NEAR(poses[0].q_BtoW_xyzw[2], h, 1e-12) << heading;
  }
}

TEST_F(WpiLog, AHeadingMayBeInAnotherUnitThanPosesOfNumbers) {
  Writer out;
  out.geometry();
  out.add("/turn", "struct:Rotation2d", 0, numbers({M_PI / 2.}));
  out.add("/limelight", "double[]", 0, numbers({1., 2., 90.}));
  const auto samples =
      play(*make_sensor(log(out.bytes,
                            "pose_entries: [/limelight], yaw_unit: deg, heading_entry: /turn, "
                            "heading_unit: rad")));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_NEAR(only<HeadingSample>(samples).at(0).yaw_rad, M_PI / 2., 1e-12);
  EXPECT_NEAR(only<PoseSample>(samples).at(0).q_BtoW_xyzw[2], std::sqrt(0.5), 1e-12);
}

TEST_F(WpiLog, AYawRateAloneIsAHeading) {
  Writer out;
  for (int k = 0; k < 3; ++k) out.add("/rate", "double", 100 * k * kMs, number(90. * k));
  const auto samples =
      play_only<HeadingSample>(log(out.bytes, "yaw_rate_entry: /rate, gyro_unit: deg"));
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_NEAR(samples[2].yaw_rad, 0.2 * M_PI / 2., 1e-12);
  // Written when it changes: it stood for ten seconds.
  Writer rest;
  rest.add("/rate", "double", 0, number(0.));
  rest.add("/rate", "double", 10'000 * kMs, number(90.));
  rest.add("/rate", "double", 10'020 * kMs, number(90.));
  EXPECT_NEAR(play_only<HeadingSample>(log(rest.bytes, "yaw_rate_entry: /rate, gyro_unit: deg"))
                  .back()
                  .yaw_rad,
              0.02 * M_PI / 2., 1e-12);
  EXPECT_THAT(error_of(log(out.bytes, "yaw_rate_entry: /rate, heading_entry: /rate")),
              HasSubstr("heading_entry says the heading already"));
}

TEST_F(WpiLog, AFullImuIsOneAndComesInTheOrderOfTime) {
  Writer out;
  for (int k = 0; k < 2; ++k) {
    for (const char* axis : {"x", "y", "z"}) {
      out.add(std::string("/gyro/") + axis, "double", 10 * k * kMs, number(180.));
      out.add(std::string("/accel/") + axis, "double", 10 * k * kMs, number(1.));
    }
    out.add("/d", "double", 10 * k * kMs, number(1.));
  }
  const auto sensor =
      make_sensor(log(out.bytes,
                      "gyro_entries: [/gyro/x, /gyro/y, /gyro/z], gyro_unit: deg, accel_entries: "
                      "[/accel/x, /accel/y, /accel/z], accel_unit: g, drive_entries: [/d], " +
                          kRadius));
  EXPECT_THAT(kinds_of(*sensor), ElementsAre("encoders", "imu"));
  const auto all = play(*sensor);
  ASSERT_EQ(all.size(), 4U);
  const auto* imu = all[0].get_if<ImuSample>();
  ASSERT_NE(imu, nullptr);
  EXPECT_NEAR(imu->gyro_rad_per_s[2], M_PI, 1e-12);
  EXPECT_NEAR(imu->accel_m_per_s2[0], 9.80665, 1e-12);
}

TEST_F(WpiLog, APieceOfTheLogIsPlayed) {
  Writer out;
  for (int k = 0; k < 10; ++k) out.add("/gyro", "double", 100 * k * kMs, numbers({0.1 * k}));
  const auto headings = play_only<HeadingSample>(
      log(out.bytes, "heading_entry: /gyro, start_s: 0.25, duration_s: 0.3"));
  ASSERT_EQ(headings.size(), 3U);
  EXPECT_EQ(headings[0].t_ns, 300'000'000);
}

TEST_F(WpiLog, IdsAreUsedAgainAndFieldsOfRecordsMayBeAsWideAsTheyCan) {
  Writer out;
  out.start(7, "/other", "string");
  out.record(7, 0, "text");
  out.set_metadata(7, "{\"source\":\"NT\"}");
  out.finish(7);
  out.start(7, "/d", "double");
  out.record(7, 20 * kMs, number(1.), true);
  out.finish(7);
  out.start(70'000, "/d", "double");
  out.record(70'000, 40 * kMs, number(2.));
  out.record(70'000, -20 * kMs, number(0.), true);
  const auto sensor = make_sensor(log(out.bytes, "drive_entries: [/d], drive_unit: rad"));
  const auto samples = only<EncoderSample>(play(*sensor));
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[0].t_ns, -20'000'000);
  EXPECT_EQ(samples[2].drive_rad_per_s[0], 2.);
  EXPECT_THAT(rejections_of(*sensor), IsEmpty());
}

TEST_F(WpiLog, AGzippedLogIsRead) {
  Writer out;
  out.add("/d", "double", 0, number(1.));
  EXPECT_EQ(play_only<EncoderSample>("{type: wpilog, drive_entries: [/d], drive_unit: rad, path: " +
                                     gzipped(out.bytes) + "}")
                .size(),
            1U);
}

}  // namespace
}  // namespace viwo::wpilog
