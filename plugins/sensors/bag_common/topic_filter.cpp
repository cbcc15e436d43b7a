#include "topic_filter.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::bag {

TopicFilter::TopicFilter(const log::LogLimits& limits, std::string topic)
    : limits_(limits),
      topic_(std::move(topic)),
      gap_reason_(topic_ + ": gap longer than " + log::number_text(limits.max_gap_s) + " s") {}

void TopicFilter::count(const std::string& reason, const Message& at) {
  const auto found = std::find_if(counts_.begin(), counts_.end(), [&](const RejectionCount& known) {
    return known.reason == reason;
  });
  if (found != counts_.end()) {
    ++found->count;
    return;
  }
  counts_.push_back({reason, 1,
                     std::filesystem::path(*at.file).filename().string() + ": message " +
                         std::to_string(at.number)});
}

void TopicFilter::reject(const std::string& reason, const Message& at) {
  ++rejected_;
  count(topic_ + ": " + reason, at);
}

bool TopicFilter::accept(std::int64_t t_ns, const Message& at) {
  if (last_ns_) {
    if (t_ns <= *last_ns_) {
      reject(log::kStampNotAfter, at);
      return false;
    }
    if (seconds_between(*last_ns_, t_ns) > limits_.max_gap_s) count(gap_reason_, at);
  }
  last_ns_ = t_ns;
  ++accepted_;
  return true;
}

void TopicFilter::finish(const std::string& bag) const {
  const std::int64_t total = accepted_ + rejected_;
  if (total == 0) {
    throw InputError(bag + "  topic '" + topic_ + "' has no messages in the time that is read");
  }
  const double fraction = static_cast<double>(rejected_) / static_cast<double>(total);
  if (accepted_ > 0 && fraction <= limits_.max_rejected_fraction) return;
  std::string text = bag + "  " + std::to_string(rejected_) + " of " + std::to_string(total) +
                     " messages rejected, allowed is a fraction of " +
                     log::number_text(limits_.max_rejected_fraction) + ":";
  for (const RejectionCount& known : counts_) {
    if (known.reason == gap_reason_) continue;
    text += (text.back() == ':' ? " " : "; ") + known.reason + " (" + std::to_string(known.count) +
            ", first at " + known.first + ")";
  }
  throw InputError(text);
}

}  // namespace viwo::bag
