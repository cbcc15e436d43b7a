#include "viwo/run/warnings.hpp"

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <Eigen/Cholesky>

#include "viwo/eval/hints.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/so3.hpp"
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
  // of a start that is off, unless it is most of them.
  constexpr std::int64_t kFewest = 40, kFewestOfMost = 20;
  constexpr double kGated = 0.05, kSigmas = 7.;
  std::vector<Contradiction> found;
  for (const UpdateTrack& update : updates) {
    const auto& [applied, rejected] = update.total;
    const std::int64_t of = applied + rejected;
    const double n = static_cast<double>(of);
    const double chance = kGated * n + kSigmas * std::sqrt(kGated * (1. - kGated) * n);
    const std::int64_t fewest = 2 * rejected > of ? kFewestOfMost : kFewest;
    if (of < fewest || 5 * rejected <= of || static_cast<double>(rejected) <= chance) continue;
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

bool has_gross_noise(const RunResult& result) {
  constexpr double kContradicts = 10.;  // no guess of a noise is so bad
  return std::ranges::any_of(
      result.noises, [](const NoiseFound& noise) { return factor_of(noise) > kContradicts; });
}

void add_findings(const Findings& findings, RunResult& result) {
  const bool contradicted = has_gross_noise(result);
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

namespace {

/// What a parameter has changed by; of a rotation, whose vector jumps at half a turn, by the angles
/// that the filter counts as its error.
double change_of(std::span<const CalibrationTrack> tracks, std::size_t i) {
  const CalibrationTrack& track = tracks[i];
  const double change = track.estimate.back() - track.estimate.front();
  const std::size_t axis = std::string_view("xyz").find(track.name.back());
  if (track.name.find("theta_") == std::string::npos || axis > std::min<std::size_t>(i, 2)) {
    return change;
  }
  const std::string stem = track.name.substr(0, track.name.size() - 1);
  Eigen::Vector3d first, last;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const std::size_t at = i - axis + static_cast<std::size_t>(k);
    if (at >= tracks.size() || tracks[at].name != stem + "xyz"[k]) return change;
    first[k] = tracks[at].estimate.front();
    last[k] = tracks[at].estimate.back();
  }
  const Eigen::Matrix3d dR = exp_so3(last) * exp_so3(first).transpose();
  return log_so3(dR)[static_cast<Eigen::Index>(axis)];
}

}  // namespace

void add_far_from_prior(const std::map<std::string, double>& sigmas_of, RunResult& result) {
  constexpr double kFar = 5., kHopeless = 10., kMuchScatter = 10.;
  const bool contradicted =
      has_gross_noise(result) ||
      std::ranges::any_of(result.calibration, [](const CalibrationTrack& track) {
        return track.scatter > kMuchScatter;
      });
  for (std::size_t i = 0; i < result.calibration.size(); ++i) {
    const CalibrationTrack& track = result.calibration[i];
    if (track.estimate.empty() || !(track.sigma.front() > 0.)) continue;
    const auto known = sigmas_of.find(track.name);
    const double sigmas = known != sigmas_of.end()
                              ? known->second
                              : std::abs(change_of(result.calibration, i)) / track.sigma.front();
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

void compare(const Trajectory& reference, const RunSetup& setup, RunResult& result) {
  try {
    result.accuracy = eval::evaluate(reference, result.estimate, setup.evaluation);
  } catch (const InputError& error) {
    result.warnings.push_back(std::string("no accuracy: ") + error.what());
    return;
  }
  for (std::string& line :
       eval::world_hints(reference, result.estimate, setup.evaluation, *result.accuracy)) {
    result.warnings.push_back("the reference and the estimate: " + std::move(line));
  }
  if (result.accuracy->n_in_gap <= result.accuracy->n_poses) return;
  result.warnings.push_back("accuracy is of " + std::to_string(result.accuracy->n_poses) + " of " +
                            std::to_string(result.accuracy->n_poses + result.accuracy->n_in_gap) +
                            " poses alone: the others lie in gaps of the reference of more than "
                            "evaluation.reference_max_gap_s");
}

}  // namespace viwo
