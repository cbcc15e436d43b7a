#include "viwo/api/rejections.hpp"
#include "viwo/api/sample.hpp"

namespace viwo {

SampleBuffer::~SampleBuffer() = default;

std::string stamp_text(std::int64_t t_ns) { return "stamp " + std::to_string(t_ns) + " ns"; }

RejectionCount* Rejections::find(std::string_view reason) {
  reason = reason.substr(0, kLongestReason);
  for (RejectionCount& known : counts_) {
    if (known.reason == reason) return &known;
  }
  if (counts_.size() < kMostReasons) return nullptr;
  constexpr std::string_view kOthers = "for other reasons";
  if (reason != kOthers) {  // it may be there already, of a part of a run
    if (RejectionCount* const others = find(kOthers)) return others;
  }
  counts_.push_back({std::string(kOthers), 0, "not listed"});
  return &counts_.back();
}

}  // namespace viwo
