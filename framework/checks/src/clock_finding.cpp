#include "viwo/checks/clock_finding.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "viwo/eval/statistics.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::inspect {

using series::Lag;

namespace {

/// A clock that was set: the lags of tenths of the time are of two values, one after the other.
struct ClockChange {
  double at_s = 0., first_s = 0., then_s = 0.;
};
std::optional<ClockChange> clock_change(const std::vector<std::pair<double, double>>& parts) {
  std::optional<ClockChange> found;
  double least = INFINITY;
  for (std::size_t k = 2; k + 2 <= parts.size(); ++k) {
    std::vector<double> first, then;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      (i < k ? first : then).push_back(parts[i].second);
    }
    const auto spread = [](const std::vector<double>& lags) {
      const auto [low, high] = std::minmax_element(lags.begin(), lags.end());
      return *high - *low;
    };
    // The tenth in which it was set is between the two.
    const double within = std::max(spread(first), spread(then));
    const double jump = eval::median(then) - eval::median(first);
    constexpr double kLeast_s = 0.02, kClearly = 3.;
    if (std::abs(jump) < std::max(kLeast_s, kClearly * within) || within >= least) continue;
    least = within;
    found = {0.5 * (parts[k - 1].first + parts[k].first), eval::median(first), eval::median(then)};
  }
  return found;
}

/// A clock that counts other seconds: the lags of tenths of the time lie on a line.
struct ClockDrift {
  double per_s = 0., first_s = 0., last_s = 0.;  ///< lags at the first and the last tenth
};
std::optional<ClockDrift> clock_drift(const std::vector<std::pair<double, double>>& parts) {
  constexpr std::size_t kFewest = 8;
  if (parts.size() < kFewest) return {};
  std::vector<double> slopes;  // of all pairs: a tenth that is wrong has no say in their median
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      slopes.push_back((parts[i].second - parts[j].second) / (parts[i].first - parts[j].first));
    }
  }
  const double slope = eval::median(slopes);
  const auto along = static_cast<double>(
      std::count_if(slopes.begin(), slopes.end(), [&](double one) { return one * slope > 0.; }));
  std::vector<double> at_zero, off;
  for (const auto& [t_s, lag_s] : parts) at_zero.push_back(lag_s - slope * t_s);
  const double zero_s = eval::median(at_zero);
  for (const double lag_s : at_zero) off.push_back(std::abs(lag_s - zero_s));
  const ClockDrift drift{slope, zero_s + slope * parts.front().first,
                         zero_s + slope * parts.back().first};
  // Of ten that have no trend so many pairs go one way once in fifty times (Kendall).
  constexpr double kLeast_s = 0.04, kClearly = 3., kOneWay = 0.8;
  const bool goes_one_way = along > kOneWay * static_cast<double>(slopes.size());
  if (!goes_one_way ||
      std::abs(drift.last_s - drift.first_s) < std::max(kLeast_s, kClearly * eval::median(off)))
    return {};
  return drift;
}

std::string ms(double seconds) { return significant(1e3 * seconds, 3) + " ms"; }

/// A clock that was set on the way, or goes at another rate: that is what there is to be said.
bool is_unsteady(const ClockWords& words, const Lag& lag, Finding& finding) {
  if (const auto change = clock_change(lag.parts)) {
    finding.severity = Severity::kFault;
    finding.what = "its clock against that of " + words.other + " is " + ms(change->first_s) +
                   " until about " + significant(change->at_s, 3) + " s, and " +
                   ms(change->then_s) +
                   " from then on: one of the two was set, or lost samples without their time";
    finding.figures.push_back({"change", change->then_s - change->first_s, "s"});
    return true;
  }
  if (const auto drift = clock_drift(lag.parts)) {
    finding.severity = Severity::kFault;
    finding.what = "its clock against that of " + words.other + " moves from " +
                   ms(drift->first_s) + " to " + ms(drift->last_s) + ", by " +
                   significant(100. * std::abs(drift->per_s), 2) +
                   " %: one of the two counts other seconds, or its stamps are made from a rate "
                   "that it does not have";
    finding.figures.push_back({"drift", drift->per_s, ""});
    return true;
  }
  return false;
}

}  // namespace

bool drifts(const Lag& lag) { return clock_drift(lag.parts).has_value(); }

Finding clock_finding(const std::string& label, const ClockWords& words, const Lag& lag,
                      double sigma_prior_s, double period_s) {
  Finding finding{label,
                  Severity::kFits,
                  words.check,
                  "",
                  {{"lag", lag.lag_s, "s"},
                   {"sigma", lag.sigma_s, "s"},
                   {"correlation", lag.correlation, ""},
                   {"correlation without lag", lag.at_zero, ""},
                   {"rate, standard deviation", lag.rate_rad_per_s, "rad/s"},
                   {"configured clock", words.configured_s, "s"}}};
  if (is_unsteady(words, lag, finding)) return finding;
  const std::string by = ms(std::abs(lag.lag_s)) + " +- " + ms(lag.sigma_s) + " (correlation " +
                         significant(lag.correlation, 3) + ")";
  // Beyond what the filter corrects by itself, from the prior it is given, and what stamps of
  // samples of that length can mean.
  const double most_s = 3. * std::hypot(sigma_prior_s, lag.sigma_s) + 0.25 * period_s;
  // Two sensors that hardly say the same give no time.
  constexpr double kTrusted = 0.8, kMostSigma_s = 0.02;
  const bool differs = std::abs(lag.correlation) < kTrusted;
  if (differs || (lag.sigma_s > kMostSigma_s && std::abs(lag.lag_s) < 5. * lag.sigma_s)) {
    finding.severity = Severity::kNote;
    finding.what = (differs ? "its rate and that of " + words.other + " are too different"
                            : std::string("it turns too evenly")) +
                   " to compare clocks (" + by + ")";
    return finding;
  }
  if (std::abs(lag.lag_s) <= most_s) {
    finding.what = words.clock + " fits: off by " + by + " against " + words.other;
    return finding;
  }
  finding.severity = Severity::kFault;
  finding.what =
      std::string(lag.lag_s > 0. ? "lags behind " : "is ahead of ") + words.other + " by " + by;
  if (words.key.empty()) {
    constexpr double kLittle_s = 0.1;
    if (std::abs(lag.lag_s) < kLittle_s) finding.severity = Severity::kNote;
    finding.what +=
        ": a run of the wheels alone does not mind; viwo calibrate finds it "
        "(prior_sigma_clock_offset_s)";
    return finding;
  }
  finding.what += ", beyond what " + words.key + " says";
  const double value = words.configured_s - lag.lag_s;
  finding.remedies = {{words.key, significant(1e-4 * std::round(1e4 * value), 6)}};
  return finding;
}

}  // namespace viwo::inspect
