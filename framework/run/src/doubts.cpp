// Why the result of a run is not to be trusted.
#include <algorithm>
#include <cmath>

#include "viwo/eval/hints.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/run/warnings.hpp"

namespace viwo {
namespace {

constexpr double kAgrees = 0.1;

/// The error on segments by their length: the least of all lengths, and the largest.
struct SegmentParts {
  double least = 0., most = 0.;
  const eval::SegmentErrors* shortest = nullptr;  ///< null where no length has enough segments
  bool agree() const { return shortest != nullptr && most < kAgrees; }
};
SegmentParts segment_parts(const eval::Accuracy& accuracy) {
  constexpr std::int64_t kFewest = 10;
  SegmentParts parts;
  for (const eval::SegmentErrors& segment : accuracy.rpe) {
    if (segment.count < kFewest) continue;
    const double part = segment.mean_m / segment.length_m;
    const bool is_first = parts.shortest == nullptr;
    parts.least = is_first ? part : std::min(parts.least, part);
    parts.most = std::max(parts.most, part);
    if (is_first || segment.length_m < parts.shortest->length_m) parts.shortest = &segment;
  }
  return parts;
}

/// Updates that were given measurements and could use none of them; a doubt where no other could
/// (of a base that stands some have nothing to say).
void doubt_useless(RunResult& result) {
  const auto is_used = [](const UpdateTrack& update) { return update.total.applied > 0; };
  const bool is_alone = std::ranges::none_of(result.updates, is_used);
  for (const UpdateTrack& update : result.updates) {
    if (is_used(update)) continue;
    const RejectionCount* most = nullptr;
    for (const auto& [sensor, rejection] : result.rejections) {
      if (!rejection.reason.starts_with(update.name + ": ")) continue;
      if (rejection.count < (most == nullptr ? kFewestCounted : most->count)) continue;
      most = &rejection;
    }
    if (most == nullptr) continue;
    (is_alone ? result.doubts : result.warnings)
        .push_back("nothing of what " + update.name + " was given could be used; " +
                   std::to_string(most->count) + " x " +
                   most->reason.substr(update.name.size() + 2) +
                   (is_alone ? ": the estimate is that of the IMU alone" : ""));
  }
}

/// An estimate that the filter itself knows no better than a fifth of the way: that of the wheels
/// or of a reference, if it is shorter than its own. One that has run away has gone far.
void doubt_by_itself(const WheelsWay& wheels, RunResult& result) {
  // What the noise of wheels adds up to beside one that stands.
  constexpr double kLeast_m = 0.3, kPart = 0.2, kStanding_m_per_s = 0.002, kAll = 0.9;
  const double sigma_m = result.end_sigma.grown_m;
  if (result.updates.empty() || sigma_m < kLeast_m) return;
  double way_m = eval::way_m(result.estimate);
  if (result.accuracy) way_m = std::min(way_m, result.accuracy->path_length_m);
  if (wheels.duration_s > kAll * result.duration_s) way_m = std::min(way_m, wheels.length_m);
  if (sigma_m < kPart * way_m + kStanding_m_per_s * result.duration_s) return;
  result.doubts.push_back("the filter itself knows the position at the end to " +
                          significant(sigma_m, 2) + " m only, of a way of " +
                          significant(way_m, 2) +
                          " m: nothing tells some of the motion - one camera without parallax "
                          "(it stands, or only turns), no update that tells heights, or updates "
                          "that were given nothing");
}

/// Of wheels alone: they end up elsewhere than the reference.
std::string end_contradiction(const eval::Accuracy& accuracy) {
  constexpr double kLeast_m = 0.5, kPart = 0.25, kHalfTurn_deg = 180.;
  const bool is_far = accuracy.end_m > std::max(kLeast_m, kPart * accuracy.path_length_m);
  if (!is_far && !(std::abs(accuracy.end_yaw_deg) > kHalfTurn_deg)) return "";
  return "after " + significant(accuracy.path_length_m, 3) + " m the wheels are off by " +
         significant(accuracy.end_m, 3) + " m and " + significant(accuracy.end_yaw_deg, 3) +
         " deg of yaw";
}

/// How the reference contradicts the estimate; "" for not at all.
std::string reference_contradiction(const RunResult& result, const SegmentParts& parts) {
  constexpr double kContradicts = 0.5, kPartOfExtent = 0.3;
  const eval::Accuracy& a = *result.accuracy;
  const double extent = eval::extent_m(result.reference);
  const bool has_parts = parts.shortest != nullptr, is_filter = !result.updates.empty();
  // A body that is turned on the other, or has no orientation, goes where it goes all the same.
  if (has_parts && parts.least >= kContradicts && a.ate_m >= kPartOfExtent * extent) {
    return "after " + eval::length_text(parts.shortest->length_m) + " m it is off by " +
           significant(parts.shortest->mean_m, 3) + " m, mean of " +
           std::to_string(parts.shortest->count) + " segments";
  }
  if (has_parts && a.ate_m > extent && a.ate_m > kAgrees * a.path_length_m) {
    return "it is off by " + significant(a.ate_m, 3) +
           " m, root mean square, and who had stayed in the middle by " + significant(extent, 3) +
           " m";
  }
  // With a gyro, whatever the wheels are.
  if (has_parts && is_filter && parts.least >= kAgrees &&
      a.end_m > std::max(1., kAgrees * a.path_length_m)) {
    return "after " + eval::length_text(std::round(a.path_length_m)) + " m it is off by " +
           eval::length_text(std::round(a.end_m)) + " m";
  }
  if (parts.agree()) return "";
  std::string text = is_filter ? "" : end_contradiction(a);
  return text.empty() ? eval::size_contradiction(result.reference, result.estimate) : text;
}

}  // namespace

void doubt(RunResult& result, const WheelsWay& wheels_way) {
  const bool is_done = result.status == RunStatus::kOk;
  SegmentParts parts;
  if (result.accuracy) parts = segment_parts(*result.accuracy);
  for (Contradiction& found : contradictions(result.updates)) {
    const bool is_doubt = is_done && (found.is_most || has_gross_noise(result)) && !parts.agree();
    (is_doubt ? result.doubts : result.warnings).push_back(std::move(found.text));
  }
  if (!is_done) return;
  for (const UpdateTrack& update : result.updates) {
    if (!update.failures.disabled) continue;
    result.doubts.push_back("update '" + update.name +
                            "' was disabled: what it measures is missing from there on");
  }
  doubt_useless(result);
  const PreintegratedPose& wheels = result.total;
  if (result.updates.empty() && 2 * wheels.rejected > wheels.samples) {
    result.doubts.push_back(std::to_string(wheels.rejected) + " of " +
                            std::to_string(wheels.samples) +
                            " encoder samples are refused by the kinematic model");
  }
  constexpr double kMostUnseen = 0.2;
  if (result.updates.empty() && wheels.bridged_s > kMostUnseen * wheels.duration_s) {
    result.doubts.push_back("the wheels were not seen for " + significant(wheels.bridged_s, 3) +
                            " s of " + significant(wheels.duration_s, 3) +
                            " s, in which the mean of the readings before and after is taken: gaps "
                            "of the log, readings that are refused, or a log of what changes only");
  }
  doubt_by_itself(wheels_way, result);
  if (!result.accuracy) return;
  const std::string text = reference_contradiction(result, parts);
  if (text.empty()) return;
  result.doubts.push_back(
      "the reference contradicts the estimate: " + text +
      " - units, signs, order or mount of a sensor are wrong, or of "
      "the reference (viwo inspect tells which), or the calibration is far off");
}

}  // namespace viwo
