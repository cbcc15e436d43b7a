// Parameters of wpilog: which entries are what, in which unit.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "viwo/api/params.hpp"
#include "viwo/log/channel_units.hpp"
#include "viwo/log/joints.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo::wpilog {

struct WheelParams : log::EncoderUnitParams, log::StrideParams, log::JointParams {
  std::vector<std::string> module_entries;
  std::vector<std::string> drive_entries;
  std::vector<std::string> steer_entries;
  enum class DriveInput { kRate, kAngle };
  DriveInput drive_input = DriveInput::kRate;
  std::string cycle_entry;
  double cycle_spread_s = 0.002;

  WheelParams() { drive_unit = DriveUnit::kMetre; }

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(module_entries),
      {.help = "swerve modules in the order of the wheels: one entry of all (SwerveModuleState[], "
               "SwerveModulePosition[], numbers angle, speed, angle, ...), or one for each"});
    b(VIWO_PARAM(drive_entries),
      {.help =
           "in place of modules: numbers, or ENTRY/PATH within one, in the order of the wheels"});
    b(VIWO_PARAM(steer_entries), {.help = "likewise the steering angles, Rotation2d included"});
    b(VIWO_PARAM(drive_input), {{"rate", DriveInput::kRate}, {"angle", DriveInput::kAngle}},
      {.help = "drives are rates, or multi-turn angles (metres: a way rolled); structs say "
               "themselves what they are"});
    b(VIWO_PARAM(cycle_entry),
      {.help = "an entry written in each cycle of the robot's program, changed or not: there are "
               "the readings of the wheels; empty: where one of their entries is written"});
    b(VIWO_PARAM(cycle_spread_s), {.unit = "s",
                                   .min = 0.,
                                   .max = 1.,
                                   .help = "what is written within this time is of one cycle"});
    EncoderUnitParams::bind(b);
    StrideParams::bind(b);
    JointParams::bind(b);
  }
};

struct Params : WheelParams,
                log::ImuUnitParams,
                log::PoseUnitParams,
                log::PieceParams,
                log::LimitParams {
  std::filesystem::path path;
  std::vector<std::string> gyro_entries;
  std::vector<std::string> accel_entries;
  std::vector<std::string> pose_entries;
  std::string heading_entry;
  enum class HeadingUnit { kAsYaw, kRadian, kDegree, kTurn };
  HeadingUnit heading_unit = HeadingUnit::kAsYaw;
  std::string yaw_rate_entry;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path), {.required = true, .help = "the log, plain or gzipped"});
    WheelParams::bind(b);
    b(VIWO_PARAM(gyro_entries), {.help = "angular rate of I in I: x, y, z, or ENTRY/PATH"});
    b(VIWO_PARAM(accel_entries),
      {.help = "specific force of I in I, +g along z at rest: x, y, z, or ENTRY/PATH"});
    ImuUnitParams::bind(b);
    b(VIWO_PARAM(pose_entries),
      {.help =
           "poses of the robot on the field: one entry (Pose2d, Pose3d, numbers x, y, yaw or x, "
           "y, z, qw, qx, qy, qz), or three of numbers x, y, yaw"});
    b(VIWO_PARAM(heading_entry),
      {.help = "how the robot is turned by its gyro: a number, Rotation2d or Rotation3d"});
    b(VIWO_PARAM(heading_unit),
      {{"yaw_unit", HeadingUnit::kAsYaw},
       {"rad", HeadingUnit::kRadian},
       {"deg", HeadingUnit::kDegree},
       {"turn", HeadingUnit::kTurn}},
      {.help =
           "of a heading that is a number or a Rotation2d; yaw_unit: that of poses of numbers"});
    b(VIWO_PARAM(yaw_rate_entry),
      {.help =
           "in place of a heading: the rate of a gyro of the yaw alone (gyro_unit, gyro_scale)"});
    PoseUnitParams::bind(b);
    log::PieceParams::bind(b);
    log::LimitParams::bind(b);
  }

  bool has_wheels() const { return !module_entries.empty() || !drive_entries.empty(); }
  bool has_imu() const { return !gyro_entries.empty(); }
  bool has_poses() const { return !pose_entries.empty(); }
  bool has_heading() const { return !heading_entry.empty() || !yaw_rate_entry.empty(); }
  /// Radians in what a heading is in.
  double heading_factor() const;

  /// ParamError for parameters that contradict each other.
  void check() const;
  /// All names of entries.
  std::vector<std::string> names() const;
};

}  // namespace viwo::wpilog
