#include "viwo/filter/imu_buffer.hpp"

#include <algorithm>

#include "viwo/filter/propagation.hpp"

namespace viwo {

void ImuBuffer::add(const ImuSample& sample, Rejections& rejections) {
  if (const char* fault = sample.fault()) {
    rejections.add(std::string("imu: ") + fault, sample.t_ns);
    return;
  }
  if (!empty()) {
    if (sample.t_ns <= newest_ns()) {
      rejections.add("imu: stamp not after the last", sample.t_ns);
      return;
    }
    if (seconds_between(newest_ns(), sample.t_ns) > max_gap_s_) {
      rejections.add("imu: gap bridged", sample.t_ns);
    }
  }
  buffer_.push(sample);
}

std::span<const ImuSample> ImuBuffer::cut(std::int64_t begin_ns, std::int64_t end_ns) {
  cut_.clear();
  const auto all = samples();
  const auto after = [](std::int64_t t_ns, const ImuSample& sample) { return t_ns < sample.t_ns; };
  const auto first = std::upper_bound(all.begin(), all.end(), begin_ns, after);
  if (first == all.begin() || first == all.end() || std::prev(first)->t_ns == begin_ns) {
    cut_.push_back(first == all.begin() ? *first : *std::prev(first));
  } else {
    cut_.push_back(interpolate(*std::prev(first), *first, begin_ns));
  }
  cut_.back().t_ns = begin_ns;
  for (auto sample = first; sample != all.end(); ++sample) {
    if (sample->t_ns < end_ns) {
      cut_.push_back(*sample);
      continue;
    }
    const ImuSample& before = sample == all.begin() ? cut_.back() : *std::prev(sample);
    cut_.push_back(sample->t_ns == end_ns ? *sample : interpolate(before, *sample, end_ns));
    break;
  }
  return cut_;
}

void ImuBuffer::forget_before(std::int64_t t_ns) {
  // The last reading at or before it is needed.
  const auto all = samples();
  const auto after = [](std::int64_t t, const ImuSample& sample) { return t < sample.t_ns; };
  const auto first = std::upper_bound(all.begin(), all.end(), t_ns, after) - all.begin();
  if (first > 1) buffer_.drop_front(static_cast<std::size_t>(first - 1));
}

void ImuBuffer::forget_before_start() {
  // A base that waits for hours before it moves; moving few samples is not worth while.
  constexpr std::int64_t kMaxStartWindowNs = 60'000'000'000;
  if (empty() || newest_ns() - samples().front().t_ns < 2 * kMaxStartWindowNs) return;
  forget_before(newest_ns() - kMaxStartWindowNs);
}

}  // namespace viwo
