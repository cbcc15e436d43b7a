// What a calibration.yaml says of a robot, for the writers of formats.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/rig.hpp"
#include "viwo/calibration_file/calibration_file.hpp"

namespace viwo::exports {

enum class Base {
  kUnknown,
  kSteered,       ///< r_1, x_1, y_1, delta_o1, ...: every wheel steers
  kDifferential,  ///< r_left, r_right, baseline
  kSkidSteer,     ///< r_left, r_right, y_icr_left, y_icr_right, x_icr
  kAckermann,     ///< r_rear_left, r_rear_right, wheel_base, track
  kMecanum,       ///< r_1, gamma_1, k_1, ...
};

struct Wheel {
  std::string name;  ///< "1", "left", "rear_left"
  double radius_m = 0.;
  double x_m = 0., y_m = 0.;  ///< in O; of a mecanum wheel not known
  bool steers = false;
  double zero_rad = 0.;             ///< what the steering encoder reads straight ahead
  bool reversed = false;            ///< its drive turns backwards where the log's goes up
  double tan_gamma = 0., k_m = 0.;  ///< of a mecanum wheel: row [1, tan_gamma, k]
};

struct Mount {
  Eigen::Matrix3d R_ItoO = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinO = Eigen::Vector3d::Zero();
};

struct Robot {
  const CalibrationFile* file = nullptr;
  Base base = Base::kUnknown;
  std::vector<Wheel> wheels;
  double track_m = 0.;       ///< between the sides; of skid steering that of the ICRs
  double wheel_base_m = 0.;  ///< of Ackermann steering
  std::optional<Mount> mount;
  std::vector<CameraView> cameras;
  std::vector<std::string> beside;  ///< what is none of the above

  double mean_radius_m() const;
  /// Names of the wheels whose drives turn backwards, "3, 4"; "" for none.
  std::string reversed_wheels() const;
};

/// InputError for cameras of which parameters are missing.
Robot robot_of(const CalibrationFile& file);

/// Names of entries, "r_1, x_1"; "" for none.
std::string names_of(const CalibrationFile::Entries& entries);

}  // namespace viwo::exports
