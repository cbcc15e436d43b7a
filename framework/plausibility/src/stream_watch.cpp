#include "stream_watch.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/plausibility/periods.hpp"

namespace viwo {
namespace {

constexpr double kMostPeriods = 10.;
constexpr int kFewestSpacings = 20;  ///< to know the usual period
constexpr std::int64_t kSecondNs = 1'000'000'000;
/// A gap before the period is known, and what nobody can do without.
constexpr std::int64_t kLongNs = 10 * kSecondNs;
/// Who ends a recording stops its sensors one after the other.
constexpr std::int64_t kEndNs = 2 * kSecondNs;
/// Nothing may be written of a rest at the end, for as long.
constexpr std::int64_t kRestNs = 10 * kSecondNs;
constexpr std::int64_t kMostSaid = 10;  ///< gaps that are told one by one
constexpr const char* kLook = ": look at its cable, driver and bus";
constexpr const char* kOrRejected = ", or at why all of it is rejected";

void raise(std::int64_t& newest_ns, std::int64_t t_ns) { newest_ns = std::max(newest_ns, t_ns); }

std::string seconds(std::int64_t ns) {
  return significant(1e-9 * static_cast<double>(ns), 2) + " s";
}

}  // namespace

/// Readings follow each other, all of them long before one that came earlier.
bool StreamWatch::is_set_back(std::int64_t t_ns) {
  constexpr int kMostBehind = 20;
  n_behind_ = t_ns < newest_ns_ - kSecondNs ? n_behind_ + 1 : 0;
  return n_behind_ > kMostBehind;
}

std::optional<std::int64_t> StreamWatch::common_time_ns(std::int64_t stamp_ns) const {
  std::int64_t t_ns = 0;
  if (__builtin_add_overflow(stamp_ns, offset_ns_, &t_ns) || !is_stamp(t_ns)) return std::nullopt;
  return t_ns;
}

void StreamWatch::add(std::int64_t stamp_ns, int number, std::int64_t now_ns, bool rests) {
  if (!is_stamp(stamp_ns)) return;
  rests_ = rests;
  // A first stamp that the next one contradicts says nothing of the clock.
  if (const auto t_ns = common_time_ns(stamp_ns);
      n_samples_ == 1 && (!t_ns || std::abs(now_ns - *t_ns) > kLongNs)) {
    has_begun_ = false;
    offset_ns_ = 0;
    jump_ = StampJump{1.};
  }
  if (!has_begun_) {
    // Of another clock.
    const std::int64_t off_ns = now_ns - stamp_ns;
    if (off_ns > kSecondNs / 2 || off_ns < -kSecondNs / 2) offset_ns_ = off_ns;
    first_offset_ns_ = offset_ns_;
  }
  ++n_samples_;
  const std::optional<std::int64_t> stamped_ns = common_time_ns(stamp_ns);
  if (!stamped_ns) return;
  std::int64_t t_ns = *stamped_ns;
  if (has_begun_ && t_ns <= newest_ns_) {
    if (!is_set_back(t_ns)) {
      // Of another camera at the same instant.
      if (n_behind_ == 0) raise(channel(number).newest_ns, t_ns);
      return;
    }
    t_ns = now_ns + 1;
    offset_ns_ = t_ns - stamp_ns;
  }
  n_behind_ = 0;
  if (!jump_.is_believed(t_ns)) {
    doubted_ns_ = t_ns;
    return;
  }
  if (has_begun_) {
    // Of what was doubted and is confirmed the first sample counts.
    const std::int64_t doubted_ns = std::exchange(doubted_ns_, {}).value_or(t_ns);
    const Pause gap{newest_ns_, std::min(doubted_ns, t_ns) - newest_ns_};
    if (gap.length_ns > longest_spacing_ns()) {
      ++n_gaps_;
      gaps_ns_ += gap.length_ns;
      last_gap_ = gap;
      if (gap.length_ns > longest_gap_.length_ns) longest_gap_ = gap;
    }
  }
  Channel& own = channel(number);
  if (has_begun_ && &own == &channels_.front()) watch_period(t_ns - own.newest_ns);
  newest_ns_ = own.newest_ns = t_ns;
  has_begun_ = true;
}

/// Allocates when one is seen for the first time.
auto StreamWatch::channel(int number) -> Channel& {
  const auto known = std::find_if(channels_.begin(), channels_.end(),
                                  [number](const Channel& c) { return c.number == number; });
  return known != channels_.end() ? *known : channels_.emplace_back(Channel{number, 0});
}

/// Steps up and down are equally many where it is the median; gaps are no more than others.
void StreamWatch::watch_period(std::int64_t spacing_ns) {
  const auto spacing = static_cast<double>(spacing_ns);
  spacings_ns_ += spacing;
  n_all_spacings_ += 1.;
  if (n_spacings_ == 0) period_ns_ = spacing;
  const double step = n_spacings_ < kFewestSpacings ? 1.2 : 1.02;
  period_ns_ *= spacing > period_ns_ ? step : 1. / step;
  n_spacings_ = std::min(n_spacings_ + 1, kFewestSpacings);
  if (n_spacings_ == kFewestSpacings) watch_bursts(spacing_ns);
}

/// What is stamped when it arrives, and is held up: a pause, then half of what it lacks, or more,
/// at once.
void StreamWatch::watch_bursts(std::int64_t spacing_ns) {
  constexpr double kLongPause = 4.;
  const double periods = static_cast<double>(spacing_ns) / period_ns_;
  if (n_missing_ > 0. && periods < 0.5) {
    ++n_at_once_;
    return;
  }
  if (n_missing_ > 0. && 2. * n_at_once_ >= n_missing_) {
    ++n_held_up_;
    longest_held_up_ns_ = std::max(longest_held_up_ns_, pause_ns_);
  }
  n_missing_ = periods > kLongPause ? periods - 1. : 0.;
  n_at_once_ = 0;
  pause_ns_ = spacing_ns;
}

std::int64_t StreamWatch::longest_spacing_ns() const {
  if (n_spacings_ < kFewestSpacings) return kLongNs;
  return std::max(least_gap_ns_, static_cast<std::int64_t>(kMostPeriods * period_ns_));
}

void StreamWatch::find_held_up(Findings& out) const {
  constexpr std::int64_t kFewest = 3;
  if (n_held_up_ < kFewest) return;
  out.push_back({name_ + " held up",
                 name_ + ": " + std::to_string(n_held_up_) + " times no samples for up to " +
                     seconds(longest_held_up_ns_) +
                     ", then all of them at once: they are held up by the driver or the bus, and "
                     "stamped when they arrive - stamp them when they are measured"});
}

/// Samples that come in bunches have a usual period of nothing, and a mean one that may well be; a
/// single long pause weighs little among a hundred.
void StreamWatch::find_unit(Findings& out) const {
  constexpr double kFewest = 100.;
  if (n_all_spacings_ < kFewest) return;
  const double mean_ns = spacings_ns_ / n_all_spacings_;
  const auto [shorter_ns, longer_ns] = std::minmax({period_ns_, mean_ns});
  if (longer_ns >= 1e9 * kShortestPeriod_s && shorter_ns <= longest_period_ns_) return;
  out.push_back({name_ + " unit",
                 name_ + ": a sample every " + significant(1e-9 * mean_ns, 2) +
                     " s: its stamps are of another unit (time_unit of a csv_table; others are in "
                     "nanoseconds: microseconds times 1e3, milliseconds times 1e6)",
                 false,
                 {},
                 true});
}

/// Of several, while others go on.
void StreamWatch::find_silent_channels(std::int64_t now_ns, std::int64_t zero_ns,
                                       std::int64_t longest_ns, Findings& out) const {
  for (const Channel& channel : channels_) {
    if (now_ns - channel.newest_ns <= longest_ns) continue;
    const std::string number = std::to_string(channel.number);
    out.push_back({name_ + " channel " + number, name_ + ": none of camera " + number + " since " +
                                                     time_text(channel.newest_ns - zero_ns) +
                                                     ", others go on" + kLook});
  }
}

void StreamWatch::findings(std::int64_t now_ns, std::int64_t zero_ns, Findings& out) const {
  if (!has_begun_) {
    if (now_ns - zero_ns > kLongNs)
      out.push_back({name_ + " none", name_ + ": no samples" + kLook + kOrRejected});
    return;
  }
  find_held_up(out);
  if (n_gaps_ > kMostSaid) return;
  const std::string number = std::to_string(n_gaps_);
  if (now_ns - newest_ns_ > longest_spacing_ns()) {
    out.push_back({name_ + " silent " + number,
                   name_ + ": no samples since " + time_text(newest_ns_ - zero_ns) + kLook});
    return;
  }
  find_silent_channels(now_ns, zero_ns, longest_spacing_ns(), out);
  if (n_gaps_ > 0) {
    out.push_back({name_ + " again " + number,
                   name_ + ": samples again, after " + seconds(last_gap_.length_ns) +
                       " without any from " + time_text(last_gap_.begin_ns - zero_ns) + " on",
                   true});
  }
}

void StreamWatch::findings(std::int64_t now_ns, std::int64_t zero_ns, const char* of_what,
                           Findings& out) const {
  if (!has_begun_) {
    if (now_ns - zero_ns <= kEndNs) return;
    out.push_back({.key = name_ + " none",
                   .text = name_ + ": no samples in all of the " + of_what + kLook + kOrRejected,
                   .is_doubt = true});
    return;
  }
  find_held_up(out);
  if (n_gaps_ > 0) {
    const bool several = n_gaps_ > 1;
    out.push_back({name_ + " gaps",
                   name_ + ": no samples " +
                       (several ? std::to_string(n_gaps_) + " times, " + seconds(gaps_ns_) +
                                      " in all, the longest "
                                : std::string()) +
                       "for " + seconds(longest_gap_.length_ns) + " from " +
                       time_text(longest_gap_.begin_ns - zero_ns) +
                       ": look at its cable, driver, bus and clock, or at what has recorded it"});
  }
  const std::int64_t silent_ns = now_ns - newest_ns_;
  const std::int64_t longest_ns = std::max(longest_spacing_ns(), kEndNs);
  if (rests_ && silent_ns <= kRestNs) return;
  if (silent_ns <= longest_ns) return find_silent_channels(now_ns, zero_ns, longest_ns, out);
  out.push_back({name_ + " end", name_ + ": ended " + seconds(silent_ns) +
                                     " before the end of the " + of_what + " (" +
                                     time_text(newest_ns_ - zero_ns) +
                                     "): look at its cable and driver, or the log was cut"});
}

}  // namespace viwo
