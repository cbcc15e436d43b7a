#include "viwo/eval/association.hpp"

#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include "viwo/api/status.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::eval {

namespace {

/// Quaternions come from files with a few decimals; anything beyond that is no rotation.
constexpr double kMaxNormError = 1e-3;

StampedPose with_unit_norm(StampedPose pose) {
  pose.q_BtoW.normalize();
  return pose;
}

/// "12.345": seconds, cut to milliseconds by integer arithmetic.
std::string seconds(std::int64_t t_ns) {
  const bool negative = t_ns < 0;
  const std::int64_t t_ms = (negative ? -t_ns : t_ns) / 1'000'000;
  std::string text = negative ? "-" : "";
  text += std::to_string(t_ms / 1000);
  text += '.';
  text += std::to_string(1000 + t_ms % 1000).substr(1);
  return text;
}

std::string time_range(const Trajectory& trajectory) {
  return seconds(trajectory.front().t_ns) + " s to " + seconds(trajectory.back().t_ns) + " s";
}

void check(const Trajectory& trajectory, const std::string& name) {
  if (trajectory.empty()) throw InputError("the " + name + " trajectory is empty");
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const StampedPose& pose = trajectory[i];
    const std::string which = "pose " + std::to_string(i + 1) + " of the " + name;
    if (!pose.p_BinW.allFinite() || !pose.q_BtoW.coeffs().allFinite()) {
      throw InputError(which + " is not finite");
    }
    if (std::abs(pose.q_BtoW.norm() - 1.) > kMaxNormError) {
      throw InputError("the quaternion of " + which + " does not have unit norm");
    }
    if (i > 0 && pose.t_ns <= trajectory[i - 1].t_ns) {
      throw InputError(which + " is not later than the one before it (" + seconds(pose.t_ns) +
                       " s after " + seconds(trajectory[i - 1].t_ns) + " s)");
    }
  }
}

}  // namespace

Association associate(const Trajectory& reference, const Trajectory& estimate, double max_gap_s) {
  check(reference, "reference");
  check(estimate, "estimate");
  Association result;
  result.pairs.reserve(estimate.size());
  for (const StampedPose& pose : estimate) {
    if (pose.t_ns < reference.front().t_ns || pose.t_ns > reference.back().t_ns) {
      ++result.n_outside;
    } else if (const std::optional<StampedPose> at = interpolate(reference, pose.t_ns, max_gap_s)) {
      result.pairs.push_back({with_unit_norm(*at), with_unit_norm(pose)});
    } else {
      ++result.n_in_gap;
    }
  }
  if (!result.pairs.empty()) return result;
  const std::string ranges =
      "reference from " + time_range(reference) + ", estimate from " + time_range(estimate);
  if (result.n_in_gap == 0) {
    throw InputError("no pose of the estimate lies in the time of the reference: " + ranges);
  }
  throw InputError(
      "the reference has no pose near any pose of the estimate: its gaps are longer than " +
      significant(max_gap_s, 3) + " s (" + ranges +
      ") - viwo evaluate --max-gap SECONDS, evaluation.reference_max_gap_s of a run");
}

}  // namespace viwo::eval
