#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "checks.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/plausibility/channel_change.hpp"

namespace viwo::inspect {

using series::Recording;
using series::Wheels;

namespace {

/// After how much the angle of a drive begins anew: its rates, which are differences of angles,
/// then jump back by it and are as before. 0: it does not.
double turn_of(const std::vector<EncoderSample>& samples, std::size_t drive) {
  std::vector<double> jumps;
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const double before = samples[i - 1].drive_rad_per_s[drive];
    const double after = samples[i + 1].drive_rad_per_s[drive];
    const double usual = 0.5 * (before + after);
    const double off = samples[i].drive_rad_per_s[drive] - usual;
    const double dt_s = seconds_between(samples[i].begin_ns, samples[i].end_ns);
    // Against the motion, and far from both neighbours, which agree.
    constexpr double kFar = 10., kLeast_rad = 0.5;
    const double differ = std::abs(before - after) + 0.05;
    if (off * usual >= 0. || std::abs(off) < kFar * differ || std::abs(off) * dt_s < kLeast_rad) {
      continue;
    }
    jumps.push_back(std::abs(off) * dt_s);
  }
  constexpr std::size_t kFewest = 3;
  if (jumps.size() < kFewest) return 0.;
  const double turn = eval::median(jumps);
  constexpr double kSame = 0.05;
  const auto same = std::count_if(jumps.begin(), jumps.end(), [turn](double jump) {
    return std::abs(jump - turn) < kSame * turn;
  });
  return 10 * same >= 9 * static_cast<std::ptrdiff_t>(jumps.size()) ? turn : 0.;
}

}  // namespace

void check_turns(const Recording& recording, Findings& out) {
  for (const Wheels& wheels : recording.wheels) {
    if (wheels.samples.empty()) continue;
    const auto n = static_cast<std::size_t>(wheels.model->description().n_drive);
    std::array<double, kMaxDrives> turns{};
    for (std::size_t i = 0; i < n; ++i) turns[i] = turn_of(wheels.samples, i);
    const auto first = std::find_if(turns.begin(), turns.end(), [](double t) { return t > 0.; });
    if (first == turns.end()) continue;
    out.push_back({recording.label<EncoderSample>(wheels.sensor),
                   Severity::kFault,
                   "turn",
                   "drive_" + std::to_string(first - turns.begin() + 1) + " jumps back by " +
                       significant(*first, 4) +
                       " again and again: its angle begins anew after a turn",
                   {{"turn", *first, "rad"}},
                   {{"sensors." + wheels.sensor + ".drive_turn",
                     yaml_list(n, [&](std::size_t i) { return significant(turns[i], 6); })}}});
  }
}

}  // namespace viwo::inspect
