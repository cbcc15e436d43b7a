#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "viwo/eval/statistics.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/plausibility/channel_change.hpp"
#include "viwo/wheel/drive_ranges.hpp"
#include "viwo/wheel_checks/wheel_checks.hpp"

namespace viwo::inspect {

using series::Recording;
using series::Wheels;

namespace {

/// A rate that is far from those before and after it, which agree.
struct Jump {
  std::int64_t t_ns = 0;
  double dt_s = 0., rad = 0.;  ///< how long, and what it is off by in that time
  bool is_back = false;
};

std::vector<Jump> jumps_of(const std::vector<EncoderSample>& samples, std::size_t drive) {
  std::vector<Jump> jumps;
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const double before = samples[i - 1].drive_rad_per_s[drive];
    const double after = samples[i + 1].drive_rad_per_s[drive];
    const double usual = 0.5 * (before + after);
    const double off = samples[i].drive_rad_per_s[drive] - usual;
    const double dt_s = seconds_between(samples[i].begin_ns, samples[i].end_ns);
    const double rad = std::abs(off) * dt_s;
    constexpr double kFar = 10., kLeast_rad = 0.5;
    if (std::abs(off) < kFar * (std::abs(before - after) + 0.05) || rad < kLeast_rad) continue;
    jumps.push_back({samples[i].begin_ns, dt_s, rad, off * usual < 0.});
  }
  return jumps;
}

/// After how much the angle of a drive begins anew: its rates, which are differences of angles,
/// then jump back by it and are as before. 0: it does not.
double turn_of(const std::vector<Jump>& jumps) {
  std::vector<double> back;
  for (const Jump& jump : jumps) {
    if (jump.is_back) back.push_back(jump.rad);
  }
  constexpr std::size_t kFewest = 3;
  if (back.size() < kFewest) return 0.;
  const double turn = eval::median(back);
  constexpr double kSame = 0.05;
  const auto same = std::count_if(
      back.begin(), back.end(), [turn](double rad) { return std::abs(rad - turn) < kSame * turn; });
  return 10 * same >= 9 * static_cast<std::ptrdiff_t>(back.size()) ? turn : 0.;
}

/// What no wheel does.
void check_jumps(const Recording& recording, const Wheels& wheels, std::size_t drive,
                 const std::vector<Jump>& jumps, Findings& out) {
  constexpr double kMost_rad_per_s2 = 1000., kLeast_rad = 3.;
  const Jump* most = nullptr;
  double n = 0.;
  for (const Jump& jump : jumps) {
    if (jump.rad < kLeast_rad || jump.rad < kMost_rad_per_s2 * jump.dt_s * jump.dt_s) continue;
    n += 1.;
    if (most == nullptr || jump.rad > most->rad) most = &jump;
  }
  if (most == nullptr) return;
  out.push_back({recording.label<EncoderSample>(wheels.sensor),
                 Severity::kFault,
                 "jumps",
                 "drive_" + std::to_string(drive + 1) + " jumps by up to " +
                     significant(most->rad, 3) + " rad from one sample to the next (" +
                     significant(n, 6) + " times, most at " +
                     time_text(most->t_ns - recording.begin_ns()) +
                     "): its counter was set or ran over, or readings are wrong",
                 {{"jumps", n, ""}, {"largest", most->rad, "rad"}}});
}

/// Of the fastest drive over a tenth of a second from sample `first` on, or back (`step` -1): where
/// a counter is coarse, one sample is no speed.
double mean_fastest(std::span<const EncoderSample> samples, std::size_t first, int step) {
  constexpr double kOver_s = 0.1;
  std::array<double, kMaxDrives> turned_rad{};
  double sum_s = 0.;
  for (std::size_t i = first; i < samples.size() && sum_s < kOver_s;
       i += static_cast<std::size_t>(step)) {
    const double dt_s = seconds_between(samples[i].begin_ns, samples[i].end_ns);
    for (std::size_t k = 0; k < kMaxDrives; ++k) {
      turned_rad[k] += dt_s * samples[i].drive_rad_per_s[k];
    }
    sum_s += dt_s;
  }
  double most = 0.;
  for (const double rad : turned_rad) most = std::max(most, std::abs(rad));
  return sum_s > 0. ? most / sum_s : 0.;
}

/// No base stops within a sample, stands to the last bit, and goes on as fast as before.
void check_zeros(const Recording& recording, const Wheels& wheels, Findings& out) {
  constexpr double kLeast_s = 0.2, kFast_rad_per_s = 5., kMost_rad_per_s2 = 250.;
  const auto& samples = wheels.samples;
  double longest_s = 0., n = 0., rate = 0.;
  std::int64_t from_ns = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (fastest_of(samples[i]) > 0. || fastest_of(samples[i - 1]) < kFast_rad_per_s) continue;
    std::size_t end = i;
    while (end < samples.size() && fastest_of(samples[end]) == 0.) ++end;
    if (end == samples.size()) break;
    const double zero_s = seconds_between(samples[i].begin_ns, samples[end].begin_ns);
    const double before = fastest_of(samples[i - 1]), after = fastest_of(samples[end]);
    const double dt_s = seconds_between(samples[i].begin_ns, samples[i].end_ns);
    if (zero_s < kLeast_s || after < kFast_rad_per_s) continue;
    if (std::min(before, after) < kMost_rad_per_s2 * dt_s) continue;
    if (std::min(mean_fastest(samples, i - 1, -1), mean_fastest(samples, end, 1)) <
        kFast_rad_per_s) {
      continue;
    }
    n += 1.;
    if (zero_s <= longest_s) continue;
    longest_s = zero_s;
    from_ns = samples[i].begin_ns;
    rate = std::min(before, after);
  }
  if (n == 0.) return;
  out.push_back({recording.label<EncoderSample>(wheels.sensor),
                 Severity::kFault,
                 "zeros",
                 "all drives read exactly 0 for " + significant(longest_s, 2) + " s from " +
                     time_text(from_ns - recording.begin_ns()) + " on, and turn with " +
                     significant(rate, 2) + " rad/s right before and after (" + significant(n, 6) +
                     " times): readings were lost and zeros written for them",
                 {{"times", n, ""}, {"longest", longest_s, "s"}}});
}

}  // namespace

void check_turns(const Recording& recording, Findings& out) {
  for (const Wheels& wheels : recording.wheels) {
    if (wheels.samples.empty()) continue;
    check_zeros(recording, wheels, out);
    const auto n = static_cast<std::size_t>(wheels.model->description().n_drive);
    std::array<double, kMaxDrives> turns{};
    for (std::size_t i = 0; i < n; ++i) {
      const std::vector<Jump> jumps = jumps_of(wheels.samples, i);
      turns[i] = turn_of(jumps);
      if (turns[i] == 0.) check_jumps(recording, wheels, i, jumps, out);
    }
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
