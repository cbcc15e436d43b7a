// The sensor csv_table as the host loads it.
#include <cmath>

#include <gmock/gmock.h>
#include <zlib.h>

#include "csv_table_in_folder.hpp"

namespace viwo {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(CsvTable, WheelsComeFromColumnsInAnyOrderAndUnit) {
  const auto samples = play_only<EncoderSample>(
      table("steer fl;t_ms;rpm r;note;rpm l\n90;1000.5;60;\"x; y\";-30\n-45;1010.5;120;;0\n",
            "time_column: t_ms, time_unit: ms, drive_columns: [rpm l, rpm r], drive_unit: rpm, "
            "steer_columns: [steer fl], steer_unit: deg"));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].t_ns, 1'000'500'000);
  EXPECT_EQ(samples[0].n_drive, 2);
  EXPECT_EQ(samples[0].n_steer, 1);
  EXPECT_NEAR(samples[0].drive_rad_per_s[0], -M_PI, 1e-12);
  EXPECT_NEAR(samples[0].drive_rad_per_s[1], 2. * M_PI, 1e-12);
  EXPECT_NEAR(samples[0].steer_rad[0], M_PI / 2., 1e-12);
  EXPECT_NEAR(samples[1].steer_rad[0], -M_PI / 4., 1e-12);
}

TEST_F(CsvTable, DecimalCommasAreReadWhereTheConfigurationSaysSo) {
  const std::string text = "t;drive, left\n1,0005;1,5\n1,0105;-2,25e-1\n";
  const std::string rest =
      "time_column: t, time_unit: s, drive_columns: [\"drive, left\"], max_gap_s: 1";
  for (const std::string more : {"", ", separator: semicolon"}) {
    const auto samples =
        play_only<EncoderSample>(table(text, rest + ", decimal_comma: true" + more));
    ASSERT_EQ(samples.size(), 2U);
    EXPECT_EQ(samples[0].t_ns, 1'000'500'000);
    EXPECT_EQ(samples[0].drive_rad_per_s[0], 1.5);
    EXPECT_EQ(samples[1].drive_rad_per_s[0], -0.225);
  }
  const auto bare = play_only<EncoderSample>(
      table("0,5 1,5\n0,6 2,5\n",
            "time_column: 1, time_unit: s, drive_columns: [2], header: false, "
            "decimal_comma: true, max_gap_s: 1"));
  ASSERT_EQ(bare.size(), 2U);
  EXPECT_EQ(bare[0].t_ns, 500'000'000);
  EXPECT_THAT(error_of(table(text, rest)), HasSubstr("decimal_comma: true"));
  EXPECT_THAT(error_of(table(text, rest + ", separator: comma, decimal_comma: true")),
              HasSubstr("decimal_comma: the separator is a comma already"));
}

struct DriveUnit {
  const char* parameters;
  double factor;
};

TEST_F(CsvTable, EveryUnitOfADriveBecomesRadiansPerSecond) {
  for (const auto& [parameters, factor] :
       std::vector<DriveUnit>{{"drive_unit: rad", 1.},
                              {"drive_unit: deg", M_PI / 180.},
                              {"drive_unit: turn", 2. * M_PI},
                              {"drive_unit: rpm", 2. * M_PI / 60.},
                              {"drive_unit: m, wheel_radius_m: 0.05", 20.},
                              {"drive_unit: count, drive_counts_per_turn: 1000", 2e-3 * M_PI}}) {
    const auto samples = play_only<EncoderSample>(table("t,d\n0,3\n0.1,4\n",
                                                        "time_column: t, time_unit: s, "
                                                        "drive_columns: [d], " +
                                                            std::string(parameters)));
    ASSERT_EQ(samples.size(), 2U);
    EXPECT_NEAR(samples[0].drive_rad_per_s[0], 3. * factor, 1e-12) << parameters;
  }
}

TEST_F(CsvTable, AUnitInTheHeaderMustBeTheOneThatIsConfigured) {
  const auto error = [&](const std::string& header, const std::string& rest) {
    return error_of(
        "{type: csv_table, path: " + write("u.csv", header + "\n0,3,4,5,6,7,8\n0.1,4,4,5,6,7,8\n") +
        ", time_unit: s, " + rest + "}");
  };
  const std::string d = "time_column: 1, drive_columns: [2], ";
  const std::string metres = d + "drive_unit: m, wheel_radius_m: 0.1";
  for (const std::string other : {"[km/h]", "(rad s^-1)", "[m]", "[mph]"}) {
    EXPECT_THAT(error("t,v " + other + ",a,b,c,d,e", metres),
                HasSubstr("drive_unit: the header says that 'v " + other + "' is in "));
  }
  EXPECT_EQ(error("t,v [km/h],a,b,c,d,e", metres + ", drive_scale: [0.2777778]"), "");
  EXPECT_EQ(error("t,v [m/s],a,b,c,d,e", metres + ", drive_scale: [-1]"), "");
  EXPECT_EQ(error("t,v [left],a,b,c,d,e", metres), "");
  EXPECT_EQ(error("t,w [deg s^-1],a,b,c,d,e", d + "drive_unit: deg"), "");
  EXPECT_THAT(error("t,w [deg],a,b,c,d,e", d + "drive_unit: deg"), HasSubstr("is in deg: give"));
  EXPECT_EQ(error("t,w [deg],a,b,c,d,e", d + "drive_unit: deg, drive_input: angle"), "");
  EXPECT_THAT(error("t [ms],v,a,b,c,d,e", metres), HasSubstr("time_unit: the header says"));
  EXPECT_THAT(error("t,v,a,b,c,d,s (deg)", metres + ", steer_columns: [7]"),
              HasSubstr("steer_unit: the header says that 's (deg)' is in deg"));
  EXPECT_THAT(error("t,x [mm],y,h,b,c,d", "time_column: 1, position_columns: [2, 3]"),
              HasSubstr("position_unit: the header says that 'x [mm]' is in mm"));
}

TEST_F(CsvTable, AnglesAreDifferencedOverTheTimeBetweenThem) {
  // 100 counts of 1000 in 0.1 s
  const auto samples = play_only<EncoderSample>(
      table("t,d\n1000000,5000\n1100000,5100\n1200000,5400\n",
            "time_column: t, time_unit: us, drive_columns: [d], drive_input: angle, "
            "drive_unit: count, drive_counts_per_turn: 1000"));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].t_ns, 1'050'000'000);
  EXPECT_NEAR(samples[0].drive_rad_per_s[0], 2. * M_PI, 1e-9);
  EXPECT_NEAR(samples[1].drive_rad_per_s[0], 6. * M_PI, 1e-9);
}

TEST_F(CsvTable, TimesOfEveryUnitAreExactToTheNanosecond) {
  for (const auto& [unit, text] :
       std::vector<std::pair<std::string, std::string>>{{"s", "1700000000.123456789"},
                                                        {"ms", "1700000000123.456789"},
                                                        {"us", "1.700000000123456789e15"},
                                                        {"ns", "1700000000123456789"}}) {
    const auto samples = play_only<PoseSample>(
        table("t,x,y\n" + text + ",1,2\n",
              "time_column: t, time_unit: " + unit + ", position_columns: [x, y]"));
    ASSERT_EQ(samples.size(), 1U);
    EXPECT_EQ(samples[0].t_ns, 1'700'000'000'123'456'789) << unit;
  }
}

TEST_F(CsvTable, ImuAndPosesOfOneTableComeMergedAndOnlyWhereTheyAre) {
  const auto sensor = make_sensor(
      table(",time,wx,wy,wz,ax,ay,az,x,y,z,qx,qy,qz,qw\n"
            "0,10,1,2,3,0,0,1,,,,,,,\n"
            "1,10,,,,,,,100,200,300,0,0,0.6,0.8\n"
            "2,11,1,2,3,0,0.5,1,,,,,,,\n",
            "time_column: time, time_unit: ms, gyro_columns: [wx, wy, wz], gyro_unit: deg, "
            "accel_columns: [ax, ay, az], accel_unit: g, position_columns: [x, y, z], "
            "position_unit: cm, quaternion_columns: [qx, qy, qz, qw]"));
  EXPECT_THAT(kinds_of(*sensor), ElementsAre("imu", "poses"));
  const auto all = play(*sensor);
  ASSERT_EQ(all.size(), 3U);
  const auto* pose = all[0].get_if<PoseSample>();
  ASSERT_NE(pose, nullptr) << "of one time, poses come first";
  EXPECT_THAT(pose->p_BinW_m,
              ElementsAre(DoubleNear(1., 1e-12), DoubleNear(2., 1e-12), DoubleNear(3., 1e-12)));
  EXPECT_EQ(pose->q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));
  const auto imu = only<ImuSample>(all);
  ASSERT_EQ(imu.size(), 2U);
  EXPECT_NEAR(imu[0].gyro_rad_per_s[1], M_PI / 90., 1e-12);
  EXPECT_NEAR(imu[1].accel_m_per_s2[1], 0.5 * 9.80665, 1e-12);
  EXPECT_THAT(rejections_of(*sensor), IsEmpty());
}

TEST_F(CsvTable, AYawIsAboutTheVerticalAxis) {
  const auto samples =
      play_only<PoseSample>(table("t,x,y,h\n0,1,2,90\n",
                                  "time_column: t, time_unit: s, position_columns: [x, y], "
                                  "yaw_column: h, yaw_unit: deg"));
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].p_BinW_m, (std::array{1., 2., 0.}));
  EXPECT_NEAR(samples[0].q_BtoW_xyzw[2], std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(samples[0].q_BtoW_xyzw[3], std::sqrt(0.5), 1e-12);
}

TEST_F(CsvTable, AYawAloneIsAHeading) {
  const auto samples =
      play_only<HeadingSample>(table("t,h\n0,90\n0.1,\n0.2,370\n0.3,nan\n",
                                     "time_column: t, time_unit: s, yaw_column: h, yaw_unit: deg, "
                                     "max_rejected_fraction: 0.5"));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_NEAR(samples[0].yaw_rad, M_PI / 2., 1e-12);
  EXPECT_NEAR(samples[1].yaw_rad, 370. * M_PI / 180., 1e-12);
}

/// Ticks since the row before, as small boards send them.
TEST_F(CsvTable, DrivesMayBeIncrements) {
  const auto samples = play_only<EncoderSample>(
      table("t,l,r\n0,7,7\n0.1,10,20\n0.2,nan,1\n0.3,10,20\n0.4,-5,1\n0.5,x,2\n0.6,1,1\n0.7,2,4\n",
            "time_column: t, time_unit: s, drive_columns: [l, r], drive_input: increment, "
            "drive_unit: count, drive_counts_per_turn: 100, max_rejected_fraction: 0.5, "
            "max_gap_s: 0.5"));
  // None over a row whose ticks are lost.
  ASSERT_EQ(samples.size(), 3U);
  const double count = 2. * M_PI / 100.;
  EXPECT_NEAR(samples[0].drive_rad_per_s[0], 10. * count / 0.1, 1e-9);
  EXPECT_NEAR(samples[1].drive_rad_per_s[0], -5. * count / 0.1, 1e-9);
  EXPECT_NEAR(samples[1].drive_rad_per_s[1], 1. * count / 0.1, 1e-9);
  EXPECT_NEAR(samples[2].drive_rad_per_s[1], 4. * count / 0.1, 1e-9);
}

/// A cheap gyro has one axis, and gives its rate; this one clockwise, in degrees.
TEST_F(CsvTable, AYawRateAloneIsAHeading) {
  const std::string rest =
      "time_column: t, time_unit: s, gyro_unit: deg, heading_scale: -1, max_rejected_fraction: 0.5";
  const auto samples = play_only<HeadingSample>(
      table("t,r [deg/s]\n0,-90\n0.2,-90\n0.2,1e6\n0.4,nan\n0.5,-180\n1e9,0\n0.6,-180\n",
            rest + ", yaw_rate_column: 2"));
  // Of what was accepted; over the gap the rate is what it was.
  ASSERT_EQ(samples.size(), 4U);
  EXPECT_EQ(samples[0].yaw_rad, 0.);
  EXPECT_NEAR(samples[1].yaw_rad, 0.2 * M_PI / 2., 1e-12);
  EXPECT_NEAR(samples[2].yaw_rad, 0.5 * M_PI / 2., 1e-12);
  EXPECT_NEAR(samples[3].yaw_rad, 0.7 * M_PI / 2., 1e-12);
  EXPECT_THAT(error_of(table("t,r,h\n0,1,1\n", rest + ", yaw_rate_column: r, yaw_column: h")),
              HasSubstr("yaw_rate_column: yaw_column says the heading already"));
  EXPECT_THAT(error_of(table("t,r [rad/s]\n0,1\n0.1,1\n", rest + ", yaw_rate_column: 2")),
              HasSubstr("gyro_unit: the header says"));
}

TEST_F(CsvTable, AnAxisOfAnImuMayCountTheOtherWay) {
  const std::string text = "t,gx,gy,gz,ax,ay,az\n0,1,2,3,4,5,-1\n";
  const std::string imu =
      "time_column: t, time_unit: s, gyro_columns: [gx, gy, gz], accel_columns: [ax, ay, az]";
  const auto samples = play_only<ImuSample>(table(
      text,
      imu + ", gyro_scale: 10, gyro_sign: [1, -1, -1], accel_unit: g, accel_sign: [1, 1, -1]"));
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_THAT(samples[0].gyro_rad_per_s, ElementsAre(10., -20., -30.));
  EXPECT_NEAR(samples[0].accel_m_per_s2[0], 4. * 9.80665, 1e-12);
  EXPECT_NEAR(samples[0].accel_m_per_s2[2], 9.80665, 1e-12);
  EXPECT_THAT(error_of(table(text, imu + ", accel_sign: [1, 0.5, 1]")),
              HasSubstr("accel_sign: a sign is 1 or -1"));
  EXPECT_THAT(
      error_of(table(text,
                     "time_column: t, time_unit: s, yaw_rate_column: gz, "
                     "gyro_sign: [1, 1, -1]")),
      HasSubstr("gyro_sign: is of an IMU, and none is read: of a heading it is heading_scale"));
}

TEST_F(CsvTable, APieceOfTheTableIsPlayed) {
  std::string text = "t,d,yaw\n";
  for (int k = 0; k < 10; ++k) {
    text += std::to_string(100 + k) + "," + std::to_string(k) + "," + std::to_string(k) + "\n";
  }
  const std::string rest =
      "time_column: t, time_unit: s, drive_columns: [d], drive_input: angle, yaw_column: yaw, "
      "max_gap_s: 2, ";
  // Seconds from the first row on; a cell that lies across an end is no part of it.
  const auto samples = play(*make_sensor(table(text, rest + "start_s: 2, duration_s: 3.5")));
  const auto cells = only<EncoderSample>(samples);
  ASSERT_EQ(cells.size(), 3U);
  EXPECT_EQ(cells.front().begin_ns, 102'000'000'000);
  EXPECT_EQ(cells.back().end_ns, 105'000'000'000);
  const auto headings = only<HeadingSample>(samples);
  ASSERT_EQ(headings.size(), 4U);
  EXPECT_EQ(headings.front().yaw_rad, 2.);
  EXPECT_EQ(play(*make_sensor(table(text, rest + "start_s: 7.5"))).size(), 1U + 2U);
  EXPECT_THAT(error_of(table(text, rest + "start_s: 10")),
              HasSubstr("start_s: nothing is left: what is read is 9 s long"));
  EXPECT_THAT(error_of(table(text, rest + "start_s: 0.5, duration_s: 0.1")),
              HasSubstr("duration_s: nothing is left"));
}

TEST_F(CsvTable, ColumnsAreFoundByNumberInTablesWithoutAHeaderAndWithBlanks) {
  const std::string rest = "time_column: 1, time_unit: s, drive_columns: [4, 2], ";
  const auto samples =
      play_only<EncoderSample>(table("# written by nobody\n0.0   1  x   2\n 0.1\t3  x   4\n",
                                     rest + "header: false, skip_lines: 1"));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].drive_rad_per_s[0], 2.);
  EXPECT_EQ(samples[1].drive_rad_per_s[1], 3.);
  EXPECT_EQ(samples[1].t_ns, 100'000'000);
  // Names that are there twice or not at all can still be numbered.
  const auto twice = table("t,v,,v\n0,1,x,2\n", rest + "max_gap_s: 1");
  EXPECT_EQ(play_only<EncoderSample>(twice).at(0).drive_rad_per_s[0], 2.);
  EXPECT_THAT(
      error_of(table("t,v,,v\n0,1,x,2\n", "time_column: t, time_unit: s, drive_columns: [v]")),
      HasSubstr("t.csv:1  the header has the column 'v' twice: give its number"));
}

TEST_F(CsvTable, ATabSeparatesAlsoWhereAFieldIsEmpty) {
  const auto samples = play_only<EncoderSample>(
      table("\tt\td\n0\t0.5\t3\n", "time_column: t, time_unit: s, drive_columns: [d]"));
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].drive_rad_per_s[0], 3.);
}

TEST_F(CsvTable, AGzippedTableIsRead) {
  const std::string file = (folder_ / "t.csv.gz").string(), text = "t,d\n0,1\n0.1,2\n";
  gzFile out = gzopen(file.c_str(), "wb");
  gzwrite(out, text.data(), static_cast<unsigned>(text.size()));
  gzclose(out);
  EXPECT_EQ(play_only<EncoderSample>("{type: csv_table, time_column: t, time_unit: s, "
                                     "drive_columns: [d], path: " +
                                     file + "}")
                .size(),
            2U);
}

}  // namespace
}  // namespace viwo
