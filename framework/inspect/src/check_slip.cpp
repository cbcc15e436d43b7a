#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "checks.hpp"
#include "clock_finding.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/series/lag.hpp"
#include "viwo/series/rate_grid.hpp"
#include "viwo/wheel/drive_ranges.hpp"

namespace viwo::inspect {

using series::RateGrid;
using series::Recording;
using series::Span;
using series::turns_of;
using series::twists_of;
using series::Wheels;
using series::YawRates;

namespace {

constexpr std::size_t kWindow = 50;       ///< cells: half a second
constexpr std::size_t kFewestOfAll = 40;  ///< windows
constexpr double kWindow_s = static_cast<double>(kWindow) * RateGrid::kCell_s;

/// Mean rates of a window, rad/s.
struct Window {
  std::int64_t begin_ns;
  double gyro, wheels;
  double speed_m_per_s;  ///< of the wheels
};

std::vector<Window> windows_of(const RateGrid& gyro, const RateGrid& wheels, std::int64_t lag) {
  std::vector<Window> windows;
  for (std::size_t i = 0; i + kWindow <= gyro.size(); i += kWindow) {
    Window window{gyro.begin_ns() + static_cast<std::int64_t>(i) * RateGrid::kCellNs, 0., 0., 0.};
    std::size_t n = 0;
    for (std::size_t k = i; k < i + kWindow; ++k) {
      const std::int64_t j = static_cast<std::int64_t>(k) + lag;
      if (j < 0 || j >= static_cast<std::int64_t>(wheels.size())) continue;
      const auto of_wheels = static_cast<std::size_t>(j);
      if (!gyro.has(k) || !wheels.has(of_wheels)) continue;
      window.gyro += gyro[k].z();
      window.wheels += wheels[of_wheels].z();
      window.speed_m_per_s += wheels[of_wheels].head<2>().norm();
      ++n;
    }
    if (5 * n < 4 * kWindow) continue;
    window.gyro /= static_cast<double>(n);
    window.wheels /= static_cast<double>(n);
    window.speed_m_per_s /= static_cast<double>(n);
    windows.push_back(window);
  }
  return windows;
}

/// By how much the gyro turns otherwise than wheels that may be wrong by a factor, and it by a
/// bias.
std::vector<double> differences(const std::vector<Window>& windows) {
  constexpr double kTurns_rad_per_s = 0.1, kMostOff = 1.5;
  std::vector<double> factors, left;
  for (const Window& w : windows) {
    if (std::abs(w.wheels) > kTurns_rad_per_s) factors.push_back(w.gyro / w.wheels);
  }
  const double factor =
      factors.empty() ? 1. : std::clamp(eval::median(factors), 1. / kMostOff, kMostOff);
  for (const Window& w : windows) left.push_back(w.gyro - factor * w.wheels);
  const double bias = eval::median(left);
  for (double& one : left) one -= bias;
  return left;
}

std::vector<double> sizes_of(const std::vector<double>& values) {
  std::vector<double> sizes;
  for (const double value : values) sizes.push_back(std::abs(value));
  return sizes;
}

/// Slip looks like a lag where turns are alike: with the one that there is most of the time fits.
std::vector<Window> in_step(const RateGrid& gyro, const RateGrid& twists, double lag_s) {
  std::vector<Window> as_it_is = windows_of(gyro, twists, 0);
  std::vector<Window> shifted = windows_of(gyro, twists, std::llround(lag_s / RateGrid::kCell_s));
  if (shifted.size() < kFewestOfAll || as_it_is.size() < kFewestOfAll) return as_it_is;
  const auto median_of = [](const std::vector<Window>& windows) {
    return eval::median(sizes_of(differences(windows)));
  };
  return median_of(shifted) < median_of(as_it_is) ? shifted : as_it_is;
}

/// What sizes that are wrong and skidding make of a turn and of a way, rad/s.
double usual(const Window& window) {
  constexpr double kPartOfTurn = 0.45, kOfWay_rad_per_m = 0.06;
  return std::max(kPartOfTurn * std::abs(window.gyro), kOfWay_rad_per_m * window.speed_m_per_s);
}

/// Windows that follow each other, in all of which the wheels turn too much, or too little.
struct Stretch {
  std::size_t first = 0, count = 0;
  double turn_rad = 0.;
};

/// Drives that give one number all the time while another turns: " (drive_1 reads 0 rad/s ...)".
std::string constant_drives(const Wheels& wheels, std::int64_t from_ns, std::int64_t to_ns) {
  constexpr double kMoves_rad_per_s = 0.1;
  DriveRanges ranges(wheels.model->description().n_drive);
  for (const EncoderSample& sample : wheels.samples) {
    if (sample.t_ns >= from_ns && sample.t_ns <= to_ns) ranges.add(sample);
  }
  if (ranges.fastest() < kMoves_rad_per_s) return "";
  std::string text;
  for (const auto& [drive, value] : ranges.stuck()) {
    text += (text.empty() ? " (" : ", ") + ("drive_" + std::to_string(drive + 1)) + " reads " +
            significant(value, 3) + " rad/s all that time";
  }
  return text.empty() ? "" : text + ")";
}

/// Wheels that agree with a gyro but for a while.
bool check_against(const Recording& recording, const Wheels& wheels, const YawRates& rates,
                   Findings& out) {
  const Span span = span_of(recording);
  const RateGrid gyro(span.begin_ns, span.end_ns, rates.turns);
  const RateGrid twists(span.begin_ns, span.end_ns, twists_of(wheels));
  const auto lag = find_lag(gyro, RateGrid(span.begin_ns, span.end_ns, turns_of(wheels)));
  if (lag && drifts(*lag)) return false;
  const std::vector<Window> windows = in_step(gyro, twists, lag ? lag->lag_s : 0.);
  if (windows.size() < kFewestOfAll) return false;
  const std::vector<double> left = differences(windows);
  const std::vector<double> sizes = sizes_of(left);
  constexpr double kNormal = 1.4826, kSigmas = 8., kLeast_rad_per_s = 0.08;
  const double limit = std::max(kSigmas * kNormal * eval::median(sizes), kLeast_rad_per_s);
  Stretch longest, now;
  double beyond = 0.;
  for (std::size_t i = 0; i < left.size(); ++i) {
    const bool is_beyond = sizes[i] > std::max(limit, usual(windows[i]));
    const bool follows = i > 0 && windows[i].begin_ns - windows[i - 1].begin_ns == to_ns(kWindow_s);
    const bool goes_on = now.count > 0 && follows && now.turn_rad * left[i] > 0.;
    if (is_beyond) beyond += 1.;
    if (!is_beyond) now = {};
    if (is_beyond && !goes_on) now = {i, 0, 0.};
    if (is_beyond) {
      ++now.count;
      now.turn_rad += kWindow_s * left[i];
    }
    if (std::abs(now.turn_rad) > std::abs(longest.turn_rad)) longest = now;
  }
  // What is wrong more often is another fault; what is less is how wheels are.
  constexpr double kMostPart = 0.35, kLeast_rad = 0.2;
  constexpr std::size_t kLeastWindows = 2;
  if (longest.count < kLeastWindows || std::abs(longest.turn_rad) < kLeast_rad ||
      beyond > kMostPart * static_cast<double>(left.size())) {
    return false;
  }
  const std::int64_t from_ns = windows[longest.first].begin_ns;
  const double length_s = kWindow_s * static_cast<double>(longest.count);
  const std::string label = recording.label<EncoderSample>(wheels.sensor);
  // A base that skids does so by some degrees where the ground changes.
  constexpr double kFault_rad = 0.5;
  out.push_back({label,
                 std::abs(longest.turn_rad) < kFault_rad ? Severity::kNote : Severity::kFault,
                 "slip",
                 "turns otherwise than " + rates.label + " for " + significant(length_s, 2) +
                     " s from " + time_text(from_ns - recording.begin_ns()) + " on, by " +
                     significant(std::abs(longest.turn_rad), 2) +
                     " rad in all, and as it does otherwise" +
                     constant_drives(wheels, from_ns + to_ns(0.5 * kWindow_s),
                                     from_ns + to_ns(length_s - 0.5 * kWindow_s)) +
                     ": a wheel slipped, was blocked or lifted, or its encoder stood still",
                 {{"turn", longest.turn_rad, "rad"}, {"longest", length_s, "s"}}});
  return true;
}

}  // namespace

void check_slip(const Recording& recording, Findings& out) {
  for (const Wheels& wheels : recording.wheels) {
    if (wheels.samples.empty() || !wheels.unusable.empty()) continue;
    const std::string label = recording.label<EncoderSample>(wheels.sensor);
    if (is_fault(out, label, "contradicted")) continue;
    for (const YawRates& rates : yaw_rates_of(recording, wheels.prior)) {
      if (check_against(recording, wheels, rates, out)) break;
    }
  }
}

}  // namespace viwo::inspect
