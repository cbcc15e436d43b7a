#include "joint_reading.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace viwo::bag {
namespace {

using What = MissingJoint::What;

/// names.size() for a joint that is not there.
std::size_t place_of(const std::string& joint, const std::vector<std::string>& names) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), joint) - names.begin());
}

/// Takes the values of the joints `wanted`, all of which are there.
template <std::size_t N>
std::optional<MissingJoint> pick(const Joints& joints, const std::vector<std::string>& wanted,
                                 What what, std::array<double, N>& to) {
  const auto& from = what == What::kPosition ? joints.positions : joints.velocities;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const std::size_t place = place_of(wanted[i], joints.names);
    if (place >= from.size()) return MissingJoint{what, wanted[i]};
    to[i] = from[place];
  }
  return std::nullopt;
}

}  // namespace

std::optional<MissingJoint> joint_reading(const Joints& joints, const TopicOptions& options,
                                          log::EncoderReading& out) {
  for (const auto* wanted : {&options.drive_joints, &options.steer_joints}) {
    for (const std::string& joint : *wanted) {
      if (place_of(joint, joints.names) == joints.names.size()) {
        return MissingJoint{What::kJoint, joint};
      }
    }
  }
  out.t_ns = joints.t_ns;
  out.n_drive = static_cast<int>(options.drive_joints.size());
  out.n_steer = static_cast<int>(options.steer_joints.size());
  const What drive = options.drive_is_angle() ? What::kPosition : What::kVelocity;
  auto missing = pick(joints, options.drive_joints, drive, out.drive);
  if (!missing) missing = pick(joints, options.steer_joints, What::kPosition, out.steer_rad);
  return missing;
}

std::string not_finite(const log::EncoderReading& reading, const TopicOptions& options) {
  const auto& drives = options.drive_joints;
  const std::string drive = options.drive_is_angle() ? "position" : "velocity";
  for (std::size_t i = 0; i < drives.size(); ++i) {
    if (std::isfinite(reading.drive[i])) continue;
    return drive + " of joint '" + drives[i] + "' that is not finite";
  }
  for (std::size_t i = 0; i < options.steer_joints.size(); ++i) {
    if (std::isfinite(reading.steer_rad[i])) continue;
    return "position of joint '" + options.steer_joints[i] + "' that is not finite";
  }
  return {};
}

}  // namespace viwo::bag
