// Parameters of csv_table: which column is what, in which unit.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/channel_units.hpp"
#include "viwo/log/joints.hpp"
#include "viwo/log/sensor_params.hpp"
#include "viwo/log/table_reader.hpp"

namespace viwo::csv_table {

struct LayoutParams {
  enum class Separator : char {
    kAuto = 0,
    kComma = ',',
    kSemicolon = ';',
    kTab = '\t',
    kBlank = ' '
  };
  Separator separator = Separator::kAuto;
  bool header = true;
  int skip_lines = 0;
  bool decimal_comma = false;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(separator),
      {{"auto", Separator::kAuto},
       {"comma", Separator::kComma},
       {"semicolon", Separator::kSemicolon},
       {"tab", Separator::kTab},
       {"blank", Separator::kBlank}},
      {.help = "auto: of semicolon, comma, tab, blanks the first that the first line has"});
    b(VIWO_PARAM(header), {.help = "the first line names the columns"});
    b(VIWO_PARAM(skip_lines),
      {.min = 0., .max = 1e6, .help = "lines before the first of the table"});
    b(VIWO_PARAM(decimal_comma),
      {.help = "numbers are written as 1,5; what separates them is then no comma"});
  }
  /// ParamError where a comma would be both.
  log::TableLayout layout() const {
    if (decimal_comma && separator == Separator::kComma) {
      throw ParamError("decimal_comma", "the separator is a comma already");
    }
    return {static_cast<char>(separator), skip_lines, header, decimal_comma};
  }
};

struct TimeParams {
  std::string time_column;
  log::TimeUnit time_unit = log::TimeUnit::kSecond;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(time_column), {.required = true, .help = "name or number (from 1) of the column"});
    b(VIWO_PARAM(time_unit),
      {{"s", log::TimeUnit::kSecond},
       {"ms", log::TimeUnit::kMillisecond},
       {"us", log::TimeUnit::kMicrosecond},
       {"ns", log::TimeUnit::kNanosecond}},
      {.required = true, .help = "of the column of the times"});
  }
};

struct WheelParams : log::EncoderUnitParams, log::StrideParams, log::JointParams {
  std::vector<std::string> drive_columns;
  std::vector<std::string> steer_columns;
  enum class Drive { kRate, kAngle, kIncrement };
  Drive drive_input = Drive::kRate;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(drive_columns), {.help = "drives, in the order of the wheels"});
    b(VIWO_PARAM(steer_columns), {.help = "steering angles, in the order of the wheels"});
    b(VIWO_PARAM(drive_input),
      {{"rate", Drive::kRate}, {"angle", Drive::kAngle}, {"increment", Drive::kIncrement}},
      {.help = "drives are rates, or multi-turn angles (metres: a way rolled), or what an angle "
               "grew by since the row before"});
    EncoderUnitParams::bind(b);
    StrideParams::bind(b);
    JointParams::bind(b);
  }
  /// As what it is read; increments are added up.
  bool is_angle() const { return drive_input != Drive::kRate; }
};

struct Params : LayoutParams,
                TimeParams,
                WheelParams,
                log::ImuUnitParams,
                log::PoseUnitParams,
                log::PieceParams,
                log::LimitParams {
  std::filesystem::path path;
  std::vector<std::string> gyro_columns;
  std::vector<std::string> accel_columns;
  std::vector<std::string> position_columns;
  std::vector<std::string> quaternion_columns;
  std::string yaw_column;
  std::string yaw_rate_column;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path), {.required = true, .help = "the table, plain or gzipped"});
    LayoutParams::bind(b);
    TimeParams::bind(b);
    WheelParams::bind(b);
    b(VIWO_PARAM(gyro_columns), {.help = "angular rate of I in I: x, y, z"});
    b(VIWO_PARAM(accel_columns), {.help = "specific force of I in I: x, y, z; +g along z at rest"});
    ImuUnitParams::bind(b);
    b(VIWO_PARAM(position_columns),
      {.help = "position of the body in the world: x, y, z, or x, y"});
    b(VIWO_PARAM(quaternion_columns),
      {.help = "Hamilton quaternion of the body in the world: x, y, z, w"});
    b(VIWO_PARAM(yaw_column),
      {.help = "in place of a quaternion; alone it is the heading by a gyro"});
    b(VIWO_PARAM(yaw_rate_column),
      {.help =
           "rate of a gyro of the yaw alone (gyro_unit, gyro_scale), of which a heading is made"});
    PoseUnitParams::bind(b);
    log::PieceParams::bind(b);
    log::LimitParams::bind(b);
  }

  bool has_wheels() const { return !drive_columns.empty(); }
  bool has_imu() const { return !gyro_columns.empty(); }
  bool has_poses() const { return !position_columns.empty(); }
  bool has_yaw_as_heading() const { return !has_poses() && !yaw_column.empty(); }
  bool has_heading() const { return has_yaw_as_heading() || !yaw_rate_column.empty(); }

  /// ParamError for parameters that contradict each other.
  void check() const {
    log::check_names("drive_columns", drive_columns, kMaxDrives);
    log::check_names("steer_columns", steer_columns, kMaxSteers);
    check_stride(is_angle(), "angle");
    if (!steer_columns.empty() && !has_wheels()) {
      throw ParamError("steer_columns", "steering angles need drive_columns");
    }
    if (has_imu() != !accel_columns.empty()) {
      throw ParamError(has_imu() ? "gyro_columns" : "accel_columns",
                       "an IMU has both, gyro_columns and accel_columns");
    }
    check_signs(has_imu());
    log::check_names("gyro_columns", gyro_columns, 3, 3);
    log::check_names("accel_columns", accel_columns, 3, 3);
    log::check_names("position_columns", position_columns, 2, 3);
    log::check_names("quaternion_columns", quaternion_columns, 4, 4);
    if (!quaternion_columns.empty() && !yaw_column.empty()) {
      throw ParamError("yaw_column", "quaternion_columns say the yaw already");
    }
    if (has_yaw_as_heading() && !yaw_rate_column.empty()) {
      throw ParamError("yaw_rate_column", "yaw_column says the heading already");
    }
    if (!has_poses() && !quaternion_columns.empty()) {
      throw ParamError("quaternion_columns", "a pose needs position_columns");
    }
    if (!has_wheels() && !has_imu() && !has_poses() && !has_heading()) {
      throw ParamError("path",
                       "nothing to read: give drive_columns, or gyro_columns and accel_columns, or "
                       "position_columns, or yaw_column, or yaw_rate_column");
    }
  }
};

}  // namespace viwo::csv_table
