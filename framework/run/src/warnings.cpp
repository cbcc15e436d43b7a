#include "viwo/run/warnings.hpp"

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <Eigen/Cholesky>

#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
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
    text += place.substr(done, at - done) + time_text(to_ns(t_s) - begin_ns);
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
                         "calibration, axes, units and noise of both, order and signs of joints, "
                         "kinematics",
                     2 * rejected > of});
  }
  return found;
}

namespace {

constexpr std::int64_t kFewestCounted = 20;  ///< rejections, or measurements of a noise

/// What is found of a noise by what is configured; 0 where it is of too little.
double factor_of(const NoiseFound& noise) {
  return noise.count < kFewestCounted ? 0. : noise.found / noise.configured;
}

std::string text_of(const RejectionCount& r, std::int64_t begin_ns) {
  return r.reason + " - " + std::to_string(r.count) + " of " + std::to_string(r.of) + ", " +
         since(begin_ns, r.first);
}

bool is_nearly_all(const RejectionCount& r) { return r.of > 0 && 10 * r.count >= 9 * r.of; }

}  // namespace

std::vector<std::string> refused_altogether(std::span<const RejectionCount> rejections,
                                            std::int64_t begin_ns) {
  std::vector<std::string> lines;
  for (const RejectionCount& r : rejections) {
    if (r.count >= kFewestCounted && is_nearly_all(r)) lines.push_back(text_of(r, begin_ns));
  }
  return lines;
}

std::vector<std::string> suspicions(std::span<const RejectionCount> rejections,
                                    std::span<const NoiseFound> noises, std::int64_t begin_ns) {
  constexpr double kMostFactor = 3.;  // between a guess and what is found
  std::vector<std::string> lines;
  for (const RejectionCount& r : rejections) {
    if (r.count < kFewestCounted || 5 * r.count < r.of || r.of == 0 || is_nearly_all(r)) continue;
    lines.push_back(text_of(r, begin_ns));
  }
  for (const NoiseFound& noise : noises) {
    if (factor_of(noise) < kMostFactor) continue;
    lines.push_back(noise.name + ": " + significant(noise.found, 2) +
                    (noise.unit.empty() ? "" : " ") + noise.unit + " was found, " +
                    significant(noise.configured, 2) +
                    " is configured - what it measures is worse than thought, or calibration, "
                    "axes, units, signs, order or clock are wrong");
  }
  return lines;
}

namespace {

/// The filter has found by itself that something is wrong with the configuration.
bool is_contradicted(const RunResult& result) {
  constexpr double kContradicts = 10.;  // no guess of a noise is so bad
  return std::ranges::any_of(
      result.noises, [](const NoiseFound& noise) { return factor_of(noise) > kContradicts; });
}

}  // namespace

void add_findings(const Findings& findings, RunResult& result) {
  const bool contradicted = is_contradicted(result);
  for (const Finding& finding : findings) {
    const bool is_doubt = finding.is_doubt || (contradicted && !finding.remedies.empty());
    (is_doubt ? result.doubts : result.warnings).push_back(finding.text);
  }
}

std::map<std::string, double> sigmas_from_prior(const FilterSetup& filter,
                                                std::span<const CalibrationTrack> tracks) {
  std::map<std::string, double> all;
  for (const WheelSet& set : filter.wheels) {
    if (set.correlations.size() == 0) continue;  // each is known by itself
    const std::vector<IntrinsicSpec>& specs = set.model->description().intrinsics;
    const std::string prefix = set.prior.name.empty() ? "" : set.prior.name + ".";
    Eigen::VectorXd change(set.model->n_intrinsics());
    std::vector<int> free;
    for (std::size_t i = 0; i < specs.size(); ++i) {
      const auto k = static_cast<int>(i);
      const auto track = std::ranges::find(tracks, prefix + specs[i].name, &CalibrationTrack::name);
      if (track == tracks.end() || track->estimate.empty()) continue;
      const double sigma = set.prior.sigma_intrinsics[k];
      if (!(sigma > 0.)) continue;
      change[k] = (track->estimate.back() - track->estimate.front()) / sigma;
      free.push_back(k);
    }
    // Where one follows from others, none is by itself.
    constexpr double kFollows = 1e-9;
    Eigen::MatrixXd C = set.correlations(free, free);
    C.diagonal().array() -= kFollows;
    const Eigen::LLT<Eigen::MatrixXd> llt(C);
    if (free.empty() || llt.info() != Eigen::Success) continue;
    const Eigen::MatrixXd information = llt.solve(Eigen::MatrixXd::Identity(C.rows(), C.cols()));
    const Eigen::VectorXd left = information * change(free);
    for (std::size_t i = 0; i < free.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      all[prefix + specs[static_cast<std::size_t>(free[i])].name] =
          std::abs(left[k]) / std::sqrt(information(k, k));
    }
  }
  return all;
}

void add_far_from_prior(const std::map<std::string, double>& sigmas_of, RunResult& result) {
  constexpr double kFar = 5., kHopeless = 10.;
  const bool contradicted = is_contradicted(result);
  for (const CalibrationTrack& track : result.calibration) {
    if (track.estimate.empty() || !(track.sigma.front() > 0.)) continue;
    const auto known = sigmas_of.find(track.name);
    const double sigmas =
        known != sigmas_of.end()
            ? known->second
            : std::abs(track.estimate.back() - track.estimate.front()) / track.sigma.front();
    if (!(sigmas > kFar)) continue;
    auto& lines = contradicted || sigmas > kHopeless ? result.doubts : result.warnings;
    lines.push_back(track.name + ": " + significant(track.estimate.back(), 4) + " " + track.unit +
                    " was found, " + significant(sigmas, 2) + " prior sigmas from " +
                    significant(track.estimate.front(), 4) +
                    ": its configuration is wrong, or what is next to it");
  }
}

namespace {

/// Whether one of them is of wheels that are taken for constant.
bool are_of_wheels(std::span<const CalibrationTrack* const> tracks, const RunResult& result) {
  const auto wanders = [](const CalibrationTrack& track) {
    return track.name.find("wander_") != std::string::npos;
  };
  if (!result.final_calibration || std::ranges::any_of(result.calibration, wanders)) return false;
  const CalibrationFile& file = *result.final_calibration;
  return std::ranges::any_of(tracks, [&](const CalibrationTrack* track) {
    return find(file.intrinsics, track->name) != nullptr ||
           find(file.mount, track->name) != nullptr;
  });
}

}  // namespace

std::vector<std::string> too_sure(const RunResult& result) {
  constexpr double kMuch = 2.;
  std::vector<const CalibrationTrack*> tracks;
  for (const CalibrationTrack& track : result.calibration) {
    if (track.scatter > kMuch) tracks.push_back(&track);
  }
  if (tracks.empty()) return {};
  std::ranges::stable_sort(tracks, [](auto* a, auto* b) { return a->scatter > b->scatter; });
  constexpr std::size_t kNamed = 3;
  std::string text = "calibration: surer than it ought to be, by the way it moves: ";
  for (std::size_t i = 0; i < std::min(tracks.size(), kNamed); ++i) {
    text += (i == 0 ? "" : ", ") + tracks[i]->name + " " + significant(tracks[i]->scatter, 2) +
            " times";
  }
  if (tracks.size() > kNamed) text += ", and " + std::to_string(tracks.size() - kNamed) + " more";
  text +=
      " (scatter in summary.json; calibration.yaml has their sigmas times that) - what is "
      "measured is off for seconds on end: slip, tyres, images of one side";
  if (are_of_wheels(tracks, result)) {
    text += "; wheels.intrinsics_wander: 0.5 lets the filter reckon with wheels that give way";
  }
  return {text};
}

namespace {

/// Root mean square distance of a trajectory from its middle.
double extent_m(const Trajectory& poses) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const auto n = static_cast<double>(poses.size());
  for (const StampedPose& pose : poses) mean += pose.p_BinW / n;
  double squares = 0.;
  for (const StampedPose& pose : poses) squares += (pose.p_BinW - mean).squaredNorm() / n;
  return std::sqrt(squares);
}

/// One goes many times as far as the other, as in other units; "" if they do not. Of poses that
/// both have.
std::string size_contradiction(const RunResult& result) {
  constexpr double kFar_m = 0.5, kMany = 5., kMostGap_s = 0.5;
  Trajectory reference, estimate;
  for (const StampedPose& pose : result.estimate) {
    const auto at = interpolate(result.reference, pose.t_ns, kMostGap_s);
    if (!at) continue;
    reference.push_back(*at);
    estimate.push_back(pose);
  }
  const double reference_m = extent_m(reference), estimate_m = extent_m(estimate);
  const double larger = std::max(reference_m, estimate_m);
  if (!(larger > kFar_m && larger > kMany * std::min(reference_m, estimate_m))) return "";
  return "it goes " + significant(reference_m, 3) +
         " m from its middle, root mean square, and the estimate " + significant(estimate_m, 3) +
         " m";
}

/// The error on segments by their length: the least of all lengths, and the largest.
struct SegmentParts {
  double least = 0., most = 0.;
  const eval::SegmentErrors* shortest = nullptr;  ///< null where no length has enough segments
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

}  // namespace

namespace {

/// Updates that were given measurements and could use none of them; a doubt where no other could.
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

/// An estimate that the filter itself knows no better than half of the way that it tells.
void doubt_by_itself(RunResult& result) {
  constexpr double kLeast_m = 0.1, kPart = 0.5;
  const double sigma_m = result.end_sigma.grown_m;
  if (result.updates.empty() || sigma_m < kLeast_m) return;
  double way_m = 0.;
  for (std::size_t i = 1; i < result.estimate.size(); ++i) {
    way_m += (result.estimate[i].p_BinW - result.estimate[i - 1].p_BinW).norm();
  }
  if (sigma_m < kPart * way_m) return;
  result.doubts.push_back("the filter itself knows the position at the end to " +
                          significant(sigma_m, 2) + " m only, of a way of " +
                          significant(way_m, 2) +
                          " m: nothing tells how fast it goes - one camera without parallax (it "
                          "stands, or only turns), or updates that were given nothing");
}

}  // namespace

void doubt(RunResult& result) {
  const bool is_done = result.status == RunStatus::kOk;
  SegmentParts parts;
  if (result.accuracy) parts = segment_parts(*result.accuracy);
  constexpr double kAgrees = 0.1, kContradicts = 0.5, kPartOfExtent = 0.3;
  const bool agrees = parts.shortest != nullptr && parts.most < kAgrees;
  for (Contradiction& found : contradictions(result.updates)) {
    const bool is_doubt = is_done && found.is_most && !agrees;
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
  doubt_by_itself(result);
  if (parts.shortest == nullptr) return;
  const double ate_m = result.accuracy->ate_m, extent = extent_m(result.reference);
  std::string text;
  // A body that is turned on the other, or has no orientation, goes where it goes all the same.
  if (parts.least >= kContradicts && ate_m >= kPartOfExtent * extent) {
    text = "after " + eval::length_text(parts.shortest->length_m) + " m it is off by " +
           significant(parts.shortest->mean_m, 3) + " m, mean of " +
           std::to_string(parts.shortest->count) + " segments";
  } else if (ate_m > extent && ate_m > kAgrees * result.accuracy->path_length_m) {
    text = "it is off by " + significant(ate_m, 3) +
           " m, root mean square, and who had stayed in the middle by " + significant(extent, 3) +
           " m";
  } else if (!result.updates.empty() && parts.least >= kAgrees &&
             result.accuracy->end_m > std::max(1., kAgrees * result.accuracy->path_length_m)) {
    // With a gyro, whatever the wheels are.
    text = "after " + eval::length_text(std::round(result.accuracy->path_length_m)) +
           " m it is off by " + eval::length_text(std::round(result.accuracy->end_m)) + " m";
  } else if (!agrees) {
    text = size_contradiction(result);
  }
  if (text.empty()) return;
  result.doubts.push_back("the reference contradicts the estimate: " + text +
                          " - units, signs, order or mount of a sensor are wrong, or of "
                          "the reference: viwo inspect tells which");
}

void compare(const Trajectory& reference, const RunSetup& setup, RunResult& result) {
  try {
    result.accuracy = eval::evaluate(reference, result.estimate, setup.evaluation);
  } catch (const InputError& error) {
    result.warnings.push_back(std::string("no accuracy: ") + error.what());
    return;
  }
  if (result.accuracy->n_in_gap <= result.accuracy->n_poses) return;
  result.warnings.push_back("accuracy is of " + std::to_string(result.accuracy->n_poses) + " of " +
                            std::to_string(result.accuracy->n_poses + result.accuracy->n_in_gap) +
                            " poses alone: the others lie in gaps of the reference of more than "
                            "evaluation.reference_max_gap_s");
}

}  // namespace viwo
