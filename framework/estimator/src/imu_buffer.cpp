#include "viwo/estimator/imu_buffer.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "viwo/estimator/start_search.hpp"
#include "viwo/filter/propagation.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

constexpr const char* kSpike = "imu: spike, gone with the next reading";

bool is_within(const std::array<double, 3>& values, double most) {
  return std::all_of(values.begin(), values.end(),
                     [most](double value) { return std::abs(value) <= most; });
}

}  // namespace

double ImuBuffer::gap_s(const ImuSample& before, const ImuSample& after) const {
  const double spacing_s = seconds_between(before.t_ns, after.t_ns);
  return spacing_s > limits_.max_gap_s ? spacing_s : 0.;
}

bool ImuBuffer::is_after_the_last(std::int64_t t_ns) {
  const std::int64_t last_ns = in_doubt_ ? in_doubt_->t_ns : empty() ? t_ns - 1 : newest_ns();
  clock_.see(t_ns, last_ns);
  return t_ns > last_ns;
}

void ImuBuffer::add(const ImuSample& sample, Rejections& rejections) {
  if (const char* fault = sample.fault()) {
    rejections.add(std::string("imu: ") + fault, sample.t_ns);
    return;
  }
  if (!is_stamp(sample.t_ns)) {
    rejections.add("imu: stamp that is none", sample.t_ns);
    return;
  }
  if (!is_within(sample.gyro_rad_per_s, limits_.max_gyro_rad_per_s) ||
      !is_within(sample.accel_m_per_s2, limits_.max_accel_m_per_s2)) {
    rejections.add(
        "imu: out of range (range_gyro_rad_per_s, range_accel_m_per_s2): saturated, or of other "
        "units",
        sample.t_ns);
    return;
  }
  if (!is_after_the_last(sample.t_ns)) {
    rejections.add("imu: stamp not after the last", sample.t_ns);
    return;
  }
  if (!jump_.is_believed(sample.t_ns)) {
    rejections.add("imu: stamp far ahead of the last", sample.t_ns);
    return;
  }
  watch_.add(sample);
  if (in_doubt_) {
    if (watch_.was_spike()) {
      rejections.add(kSpike, in_doubt_->t_ns);
    } else {
      push(*in_doubt_, rejections);
    }
    in_doubt_.reset();
  }
  if (watch_.is_stuck()) {
    rejections.add("imu: stuck, the same reading again and again", sample.t_ns);
  } else if (watch_.is_in_doubt()) {
    in_doubt_ = sample;
  } else {
    push(sample, rejections);
  }
}

void ImuBuffer::finish(Rejections& rejections) {
  if (in_doubt_) rejections.add(kSpike, in_doubt_->t_ns);
  in_doubt_.reset();
}

void ImuBuffer::push(const ImuSample& sample, Rejections& rejections) {
  if (!empty() && gap_s(samples().back(), sample) > 0.) {
    rejections.add("imu: gap bridged", sample.t_ns);
  }
  buffer_.push(sample);
}

std::span<const ImuSample> ImuBuffer::cut(std::int64_t begin_ns, std::int64_t end_ns) {
  cut_.clear();
  gaps_s_.assign(1, 0.);
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
    gaps_s_.push_back(sample == all.begin() ? 0. : gap_s(*std::prev(sample), *sample));
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

double ImuBuffer::silent_s(std::int64_t t_ns) const {
  const auto all = samples();
  const auto next =
      std::upper_bound(all.begin(), all.end(), t_ns,
                       [](std::int64_t t, const ImuSample& sample) { return t < sample.t_ns; });
  return next == all.end() ? 0. : seconds_between(t_ns, next->t_ns);
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
  if (empty() || newest_ns() - samples().front().t_ns < 2 * kMaxStartWindowNs) return;
  forget_before(newest_ns() - kMaxStartWindowNs);
}

}  // namespace viwo
