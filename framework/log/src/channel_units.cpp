#include "viwo/log/channel_units.hpp"

#include <cmath>
#include <initializer_list>
#include <string>
#include <utility>

#include "viwo/api/status.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::log {
namespace {

constexpr double kStandardGravity_m_per_s2 = 9.80665;

constexpr std::initializer_list<std::pair<const char*, AngleUnit>> kAngleUnits = {
    {"rad", AngleUnit::kRadian}, {"deg", AngleUnit::kDegree}, {"turn", AngleUnit::kTurn}};

double radians_in_count(const char* key, double counts_per_turn) {
  if (counts_per_turn > 0.) return radians_in(AngleUnit::kTurn) / counts_per_turn;
  throw ParamError(key, std::string("counts need ") + key);
}

/// ParamError for numbers that are whole turns in the unit of the log, and none in radians.
void check_in_radians(const char* key, const char* unit_key, const std::vector<double>& turns,
                      double factor) {
  const auto is_whole_turn = [](double rad) {
    return std::abs(std::remainder(rad, radians_in(AngleUnit::kTurn))) < 1e-3;
  };
  for (const double turn : turns) {
    if (turn == 0. || is_whole_turn(turn) || !is_whole_turn(factor * turn)) continue;
    throw ParamError(key, number_text(turn) + " is in the unit of the log: here it is in rad, as " +
                              unit_key + " makes the readings: " + number_text(factor * turn));
  }
}

void check_sign(const char* key, const Eigen::Vector3d& sign, bool has_imu) {
  if (!has_imu && sign != Eigen::Vector3d::Ones()) {
    throw ParamError(key, "is of an IMU, and none is read: of a heading it is heading_scale");
  }
  if ((sign.array().abs() == 1.).all()) return;
  throw ParamError(key, "a sign is 1 or -1: a scale is gyro_scale, accel_scale");
}

}  // namespace

double radians_in(AngleUnit unit) {
  switch (unit) {
    case AngleUnit::kRadian:
      return 1.;
    case AngleUnit::kDegree:
      return M_PI / 180.;
    case AngleUnit::kTurn:
      return 2. * M_PI;
  }
  return 1.;
}

void EncoderUnitParams::bind(ParamBinder& b) {
  b(VIWO_PARAM(drive_unit),
    {{"rad", DriveUnit::kRadian},
     {"deg", DriveUnit::kDegree},
     {"turn", DriveUnit::kTurn},
     {"rpm", DriveUnit::kTurnPerMinute},
     {"m", DriveUnit::kMetre},
     {"count", DriveUnit::kCount}},
    {.help = "of drive angles; rates are in this per second (but rpm: turns per minute). Metres at "
             "the rim need wheel_radius_m, counts drive_counts_per_turn"});
  b(VIWO_PARAM(wheel_radius_m),
    {.unit = "m",
     .min = 0.,
     .help = "with drive_unit: m, the radius that whoever wrote the log made metres with: not what "
             "the model believes"});
  b(VIWO_PARAM(drive_counts_per_turn),
    {.min = 0., .help = "with drive_unit: count, those of a turn of the wheel"});
  b(VIWO_PARAM(steer_unit),
    {{"rad", SteerUnit::kRadian},
     {"deg", SteerUnit::kDegree},
     {"turn", SteerUnit::kTurn},
     {"count", SteerUnit::kCount}},
    {.help = "of steering angles"});
  b(VIWO_PARAM(steer_counts_per_turn),
    {.min = 0., .help = "with steer_unit: count, those of a turn of the steering"});
}

double EncoderUnitParams::drive_factor(bool is_angle) const {
  if (wheel_radius_m > 0. && drive_unit != DriveUnit::kMetre) {
    throw ParamError("wheel_radius_m", "needs drive_unit: m");
  }
  if (drive_counts_per_turn > 0. && drive_unit != DriveUnit::kCount) {
    throw ParamError("drive_counts_per_turn", "needs drive_unit: count");
  }
  switch (drive_unit) {
    case DriveUnit::kRadian:
      return 1.;
    case DriveUnit::kDegree:
      return radians_in(AngleUnit::kDegree);
    case DriveUnit::kTurn:
      return radians_in(AngleUnit::kTurn);
    case DriveUnit::kTurnPerMinute:
      if (!is_angle) return radians_in(AngleUnit::kTurn) / 60.;
      throw ParamError("drive_unit", "rpm is no unit of angles: rad, deg, turn, m or count");
    case DriveUnit::kMetre:
      if (wheel_radius_m > 0.) return 1. / wheel_radius_m;
      throw ParamError("wheel_radius_m",
                       "drive_unit: m needs wheel_radius_m, the radius that metres were made with");
    case DriveUnit::kCount:
      return radians_in_count("drive_counts_per_turn", drive_counts_per_turn);
  }
  return 1.;
}

double EncoderUnitParams::steer_factor() const {
  if (steer_counts_per_turn > 0. && steer_unit != SteerUnit::kCount) {
    throw ParamError("steer_counts_per_turn", "needs steer_unit: count");
  }
  switch (steer_unit) {
    case SteerUnit::kRadian:
      return 1.;
    case SteerUnit::kDegree:
      return radians_in(AngleUnit::kDegree);
    case SteerUnit::kTurn:
      return radians_in(AngleUnit::kTurn);
    case SteerUnit::kCount:
      return radians_in_count("steer_counts_per_turn", steer_counts_per_turn);
  }
  return 1.;
}

void EncoderUnitParams::check_turns(bool is_angle, const std::vector<double>& drive_turn,
                                    const std::vector<double>& steer_turn) const {
  check_in_radians("drive_turn", "drive_unit", drive_turn, drive_factor(is_angle));
  check_in_radians("steer_turn", "steer_unit", steer_turn, steer_factor());
}

void ImuUnitParams::bind(ParamBinder& b) {
  b(VIWO_PARAM(gyro_unit), kAngleUnits, {.help = "of angular rates, per second"});
  b(VIWO_PARAM(gyro_scale), {.above = 0., .help = "makes gyro_unit of a reading"});
  b(VIWO_PARAM(gyro_sign),
    {.min = -1.,
     .max = 1.,
     .help = "x, y, z: -1 for an axis that counts the other way than I's, else 1"});
  b(VIWO_PARAM(accel_unit), {{"m_per_s2", AccelUnit::kMetrePerS2}, {"g", AccelUnit::kGravity}},
    {.help = "of specific forces; g is 9.80665 m/s^2"});
  b(VIWO_PARAM(accel_scale), {.above = 0., .help = "makes accel_unit of a reading"});
  b(VIWO_PARAM(accel_sign), {.min = -1., .max = 1., .help = "likewise"});
}

void ImuUnitParams::check_signs(bool has_imu) const {
  check_sign("gyro_sign", gyro_sign, has_imu);
  check_sign("accel_sign", accel_sign, has_imu);
}

Eigen::Vector3d ImuUnitParams::gyro_factors() const { return gyro_factor() * gyro_sign; }

Eigen::Vector3d ImuUnitParams::accel_factors() const {
  const double unit = accel_unit == AccelUnit::kGravity ? kStandardGravity_m_per_s2 : 1.;
  return accel_scale * unit * accel_sign;
}

void PoseUnitParams::bind(ParamBinder& b) {
  b(VIWO_PARAM(position_unit),
    {{"m", LengthUnit::kMetre}, {"cm", LengthUnit::kCentimetre}, {"mm", LengthUnit::kMillimetre}},
    {.help = "of positions"});
  b(VIWO_PARAM(yaw_unit), kAngleUnits, {.help = "of a yaw"});
  b(VIWO_PARAM(heading_scale), {.help = "of the heading by a gyro: -1 where it counts clockwise"});
}

double PoseUnitParams::position_factor() const {
  switch (position_unit) {
    case LengthUnit::kMetre:
      return 1.;
    case LengthUnit::kCentimetre:
      return 0.01;
    case LengthUnit::kMillimetre:
      return 0.001;
  }
  return 1.;
}

}  // namespace viwo::log
