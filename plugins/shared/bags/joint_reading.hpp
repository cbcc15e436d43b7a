// From messages with joints of a robot to readings of its wheels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "messages.hpp"
#include "topic_options.hpp"
#include "viwo/log/cells.hpp"

namespace viwo::bag {

/// What a message does not have. kRest: it has some of the joints, and the others come in messages
/// of their own. kAgain: likewise, and with it joints came anew before the others had come.
struct MissingJoint {
  enum class What : std::uint8_t { kJoint, kPosition, kVelocity, kRest, kAgain };
  What what;
  std::string joint;  ///< the first one
};

/// Of what kAgain leaves out.
inline constexpr const char* kJointsCameAgain = "joints that came anew before the others had come";

/// Joints may come all in one message, or in several: one for each module, drives and steering
/// apart. Then a reading is there when each has come since the last one, with the values that came
/// last, none of them older than a gap, and with the stamp of the message that completes it.
class JointReadings {
 public:
  explicit JointReadings(const TopicOptions& options);

  /// Fills `out` with the joints of the options, in their order; a joint that is not there is found
  /// before values that are not.
  std::optional<MissingJoint> add(const Joints& joints, log::EncoderReading& out);
  /// As if none had come.
  void restart();

 private:
  struct Wanted {
    std::string name;
    MissingJoint::What value;  ///< kPosition or kVelocity
    double last = 0.;
    std::int64_t t_ns = 0;
    bool is_known = false, is_new = false;
  };

  void fill(std::int64_t t_ns, log::EncoderReading& out);

  std::vector<Wanted> wanted_;  ///< drives, then steerings
  int n_drive_;
  double max_gap_s_;
  std::size_t parts_ =
      0;  ///< messages since a joint came for the first time since the last reading
};

/// "velocity of joint 'left' that is not finite": the first of a reading that has one.
std::string not_finite(const log::EncoderReading& reading, const TopicOptions& options);

}  // namespace viwo::bag
