#include "params.hpp"

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"

namespace viwo::wpilog {

void Params::check() const {
  log::check_names("module_entries", module_entries, kMaxDrives);
  log::check_names("drive_entries", drive_entries, kMaxDrives);
  log::check_names("steer_entries", steer_entries, kMaxSteers);
  if (!module_entries.empty() && !(drive_entries.empty() && steer_entries.empty())) {
    throw ParamError("module_entries", "modules say drives and steering angles already");
  }
  if (!steer_entries.empty() && drive_entries.empty()) {
    throw ParamError("steer_entries", "steering angles need drive_entries");
  }
  if (has_imu() != !accel_entries.empty()) {
    throw ParamError(has_imu() ? "gyro_entries" : "accel_entries",
                     "an IMU has both, gyro_entries and accel_entries");
  }
  if (!heading_entry.empty() && !yaw_rate_entry.empty()) {
    throw ParamError("yaw_rate_entry", "heading_entry says the heading already");
  }
  check_signs(has_imu());
  log::check_names("gyro_entries", gyro_entries, 3, 3);
  log::check_names("accel_entries", accel_entries, 3, 3);
  log::check_names("pose_entries", pose_entries, 1, 3);
  if (has_wheels() || has_imu() || has_poses() || has_heading()) return;
  throw ParamError("path",
                   "nothing to read: give module_entries, or drive_entries, or pose_entries, or "
                   "heading_entry, or yaw_rate_entry, or gyro_entries and accel_entries");
}

double Params::heading_factor() const {
  switch (heading_unit) {
    case HeadingUnit::kAsYaw:
      return yaw_factor();
    case HeadingUnit::kRadian:
      return 1.;
    case HeadingUnit::kDegree:
      return log::radians_in(log::AngleUnit::kDegree);
    case HeadingUnit::kTurn:
      return log::radians_in(log::AngleUnit::kTurn);
  }
  return 1.;
}

std::vector<std::string> Params::names() const {
  std::vector<std::string> out{cycle_entry, heading_entry, yaw_rate_entry};
  for (const auto* list : {&module_entries, &drive_entries, &steer_entries, &gyro_entries,
                           &accel_entries, &pose_entries}) {
    out.insert(out.end(), list->begin(), list->end());
  }
  return out;
}

}  // namespace viwo::wpilog
