#include "viwo/log/stamp_filter.hpp"

#include <algorithm>

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::log {

StampFilter::StampFilter(const LogLimits& limits)
    : limits_(limits), gap_reason_("gap longer than " + number_text(limits.max_gap_s) + " s") {}

void StampFilter::count(const std::string& reason, const TextReader& at) {
  const auto found = std::find_if(counts_.begin(), counts_.end(), [&](const RejectionCount& known) {
    return known.reason == reason;
  });
  if (found == counts_.end()) {
    counts_.push_back({reason, 1, at.where()});
  } else {
    ++found->count;
  }
}

void StampFilter::reject(const std::string& reason, const TextReader& at) {
  ++rejected_;
  count(reason, at);
}

bool StampFilter::accept(std::int64_t t_ns, const TextReader& at) {
  if (last_ns_) {
    if (t_ns <= *last_ns_) {
      reject(kStampNotAfter, at);
      return false;
    }
    if (seconds_between(*last_ns_, t_ns) > limits_.max_gap_s) count(gap_reason_, at);
  }
  last_ns_ = t_ns;
  ++accepted_;
  return true;
}

bool StampFilter::accept_or_same(std::int64_t t_ns, const TextReader& at) {
  if (last_ns_ != t_ns) return accept(t_ns, at);
  ++accepted_;
  return true;
}

void StampFilter::finish(const TextReader& at) {
  if (at.last_left_out()) reject(kLastLineCutShort, at);
  const std::int64_t total = accepted_ + rejected_;
  if (total == 0) throw InputError(at.file().string() + "  holds no data after its header");
  const double fraction = static_cast<double>(rejected_) / static_cast<double>(total);
  if (accepted_ > 0 && fraction <= limits_.max_rejected_fraction) return;
  std::string text = at.file().string() + "  " + std::to_string(rejected_) + " of " +
                     std::to_string(total) + " data rejected, allowed is a fraction of " +
                     number_text(limits_.max_rejected_fraction) + ":";
  for (const RejectionCount& known : counts_) {
    if (known.reason == gap_reason_) continue;
    text += (text.back() == ':' ? " " : "; ") + known.reason + " (" + std::to_string(known.count) +
            ", first at " + known.first + ")";
  }
  throw InputError(text);
}

}  // namespace viwo::log
