#include "viwo/estimator/contact.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace viwo {
namespace {

constexpr double kPeriodS = 0.5;        ///< longer where there are few measurements ...
constexpr double kLongestPeriodS = 5.;  ///< ... but not for ever
constexpr std::int64_t kFewest = 5;     ///< measurements of a period that say something
constexpr int kMostPeriods = 8;         ///< lost, less those in touch

}  // namespace

Contact::Verdict Contact::verdict(std::span<const UpdateCounts> counts) const {
  Verdict verdict = Verdict::kNone;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::int64_t applied = counts[i].applied - before_[i].applied;
    const std::int64_t rejected = counts[i].rejected - before_[i].rejected;
    if (applied + rejected < kFewest) continue;
    if (5 * applied > applied + rejected) return Verdict::kAgrees;
    verdict = Verdict::kContradicts;
  }
  return verdict;
}

std::string Contact::epoch(std::span<const UpdateCounts> counts, Filter& filter) {
  const std::int64_t t_ns = filter.t_ns();
  if (before_.empty()) {
    before_.assign(counts.begin(), counts.end());
    begin_ns_ = t_ns;
  }
  const double period_s = seconds_between(begin_ns_, t_ns);
  if (period_s < kPeriodS) return "";
  const Verdict says = verdict(counts);
  if (says == Verdict::kNone && period_s < kLongestPeriodS) return "";
  std::copy(counts.begin(), counts.end(), before_.begin());
  const std::int64_t begin_ns = std::exchange(begin_ns_, t_ns);
  if (says != Verdict::kContradicts) {
    lost_periods_ = 0;
    if (says == Verdict::kAgrees) balance_ = std::max(0, balance_ - 1);
    return "";
  }
  ++lost_periods_;
  if (balance_++ == 0) lost_since_ns_ = begin_ns;
  if (balance_ == kMostPeriods) {
    char text[24];
    std::snprintf(text, sizeof text, "%.1f s", seconds_between(lost_since_ns_, t_ns));
    return std::string("all updates have contradicted the estimate for ") + text +
           ": check units, axes and clock of the IMU, then mount, calibration and noise of the "
           "other sensors (viwo inspect looks for what is wrong with them)";
  }
  if (loosened_++ == 0) first_ns_ = begin_ns;
  filter.loosen(lost_periods_);
  return "";
}

}  // namespace viwo
