#include "joint_reading.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <vector>

namespace viwo::bag {
namespace {

using What = MissingJoint::What;

/// A joint that has not come in so many messages for each joint does not come any more.
constexpr std::size_t kLongestWait = 20;

/// names.size() for a joint that is not there.
std::size_t place_of(const std::string& joint, const std::vector<std::string>& names) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), joint) - names.begin());
}

}  // namespace

JointReadings::JointReadings(const TopicOptions& options)
    : n_drive_(static_cast<int>(options.drive_joints.size())), max_gap_s_(options.max_gap_s) {
  const What drive = options.drive_is_angle() ? What::kPosition : What::kVelocity;
  for (const std::string& joint : options.drive_joints) wanted_.push_back({joint, drive});
  for (const std::string& joint : options.steer_joints) {
    wanted_.push_back({joint, What::kPosition});
  }
}

void JointReadings::restart() {
  for (Wanted& joint : wanted_) joint.is_known = joint.is_new = false;
  parts_ = 0;
}

std::optional<MissingJoint> JointReadings::add(const Joints& joints, log::EncoderReading& out) {
  std::optional<MissingJoint> missing;
  std::size_t found = 0;
  bool is_again = false;
  for (Wanted& joint : wanted_) {
    if (std::abs(seconds_between(joint.t_ns, joints.t_ns)) > max_gap_s_) joint.is_new = false;
    const std::size_t place = place_of(joint.name, joints.names);
    if (place == joints.names.size()) {
      if (!missing || missing->what != What::kJoint) missing = {What::kJoint, joint.name};
      continue;
    }
    const auto& values = joint.value == What::kPosition ? joints.positions : joints.velocities;
    if (place >= values.size()) {
      if (!missing) missing = {joint.value, joint.name};
      continue;
    }
    ++found;
    is_again = is_again || joint.is_new;
    joint.last = values[place];
    joint.t_ns = joints.t_ns;
    joint.is_known = joint.is_new = true;
  }
  const auto is_known = [](const Wanted& joint) { return joint.is_known; };
  const auto is_new = [](const Wanted& joint) { return joint.is_new; };
  if (missing) {
    // Not of one that has other joints, or whose rest nobody has seen so far.
    if (missing->what != What::kJoint || found == 0 ||
        !std::all_of(wanted_.begin(), wanted_.end(), is_known)) {
      return missing;
    }
    if (!std::all_of(wanted_.begin(), wanted_.end(), is_new)) {
      parts_ = is_again ? parts_ + 1 : 0;
      if (parts_ <= kLongestWait * wanted_.size()) {
        missing->what = is_again ? What::kAgain : What::kRest;
      }
      return missing;
    }
  }
  fill(joints.t_ns, out);
  return std::nullopt;
}

void JointReadings::fill(std::int64_t t_ns, log::EncoderReading& out) {
  out.t_ns = t_ns;
  out.n_drive = n_drive_;
  out.n_steer = static_cast<int>(wanted_.size()) - n_drive_;
  const auto n_drive = static_cast<std::size_t>(n_drive_);
  for (std::size_t i = 0; i < wanted_.size(); ++i) {
    (i < n_drive ? out.drive[i] : out.steer_rad[i - n_drive]) = wanted_[i].last;
    wanted_[i].is_new = false;
  }
  parts_ = 0;
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
