// Units of what a log that is of no fixed format says: parameters of the sensors that read one.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/params.hpp"

namespace viwo::log {

enum class AngleUnit : std::uint8_t { kRadian, kDegree, kTurn };

/// Radians in one of them.
double radians_in(AngleUnit unit);

struct EncoderUnitParams {
  enum class DriveUnit : std::uint8_t { kRadian, kDegree, kTurn, kTurnPerMinute, kMetre, kCount };
  DriveUnit drive_unit = DriveUnit::kRadian;
  double wheel_radius_m = 0.;
  double drive_counts_per_turn = 0.;
  enum class SteerUnit : std::uint8_t { kRadian, kDegree, kTurn, kCount };
  SteerUnit steer_unit = SteerUnit::kRadian;
  double steer_counts_per_turn = 0.;

  void bind(ParamBinder& b);

  /// What makes rad/s of a rate, or radians of an angle. ParamError for a unit that the reading
  /// cannot have, for metres without a radius, and for counts without those of a turn.
  double drive_factor(bool is_angle) const;
  double steer_factor() const;
  /// ParamError for turns of joints (JointParams) that are in the unit of the log: they see
  /// radians.
  void check_turns(bool is_angle, const std::vector<double>& drive_turn,
                   const std::vector<double>& steer_turn) const;
};

struct ImuUnitParams {
  AngleUnit gyro_unit = AngleUnit::kRadian;
  double gyro_scale = 1.;
  Eigen::Vector3d gyro_sign = Eigen::Vector3d::Ones();
  enum class AccelUnit : std::uint8_t { kMetrePerS2, kGravity };
  AccelUnit accel_unit = AccelUnit::kMetrePerS2;
  double accel_scale = 1.;
  Eigen::Vector3d accel_sign = Eigen::Vector3d::Ones();

  void bind(ParamBinder& b);

  /// Of a gyro of one axis.
  double gyro_factor() const { return gyro_scale * radians_in(gyro_unit); }
  /// ParamError for signs that are none, and where there is no IMU: a heading has its own.
  void check_signs(bool has_imu) const;
  /// What makes rad/s of the readings of the axes, and m/s^2.
  Eigen::Vector3d gyro_factors() const;
  Eigen::Vector3d accel_factors() const;
};

struct PoseUnitParams {
  enum class LengthUnit : std::uint8_t { kMetre, kCentimetre, kMillimetre };
  LengthUnit position_unit = LengthUnit::kMetre;
  AngleUnit yaw_unit = AngleUnit::kRadian;
  double heading_scale = 1.;

  void bind(ParamBinder& b);

  double position_factor() const;
  double yaw_factor() const { return radians_in(yaw_unit); }
};

}  // namespace viwo::log
