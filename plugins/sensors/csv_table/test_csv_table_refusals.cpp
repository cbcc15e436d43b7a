// What csv_table refuses, of its parameters and of its table.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "csv_table_in_folder.hpp"

namespace viwo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CsvTableRefusals : public CsvTable {};

TEST_F(CsvTableRefusals, BadRowsAreCountedWithTheirPlaceUpToTheLimit) {
  const std::string text = "t,d\n0,1\n0.1,oops\n0.1\n0.1,nan\n0.05,2\n0.0,3\n0.2,4\n0.3,5\n0.4";
  const std::string rest = "time_column: t, time_unit: s, drive_columns: [d], ";
  const auto sensor = make_sensor(table(text, rest + "max_rejected_fraction: 0.7"));
  EXPECT_EQ(play(*sensor).size(), 4U);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre("wheels: row that cannot be read | 2 | t.csv:3  column 'd': 'oops' is "
                          "not a number",
                          "wheels: value that is not finite | 1 | t.csv:5",
                          "wheels: stamp not after the previous one | 1 | t.csv:7",
                          "wheels: last line cut short | 1 | t.csv:10"));
  EXPECT_THAT(error_of(table(text, rest + "max_rejected_fraction: 0.5")),
              HasSubstr("t.csv  5 of 9 data rejected, allowed is a fraction of 0.5"));
}

TEST_F(CsvTableRefusals, SaysWhatIsWrongWithItsParameters) {
  const std::string text = "t,d,s\n0,1,2\n0.1,1,2\n", time = "time_column: t, time_unit: s, ";
  const auto error = [&](const std::string& rest) { return error_of(table(text, rest)); };
  EXPECT_THAT(error("drive_columns: [d]"), HasSubstr("time_column"));
  EXPECT_THAT(error("time_column: t, drive_columns: [d]"), HasSubstr("time_unit"));
  EXPECT_THAT(error(time + "max_gap_s: 1"),
              HasSubstr("sensor.path: nothing to read: give drive_columns, or gyro_columns"));
  EXPECT_THAT(error("time_column: time, time_unit: s, drive_columns: [d]"),
              HasSubstr("t.csv:1  no column 'time' - there are: t, d, s"));
  EXPECT_THAT(error(time + "drive_columns: [4]"), HasSubstr("no column '4'"));
  EXPECT_THAT(error(time + "drive_columns: [d], drive_unit: m"),
              HasSubstr("sensor.wheel_radius_m: drive_unit: m needs wheel_radius_m"));
  EXPECT_THAT(error(time + "drive_columns: [d], drive_unit: rpm, drive_input: angle"),
              HasSubstr("sensor.drive_unit: rpm is no unit of angles"));
  EXPECT_THAT(error(time + "drive_columns: [d], drive_unit: count"),
              HasSubstr("sensor.drive_counts_per_turn: counts need drive_counts_per_turn"));
  EXPECT_THAT(error(time + "drive_columns: [d], steer_columns: [s], steer_unit: count"),
              HasSubstr("sensor.steer_counts_per_turn: counts need steer_counts_per_turn"));
  EXPECT_THAT(error(time + "drive_columns: [d], stride: 2"),
              HasSubstr("sensor.stride: a stride needs drive_input: angle"));
  EXPECT_THAT(error(time + "steer_columns: [s]"), HasSubstr("steering angles need drive_columns"));
  EXPECT_THAT(error(time + "gyro_columns: [t, d, s]"), HasSubstr("an IMU has both"));
  EXPECT_THAT(error(time + "gyro_columns: [d, s], accel_columns: [t, d, s]"),
              HasSubstr("sensor.gyro_columns: needs 3 names, not 2"));
  EXPECT_THAT(error(time + "position_columns: [d]"),
              HasSubstr("sensor.position_columns: needs 2 or 3 names, not 1"));
  EXPECT_THAT(error(time + "quaternion_columns: [a, b, c, d]"),
              HasSubstr("a pose needs position_columns"));
  EXPECT_THAT(error(time + "drive_columns: [1, 2, 3, 4, 5, 6, 7, 8, 9]"),
              HasSubstr("9 names, at most 8 are possible"));
  EXPECT_THAT(error(time + "drive_columns: [d, d]"),
              HasSubstr("sensor.drive_columns: 'd' is there twice"));
}

TEST_F(CsvTableRefusals, RefusesParametersThatOthersLeaveWithoutUse) {
  const auto error = [&](const std::string& rest) {
    return error_of(table("t,d,s\n0,1,2\n0.1,1,2\n",
                          "time_column: t, time_unit: s, drive_columns: [d], " + rest));
  };
  EXPECT_THAT(error("wheel_radius_m: 0.05"),
              HasSubstr("sensor.wheel_radius_m: needs drive_unit: m"));
  EXPECT_THAT(error("drive_counts_per_turn: 4096"),
              HasSubstr("sensor.drive_counts_per_turn: needs drive_unit: count"));
  EXPECT_THAT(error("steer_columns: [s], steer_counts_per_turn: 4096"),
              HasSubstr("sensor.steer_counts_per_turn: needs steer_unit: count"));
}

TEST_F(CsvTableRefusals, TurnsOfJointsAreInRadiansAndSaySo) {
  const auto error = [&](const std::string& rest) {
    return error_of(
        table("t,d,s\n0,1,2\n0.1,1,2\n",
              "time_column: t, time_unit: s, drive_columns: [d], drive_input: angle, " + rest));
  };
  EXPECT_THAT(error("drive_unit: deg, drive_turn: [360]"),
              HasSubstr("sensor.drive_turn: 360 is in the unit of the log: here it is in rad, as "
                        "drive_unit makes the readings: 6.28318530717958"));
  EXPECT_THAT(error("drive_unit: count, drive_counts_per_turn: 4096, drive_turn: [65536]"),
              HasSubstr("65536 is in the unit of the log"));
  EXPECT_THAT(error("steer_columns: [s], steer_unit: turn, steer_turn: [1]"),
              HasSubstr("sensor.steer_turn: 1 is in the unit of the log"));
  EXPECT_THAT(error("drive_unit: deg, drive_turn: [6.2831853]"), IsEmpty());
}

TEST_F(CsvTableRefusals, AColumnIsOneThingHoweverItIsNamed) {
  const auto error = [&](const std::string& rest) {
    return error_of(table("t,d,s\n0,1,2\n0.1,1,2\n", "time_column: t, time_unit: s, " + rest));
  };
  EXPECT_THAT(error("drive_columns: [d, \"2\"]"),
              HasSubstr("sensor.drive_columns: '2' is the column 'd', which is given already"));
  EXPECT_THAT(error("drive_columns: [d], steer_columns: [\"1\"]"),
              HasSubstr("sensor.steer_columns: '1' is the column 't', which is given already"));
}

TEST_F(CsvTableRefusals, AFirstRowOfNumbersIsNoHeader) {
  const std::string rest = "time_column: 1, time_unit: s, drive_columns: [2]";
  EXPECT_THAT(error_of(table("0,1,x\n0.1,2,x\n", rest)),
              HasSubstr("sensor.header: the first line has numbers in all columns that are read: "
                        "header: false reads it as a row"));
  EXPECT_EQ(play_only<EncoderSample>(table("0,1,x\n0.1,2,x\n", rest + ", header: false")).size(),
            2U);
}

TEST_F(CsvTableRefusals, WhatIsNoFileIsRefused) {
  const std::string pipe = (folder_ / "pipe").string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string rest = ", time_column: t, time_unit: s, drive_columns: [d]}";
  EXPECT_THAT(error_of("{type: csv_table, path: " + pipe + rest),
              HasSubstr("pipe  is a pipe, not a file"));
  EXPECT_THAT(error_of("{type: csv_table, path: /dev/zero" + rest),
              HasSubstr("/dev/zero  is a device, not a file"));
}

TEST_F(CsvTableRefusals, SaysWhatIsWrongWithTheTable) {
  const std::string rest = "time_column: t, time_unit: s, drive_columns: [d]";
  EXPECT_THAT(error_of(table("", rest)), HasSubstr("t.csv:1  the file is empty"));
  EXPECT_THAT(error_of(table("t,d\n", rest)), HasSubstr("t.csv  holds no data after its header"));
  EXPECT_THAT(error_of(table("t,d\n", rest + ", skip_lines: 3")),
              HasSubstr("the file ends before the line that is the first of the table"));
  EXPECT_THAT(error_of("{type: csv_table, path: " + folder_.string() + ", " + rest + "}"),
              HasSubstr("is a folder, not a file"));
}

}  // namespace
}  // namespace viwo
