#include "viwo/plausibility/slip.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "viwo/eval/statistics.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/math/time_text.hpp"

namespace viwo {
namespace {

constexpr std::size_t kFewestOfAll = 40;
constexpr double kLeast_rad_per_s = 0.08;
constexpr double kMostOff = 1.5;    ///< a factor that wheels are wrong by
constexpr double kMostPart = 0.35;  ///< what is wrong more often is another fault than slip

/// By how much the gyro turns otherwise than wheels that may be wrong by a factor, and it by a
/// bias.
std::vector<double> differences(std::span<const TurnWindow> windows, double most_off = kMostOff) {
  constexpr double kTurns_rad_per_s = 0.1, kMostBias_rad_per_s = 0.1;
  std::vector<double> factors, left;
  for (const TurnWindow& w : windows) {
    if (std::abs(w.wheels) > kTurns_rad_per_s) factors.push_back(w.gyro / w.wheels);
  }
  const double factor =
      factors.empty() ? 1. : std::clamp(eval::median(factors), 1. / most_off, most_off);
  for (const TurnWindow& w : windows) left.push_back(w.gyro - factor * w.wheels);
  const double bias = std::clamp(eval::median(left), -kMostBias_rad_per_s, kMostBias_rad_per_s);
  for (double& one : left) one -= bias;
  return left;
}

std::vector<double> sizes_of(const std::vector<double>& values) {
  std::vector<double> sizes;
  for (const double value : values) sizes.push_back(std::abs(value));
  return sizes;
}

/// What sizes that are wrong and skidding make of a turn and of a way, rad/s.
double usual(const TurnWindow& window) {
  constexpr double kPartOfTurn = 0.45, kOfWay_rad_per_m = 0.06;
  return std::max(kPartOfTurn * std::abs(window.gyro), kOfWay_rad_per_m * window.speed_m_per_s);
}

/// Windows that follow each other, in all of which the wheels turn too much, or too little.
struct Stretch {
  std::size_t first = 0, count = 0;
  double turn_rad = 0.;
};

/// Of clocks as they are.
std::optional<Disagreement> disagreement(std::span<const TurnWindow> windows, double most_off) {
  constexpr double kTurns_rad_per_s = 0.1, kMoves_m_per_s = 0.05;
  const std::vector<double> left = differences(windows, most_off);
  std::vector<double> beyond;
  std::size_t moving = 0;
  for (std::size_t i = 0; i < left.size(); ++i) {
    const TurnWindow& w = windows[i];
    const bool turns = std::max(std::abs(w.gyro), std::abs(w.wheels)) > kTurns_rad_per_s;
    if (!turns && w.speed_m_per_s < kMoves_m_per_s) continue;
    ++moving;
    const double size = std::abs(left[i]);
    if (size > std::max(kLeast_rad_per_s, usual(w))) beyond.push_back(size);
  }
  if (moving < kFewestOfAll) return {};
  const double part = static_cast<double>(beyond.size()) / static_cast<double>(moving);
  if (part <= kMostPart) return {};
  return Disagreement{part, eval::median(beyond)};
}

}  // namespace

bool Slip::is_fault() const {
  constexpr double kFault_rad = 0.5;
  return std::abs(turn_rad) >= kFault_rad;
}

std::string Slip::text(const std::string& gyro, std::int64_t zero_ns,
                       const std::string& more) const {
  return "turns otherwise than " + gyro + " for " + significant(length_s, 2) + " s from " +
         time_text(from_ns - zero_ns) + " on, by " + significant(std::abs(turn_rad), 2) +
         " rad in all, and as it does otherwise" + more +
         ": a wheel slipped, was blocked or lifted, or its encoder stood still";
}

double usual_difference(std::span<const TurnWindow> windows) {
  return eval::median(sizes_of(differences(windows)));
}

std::optional<Disagreement> find_disagreement(std::span<const TurnWindow> windows,
                                              double tolerance) {
  if (windows.size() < kFewestOfAll) return {};
  const double most_off = std::max(kMostOff, 1. + tolerance);
  const std::optional<Disagreement> found = disagreement(windows, most_off);
  if (!found) return {};
  std::vector<TurnWindow> shifted(windows.begin(), windows.end());
  for (const bool is_early : {true, false}) {  // clocks that are off by a window
    for (std::size_t i = 1; i < windows.size(); ++i) {
      shifted[i - is_early].gyro = windows[i - !is_early].gyro;
    }
    if (!disagreement(shifted, most_off)) return {};
  }
  return found;
}

std::optional<Slip> find_slip(std::span<const TurnWindow> windows) {
  if (windows.size() < kFewestOfAll) return {};
  const std::vector<double> left = differences(windows);
  const std::vector<double> sizes = sizes_of(left);
  constexpr double kNormal = 1.4826, kSigmas = 8.;
  const double limit = std::max(kSigmas * kNormal * eval::median(sizes), kLeast_rad_per_s);
  Stretch longest, now;
  double beyond = 0.;
  for (std::size_t i = 0; i < left.size(); ++i) {
    const bool is_beyond = sizes[i] > std::max(limit, usual(windows[i]));
    const bool follows =
        i > 0 && windows[i].begin_ns - windows[i - 1].begin_ns == to_ns(kTurnWindow_s);
    const bool goes_on = now.count > 0 && follows && now.turn_rad * left[i] > 0.;
    if (is_beyond) beyond += 1.;
    if (!is_beyond) now = {};
    if (is_beyond && !goes_on) now = {i, 0, 0.};
    if (is_beyond) {
      ++now.count;
      now.turn_rad += kTurnWindow_s * left[i];
    }
    if (std::abs(now.turn_rad) > std::abs(longest.turn_rad)) longest = now;
  }
  // What is less is how wheels are.
  constexpr double kLeast_rad = 0.2;
  constexpr std::size_t kLeastWindows = 2;
  if (longest.count < kLeastWindows || std::abs(longest.turn_rad) < kLeast_rad ||
      beyond > kMostPart * static_cast<double>(left.size())) {
    return {};
  }
  return Slip{windows[longest.first].begin_ns, kTurnWindow_s * static_cast<double>(longest.count),
              longest.turn_rad};
}

}  // namespace viwo
