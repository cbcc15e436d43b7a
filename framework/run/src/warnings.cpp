#include "viwo/run/warnings.hpp"

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "viwo/math/significant.hpp"
#include "viwo/math/time_text.hpp"

namespace viwo {
namespace {

/// A place of the estimator's, "stamp 5000000 ns" or "t = 5.000 s .. t = 7.000 s", in times since
/// `begin_ns`.
std::string since(std::int64_t begin_ns, const std::string& place) {
  std::int64_t stamp_ns = 0;
  if (std::sscanf(place.c_str(), "stamp %" SCNd64 " ns", &stamp_ns) == 1) {
    return time_text(stamp_ns - begin_ns);
  }
  std::string text;
  std::size_t done = 0;
  for (std::size_t at = 0; (at = place.find("t = ", done)) != std::string::npos;) {
    char* end = nullptr;
    const double t_s = std::strtod(place.c_str() + at + 4, &end);
    text += place.substr(done, at - done) + time_text(std::llround(1e9 * t_s) - begin_ns);
    done = std::min(place.size(), static_cast<std::size_t>(end - place.c_str()) + 2);
  }
  return text + place.substr(done);
}

}  // namespace

std::vector<Contradiction> contradictions(const std::vector<UpdateTrack>& updates) {
  // Gates reject five percent at most (gate_probability) of what is good. A fifth, and seven sigmas
  // of the count more than that, is not by chance; of less than forty it may be the first seconds
  // of a start that is off.
  constexpr std::int64_t kFewest = 40;
  constexpr double kGated = 0.05, kSigmas = 7.;
  std::vector<Contradiction> found;
  for (const UpdateTrack& update : updates) {
    const auto& [applied, rejected] = update.total;
    const std::int64_t of = applied + rejected;
    const double n = static_cast<double>(of);
    const double chance = kGated * n + kSigmas * std::sqrt(kGated * (1. - kGated) * n);
    if (of < kFewest || 5 * rejected <= of || static_cast<double>(rejected) <= chance) continue;
    found.push_back({update.name,
                     update.name + ": " + std::to_string(rejected) + " of " + std::to_string(of) +
                         " rejected: what it measures and the rest contradict each other - check "
                         "calibration and axes of cameras and IMU, units, signs and order of the "
                         "joints, kinematics",
                     2 * rejected > of});
  }
  return found;
}

std::vector<std::string> suspicions(std::span<const RejectionCount> rejections,
                                    std::span<const NoiseFound> noises, std::int64_t begin_ns) {
  constexpr std::int64_t kFewest = 20;
  constexpr double kMostFactor = 3.;  // between a guess and what is found
  std::vector<std::string> lines;
  for (const RejectionCount& r : rejections) {
    if (r.of == 0 || r.count < kFewest || 5 * r.count < r.of) continue;
    lines.push_back(r.reason + " - " + std::to_string(r.count) + " of " + std::to_string(r.of) +
                    ", " + since(begin_ns, r.first));
  }
  for (const NoiseFound& noise : noises) {
    const double factor = noise.found / noise.configured;
    if (noise.count < kFewest || factor < kMostFactor) continue;
    lines.push_back(noise.name + ": " + significant(noise.found, 2) +
                    (noise.unit.empty() ? "" : " ") + noise.unit + " was found, " +
                    significant(noise.configured, 2) +
                    " is configured - what it measures is worse than thought, or calibration, "
                    "axes, units, signs, order or clock are wrong");
  }
  return lines;
}

std::vector<std::string> far_from_prior(const std::vector<CalibrationTrack>& calibration) {
  constexpr double kFar = 5.;
  std::vector<std::string> lines;
  for (const CalibrationTrack& track : calibration) {
    if (track.estimate.empty() || !(track.sigma.front() > 0.)) continue;
    const double sigmas =
        std::abs(track.estimate.back() - track.estimate.front()) / track.sigma.front();
    if (!(sigmas > kFar)) continue;
    lines.push_back(track.name + ": " + significant(track.estimate.back(), 4) + " " + track.unit +
                    " was found, " + significant(sigmas, 2) + " prior sigmas from " +
                    significant(track.estimate.front(), 4) +
                    ": its configuration is wrong, or what is next to it");
  }
  return lines;
}

void doubt_against_reference(RunResult& result) {
  constexpr std::int64_t kFewest = 10;
  if (!result.accuracy || result.accuracy->rpe.empty()) return;
  const auto shortest =
      std::min_element(result.accuracy->rpe.begin(), result.accuracy->rpe.end(),
                       [](const auto& a, const auto& b) { return a.length_m < b.length_m; });
  if (shortest->count < kFewest || !(shortest->mean_m > 0.5 * shortest->length_m)) return;
  result.doubts.push_back("the reference contradicts the estimate: after " +
                          eval::length_text(shortest->length_m) + " m it is off by " +
                          significant(shortest->mean_m, 3) + " m, mean of " +
                          std::to_string(shortest->count) +
                          " segments - units, signs, order or mount of a sensor are wrong, or of "
                          "the reference: viwo inspect tells which");
}

void warn_of_gaps(RunResult& result) {
  if (!result.accuracy || result.accuracy->n_in_gap <= result.accuracy->n_poses) return;
  result.warnings.push_back("accuracy is of " + std::to_string(result.accuracy->n_poses) + " of " +
                            std::to_string(result.accuracy->n_poses + result.accuracy->n_in_gap) +
                            " poses alone: the others lie in gaps of the reference of more than "
                            "evaluation.reference_max_gap_s");
}

}  // namespace viwo
