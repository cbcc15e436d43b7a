// Stamps that jump ahead: of a clock that was set, or broken.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace viwo {

/// Says of increasing stamps which are not to be believed: one far ahead of the last, until another
/// one is behind it. Taken as it comes, a single broken stamp would make all that follow late.
class StampJump {
 public:
  /// Far is more than `far_s`, and more than `times` the longest spacing so far: sources whose data
  /// are further apart have shown it before.
  explicit StampJump(double far_s = 10., std::uint64_t times = 10)
      : far_ns_(static_cast<std::uint64_t>(1e9 * far_s)), times_(times) {}

  /// `t_ns`: after the last stamp that was believed.
  bool is_believed(std::int64_t t_ns) {
    const bool is_confirmed = suspect_ns_ && t_ns > *suspect_ns_;
    const std::uint64_t ahead_ns = distance_ns(is_confirmed ? *suspect_ns_ : last_ns_, t_ns);
    if (is_first_ || is_confirmed || ahead_ns <= std::max(far_ns_, times_ * longest_ns_)) {
      if (!is_first_) longest_ns_ = std::clamp(ahead_ns, longest_ns_, kLongestNs);
      is_first_ = false;
      suspect_ns_.reset();
      last_ns_ = t_ns;
      return true;
    }
    suspect_ns_ = t_ns;
    return false;
  }

 private:
  static std::uint64_t distance_ns(std::int64_t from_ns, std::int64_t to_ns) {
    return static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(from_ns);
  }

  static constexpr std::uint64_t kLongestNs = 1'000'000'000'000'000'000;

  std::uint64_t far_ns_, times_;
  bool is_first_ = true;
  std::int64_t last_ns_ = 0;
  std::uint64_t longest_ns_ = 0;  ///< between stamps that were believed
  std::optional<std::int64_t> suspect_ns_;
};

}  // namespace viwo
