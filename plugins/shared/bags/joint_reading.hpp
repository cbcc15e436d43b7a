// From a message with joints of a robot to a reading of its wheels.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "messages.hpp"
#include "topic_options.hpp"
#include "viwo/log/cells.hpp"

namespace viwo::bag {

/// What a message does not have.
struct MissingJoint {
  enum class What : std::uint8_t { kJoint, kPosition, kVelocity };
  What what;
  std::string joint;  ///< the first one
};

/// Fills `out` with the joints of `options`, in their order; a joint that is not there is found
/// before values that are not.
std::optional<MissingJoint> joint_reading(const Joints& joints, const TopicOptions& options,
                                          log::EncoderReading& out);

/// "velocity of joint 'left' that is not finite": the first of a reading that has one.
std::string not_finite(const log::EncoderReading& reading, const TopicOptions& options);

}  // namespace viwo::bag
