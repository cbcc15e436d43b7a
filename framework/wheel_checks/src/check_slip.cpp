#include <cmath>
#include <string>
#include <vector>

#include "viwo/checks/clock_finding.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/plausibility/slip.hpp"
#include "viwo/series/lag.hpp"
#include "viwo/series/rate_grid.hpp"
#include "viwo/wheel/drive_ranges.hpp"
#include "viwo/wheel_checks/wheel_checks.hpp"

namespace viwo::inspect {

using series::RateGrid;
using series::Recording;
using series::Span;
using series::turns_of;
using series::twists_of;
using series::Wheels;
using series::YawRates;

namespace {

constexpr auto kWindow = static_cast<std::size_t>(kTurnWindow_s / RateGrid::kCell_s + 0.5);

std::vector<TurnWindow> windows_of(const RateGrid& gyro, const RateGrid& wheels, std::int64_t lag) {
  std::vector<TurnWindow> windows;
  for (std::size_t i = 0; i + kWindow <= gyro.size(); i += kWindow) {
    TurnWindow window{gyro.begin_ns() + static_cast<std::int64_t>(i) * RateGrid::kCellNs};
    std::size_t n = 0;
    for (std::size_t k = i; k < i + kWindow; ++k) {
      const std::int64_t j = static_cast<std::int64_t>(k) + lag;
      if (j < 0 || j >= static_cast<std::int64_t>(wheels.size())) continue;
      const auto of_wheels = static_cast<std::size_t>(j);
      if (!gyro.has(k) || !wheels.has(of_wheels)) continue;
      window += {0, gyro[k].z(), wheels[of_wheels].z(), wheels[of_wheels].head<2>().norm()};
      ++n;
    }
    if (5 * n < 4 * kWindow) continue;
    window /= static_cast<double>(n);
    windows.push_back(window);
  }
  return windows;
}

/// Slip looks like a lag where turns are alike: with the one that there is most of the time fits.
std::vector<TurnWindow> in_step(const RateGrid& gyro, const RateGrid& twists, double lag_s) {
  std::vector<TurnWindow> as_it_is = windows_of(gyro, twists, 0);
  std::vector<TurnWindow> shifted =
      windows_of(gyro, twists, std::llround(lag_s / RateGrid::kCell_s));
  if (as_it_is.empty() || shifted.size() < as_it_is.size() / 2) return as_it_is;
  return usual_difference(shifted) < usual_difference(as_it_is) ? shifted : as_it_is;
}

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
  const auto slip = find_slip(in_step(gyro, twists, lag ? lag->lag_s : 0.));
  if (!slip) return false;
  const std::int64_t inside_ns = to_ns(0.5 * kTurnWindow_s);
  const std::string constant = constant_drives(wheels, slip->from_ns + inside_ns,
                                               slip->from_ns + to_ns(slip->length_s) - inside_ns);
  out.push_back({recording.label<EncoderSample>(wheels.sensor),
                 slip->is_fault() ? Severity::kFault : Severity::kNote,
                 "slip",
                 slip->text(rates.label, recording.begin_ns(), constant),
                 {{"turn", slip->turn_rad, "rad"}, {"longest", slip->length_s, "s"}}});
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
