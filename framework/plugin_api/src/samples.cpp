#include "viwo/api/rejections.hpp"
#include "viwo/api/sample.hpp"

namespace viwo {

SampleBuffer::~SampleBuffer() = default;

std::string stamp_text(std::int64_t t_ns) { return "stamp " + std::to_string(t_ns) + " ns"; }

RejectionCount* Rejections::find(std::string_view reason) {
  for (RejectionCount& known : counts_) {
    if (known.reason == reason) return &known;
  }
  return nullptr;
}

}  // namespace viwo
