#include "viwo/estimator/stream.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "viwo/estimator/start_search.hpp"
#include "viwo/math/extent.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

/// A stamp this far after that of the newest IMU sample is of another clock, or broken: taken, it
/// would make all that come after it late.
constexpr double kMaxAheadS = 10.;
constexpr const char* kFarAhead = "stamp more than 10 s ahead of the IMU";
/// For clocks that are found to be off, and interpolation.
constexpr std::int64_t kMarginNs = 500'000'000;
/// Moving fewer samples than this is not worth while.
constexpr std::size_t kFewestToForget = 64;
/// A sample of a channel beyond has a number that is broken: the order of its stamps is not
/// watched.
constexpr std::size_t kMostChannels = 64;

}  // namespace

Stream::Stream(SharedStream declared)
    : declared_(std::move(declared)), buffer_(spec().type->make_buffer()) {}

std::int64_t Stream::offset_ns(int channel, const StateBlocks& blocks) const {
  const auto& clocks = spec().clocks;
  if (clocks.empty()) return 0;
  const auto last = static_cast<int>(clocks.size()) - 1;
  const auto& clock = clocks[static_cast<std::size_t>(std::clamp(channel, 0, last))];
  const double estimated_s = clock.block.index < 0 ? 0. : blocks.view(clock.block).numbers()[0];
  // An estimate that has gone wild is found out at the end of the epoch (failure_of()).
  constexpr double kMostS = 1e8;
  const double offset_s = clock.constant_s + estimated_s;
  return to_ns(std::abs(offset_s) <= kMostS ? offset_s : 0.);
}

std::int64_t Stream::imu_time_ns(std::size_t i, const StateBlocks& blocks) const {
  const void* sample = buffer_->at(i);
  const SampleType& type = *spec().type;
  return type.extent(sample).t_ns + offset_ns(type.channel(sample), blocks);
}

std::optional<Stream::Arrival>* Stream::last_of(int channel) {
  const auto at = static_cast<std::size_t>(std::max(channel, 0));
  if (at >= kMostChannels) return nullptr;
  if (at >= last_of_.size()) last_of_.resize(at + 1);
  return &last_of_[at];
}

void Stream::reject(const char* what, std::int64_t t_ns, Rejections& rejections) {
  reason_.assign(spec().type->name).append(": ").append(what);
  rejections.add(reason_, t_ns);
}

const char* Stream::objection(const Arrival& arrival, const StateBlocks& blocks,
                              std::optional<std::int64_t> imu_ns) {
  if (imu_ns && seconds_between(*imu_ns, arrival.t_ns) > kMaxAheadS) {
    return kFarAhead;
  }
  const SampleExtent& extent = arrival.extent;
  if (const auto* last = last_of(arrival.channel); last != nullptr && *last) {
    if (const char* why = fault_of(extent, (*last)->extent)) return why;
  }
  if (last_ && last_->channel != arrival.channel) {  // stamps of two clocks
    const std::int64_t last_ns = last_->extent.t_ns + offset_ns(last_->channel, blocks);
    if (arrival.t_ns < last_ns - same_instant_ns()) return "stamp before the last";
  }
  const bool is_late = arrival.t_ns <= epoch_ns_ || arrival.t_ns <= instant_ns_ + same_instant_ns();
  if (spec().ends_epochs && is_late) return "at or before the present epoch";
  if (!declared_.keeps && arrival.t_ns <= start_ns_) return "before the start";
  return nullptr;
}

void Stream::forget_other_clock(std::int64_t imu_ns, Rejections& rejections) {
  if (newest_ns_ == kNever || seconds_between(imu_ns, newest_ns_) <= kMaxAheadS) return;
  for (std::size_t i = 0; i < buffer_->size(); ++i) {
    reject(kFarAhead, buffer_->extent(i).t_ns, rejections);
  }
  buffer_->drop_front(buffer_->size());
  taken_from_ = taken_to_ = 0;
  last_.reset();
  last_of_.clear();
  newest_ns_ = kNever;
}

void Stream::add(SampleView sample, const StateBlocks& blocks, std::optional<std::int64_t> imu_ns,
                 Rejections& rejections) {
  if (!(sample.type() == *spec().type)) {
    throw std::invalid_argument("a sample of another kind than the stream's");
  }
  if (imu_ns) forget_other_clock(*imu_ns, rejections);
  Arrival arrival{sample.extent(), sample.type().channel(sample.data())};
  const SampleExtent& extent = arrival.extent;
  const char* why = sample.type().fault(sample.data());
  if (why == nullptr) why = fault_of(extent);
  if (why == nullptr) {
    arrival.t_ns = extent.t_ns + offset_ns(arrival.channel, blocks);
    why = objection(arrival, blocks, imu_ns);
  }
  if (why != nullptr) return reject(why, arrival.extent.t_ns, rejections);
  buffer_->push(sample.data());
  last_ = arrival;
  if (auto* last = last_of(arrival.channel)) *last = arrival;
  newest_ns_ = std::max(newest_ns_, arrival.t_ns);
}

void Stream::start_at(std::int64_t t_ns, const StateBlocks& blocks, Rejections& rejections) {
  start_ns_ = epoch_ns_ = t_ns;
  if (declared_.keeps) return;
  std::size_t early = 0;
  while (early < buffer_->size() && imu_time_ns(early, blocks) <= t_ns) {
    reject("before the start", buffer_->extent(early++).t_ns, rejections);
  }
  buffer_->drop_front(early);
}

void Stream::forget_before_start(const StateBlocks& blocks, std::optional<std::int64_t> imu_ns,
                                 Rejections& rejections) {
  // By the newest stamp of the stream itself: one that is far in the future spoils no other, and it
  // has an end where the IMU does not come at all.
  if (buffer_->empty()) return;
  std::int64_t newest_ns = imu_time_ns(buffer_->size() - 1, blocks);
  // What was said before it fell silent must not be in the way for ever.
  if (declared_.keeps && imu_ns) newest_ns = std::max(newest_ns, *imu_ns);
  if (newest_ns - imu_time_ns(0, blocks) < 2 * kMaxStartWindowNs) return;
  std::size_t old = 0;
  while (old < buffer_->size() && imu_time_ns(old, blocks) < newest_ns - kMaxStartWindowNs) {
    if (!declared_.keeps) reject("before the start", buffer_->extent(old).t_ns, rejections);
    ++old;
  }
  buffer_->drop_front(old);
}

std::optional<std::int64_t> Stream::next_end_ns(const StateBlocks& blocks) const {
  if (!spec().ends_epochs || taken_to_ == buffer_->size()) return std::nullopt;
  return imu_time_ns(taken_to_, blocks);
}

int Stream::waiting_at(std::int64_t t_ns, const StateBlocks& blocks) const {
  int count = 0;
  for (std::size_t i = taken_to_; i < buffer_->size(); ++i, ++count) {
    if (imu_time_ns(i, blocks) > t_ns + same_instant_ns()) break;
  }
  return count;
}

bool Stream::reaches(std::int64_t t_ns, const StateBlocks& blocks) const {
  return last_ && last_->extent.end_ns + offset_ns(last_->channel, blocks) >= t_ns;
}

bool Stream::is_of_taken_channel(std::size_t i) const {
  const SampleType& type = *spec().type;
  const int channel = type.channel(buffer_->at(i));
  for (std::size_t k = taken_from_; k < taken_to_; ++k) {
    if (type.channel(buffer_->at(k)) == channel) return true;
  }
  return false;
}

void Stream::take(std::int64_t t_ns, const StateBlocks& blocks) {
  taken_from_ = taken_to_;
  while (taken_to_ < buffer_->size() && imu_time_ns(taken_to_, blocks) <= t_ns) ++taken_to_;
  epoch_ns_ = t_ns;
  if (taken_to_ == taken_from_) return;
  instant_ns_ = t_ns;
  // What other channels have of the same instant.
  while (taken_to_ < buffer_->size() &&
         imu_time_ns(taken_to_, blocks) <= t_ns + same_instant_ns() &&
         !is_of_taken_channel(taken_to_)) {
    ++taken_to_;
  }
}

SampleSpan Stream::span(std::size_t first, std::size_t last) const {
  if (first == last) return {spec().type, nullptr, 0};
  return {spec().type, buffer_->at(first), last - first};
}

SampleSpan Stream::taken(Given given) const {
  return given == Given::kOnce ? span(taken_from_, taken_to_) : all();
}

void Stream::forget(std::int64_t oldest_clone_ns, const StateBlocks& blocks) {
  std::size_t old = taken_to_;
  if (declared_.keeps) {
    old = 0;
    while (old < taken_to_) {
      const SampleExtent extent = buffer_->extent(old);
      const std::int64_t end_ns = imu_time_ns(old, blocks) + (extent.end_ns - extent.t_ns);
      if (end_ns >= oldest_clone_ns - kMarginNs) break;
      ++old;
    }
    if (old <= kFewestToForget) old = 0;
  }
  buffer_->drop_front(old);
  taken_to_ -= old;
  taken_from_ = taken_to_;
}

}  // namespace viwo
