#include "viwo/api/stamp_order.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"

namespace viwo {
namespace {

/// Shortest text that reads back to the same number.
std::string number_text(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

}  // namespace

std::string gap_reason(double max_gap_s) {
  return "gap longer than " + number_text(max_gap_s) + " s";
}

StampOrder::StampOrder(const LogLimits& limits, std::string prefix)
    : limits_(limits),
      prefix_(std::move(prefix)),
      gap_reason_(prefix_ + gap_reason(limits.max_gap_s)),
      has_rate_(std::isfinite(limits.max_gap_s)) {}

bool StampOrder::is_behind_gap(std::int64_t t_ns) const {
  return last_ns_ && seconds_between(*last_ns_, t_ns) > limits_.max_gap_s;
}

void StampOrder::require_enough(const std::string& source, const char* data) const {
  const std::int64_t total = accepted_ + rejected_;
  const double fraction = static_cast<double>(rejected_) / static_cast<double>(total);
  if (accepted_ > 0 && fraction <= limits_.max_rejected_fraction) return;
  // Of few data that are far apart the second one cannot have been expected.
  const bool is_far_only =
      rejected_ == 1 && std::any_of(counts().begin(), counts().end(), [this](const auto& known) {
        return known.reason == prefix_ + kStampFarAhead;
      });
  if (is_far_only && accepted_ > 2 && limits_.max_rejected_fraction > 0.) return;
  std::string text = source + "  " + std::to_string(rejected_) + " of " + std::to_string(total) +
                     " " + data + " rejected, allowed is a fraction of " +
                     number_text(limits_.max_rejected_fraction) + ":";
  for (const RejectionCount& known : counts()) {
    if (known.reason == gap_reason_) continue;
    text += (text.back() == ':' ? " " : "; ") + known.reason + " (" + std::to_string(known.count) +
            ", first at " + known.first + ")";
  }
  throw InputError(text);
}

}  // namespace viwo
