#include "segment_choice.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <map>
#include <string>
#include <tuple>

#include "viwo/math/median.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/run/parallel_for.hpp"

namespace viwo::calibration {
namespace {

constexpr std::size_t kFolds = 3;

/// Every third recording is left out in turn: by how much dead reckoning then misses their ends.
double predict(const CalibrationSetup& setup, const CalibrationOptions& options,
               const FitStart& start) {
  double squares = 0.;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < setup.recordings.size(); ++i) {
      if (i % kFolds != fold) used.push_back(i);
    }
    const CalibrationEstimate estimate = fit(setup, used, options, start);
    for (std::size_t i = fold; i < setup.recordings.size(); i += kFolds) {
      const RunResult run = dead_reckon(setup.recordings[i], estimate);
      if (run.accuracy) squares += run.accuracy->end_m * run.accuracy->end_m;
    }
  }
  return std::sqrt(squares / static_cast<double>(setup.recordings.size()));
}

std::vector<CalibrationOptions> candidates(const CalibrationSetup& setup) {
  const double interval_s = pose_interval_s(setup);
  double shortest_s = std::numeric_limits<double>::infinity();
  for (const CalibrationRecording& recording : setup.recordings) {
    const auto wheels = recording.data.wheels();
    shortest_s =
        std::min(shortest_s, seconds_between(wheels.front().begin_ns, wheels.back().end_ns));
  }
  CalibrationOptions options = setup.options;
  options.segments = Segments::kWhole;
  std::vector<CalibrationOptions> out{options};
  options.segments = Segments::kLength;
  for (const double length_s : {20., 10., 5., 2., 1., 0.5}) {
    if (length_s > 0.5 * shortest_s || length_s < 5. * interval_s) continue;
    options.segment_s = length_s;
    out.push_back(options);
  }
  // Poses that are rare may not be interpolated between.
  if (interval_s > 0.1 && std::isfinite(interval_s)) {
    options.segments = Segments::kPoses;
    options.segment_s = 0.;
    out.push_back(options);
  }
  return out;
}

}  // namespace

double pose_interval_s(const CalibrationSetup& setup) {
  std::vector<double> intervals_s;
  for (const CalibrationRecording& recording : setup.recordings) {
    const Trajectory& poses = recording.motion.poses;
    for (std::size_t i = 1; i < poses.size(); ++i) {
      intervals_s.push_back(seconds_between(poses[i - 1].t_ns, poses[i].t_ns));
    }
  }
  if (intervals_s.empty()) return std::numeric_limits<double>::infinity();
  return upper_median(intervals_s);
}

std::string segments_text(const CalibrationEstimate& estimate) {
  switch (estimate.segments) {
    case Segments::kPoses:
      return "pose to pose";
    case Segments::kLength:
      return significant(estimate.segment_s, 3) + " s";
    case Segments::kTrajectory:
      return "from the start, every " + significant(estimate.segment_s, 3) + " s";
    default:
      return "whole recordings";
  }
}

CalibrationOptions choose_segments(const CalibrationSetup& setup, const FitStart& start,
                                   CalibrationResult& result, WorkProgress& progress) {
  if (setup.options.segments != Segments::kAuto) return setup.options;
  if (setup.recordings.front().motion.kind == ReferenceKind::kNone) {
    CalibrationOptions options = setup.options;
    options.segments = Segments::kLength;
    options.segment_s = 1.;
    return options;
  }
  const std::vector<CalibrationOptions> all = candidates(setup);
  std::vector<CalibrationEstimate> estimates(all.size());
  std::vector<std::string> failures(all.size());
  const bool predicts = setup.recordings.size() >= kFolds &&
                        setup.recordings.front().motion.kind == ReferenceKind::kPoses;
  progress.begin("segment lengths", static_cast<int>(all.size()));
  parallel_for(all.size(), [&](std::size_t i) {
    estimates[i].segments = all[i].segments;
    estimates[i].segment_s = all[i].segment_s;
    const std::string text = "segments: " + segments_text(estimates[i]);
    try {
      estimates[i] = fit(setup, all_of(setup), all[i], start);
      if (predicts) estimates[i].prediction_m = predict(setup, all[i], start);
      progress.done(text);
    } catch (const std::exception& error) {
      failures[i] = error.what();
      progress.done(text + ": not compared");
    }
  });
  std::vector<CalibrationOptions> fitted;
  std::map<std::string, std::string> failed;  // which, by what is wrong with them
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (failures[i].empty()) {
      fitted.push_back(all[i]);
      result.lengths.push_back(estimates[i]);
    } else {
      std::string& which = failed[failures[i]];
      which += (which.empty() ? "" : ", ") + segments_text(estimates[i]);
    }
  }
  if (fitted.empty()) throw InputError(failures.front());
  for (const auto& [why, which] : failed) result.failed_lengths.push_back(which + ": " + why);
  const std::vector<CalibrationEstimate>& tried = result.lengths;
  const bool has_positions = setup.recordings.front().motion.kind == ReferenceKind::kPoses;
  const auto rank = [has_positions](const CalibrationEstimate& estimate) {
    const CalibrationNoise& noise = estimate.noise;
    const bool is_found = noise.yaw_is_found && (noise.position_is_found || !has_positions);
    return std::tuple(!estimate.converged, !is_found, !estimate.has_enough_residuals(),
                      estimate.prediction_m.value_or(0.), estimate.log_volume);
  };
  const auto best = std::min_element(
      tried.begin(), tried.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  return fitted[static_cast<std::size_t>(best - tried.begin())];
}

}  // namespace viwo::calibration
