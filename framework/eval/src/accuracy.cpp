#include "viwo/eval/accuracy.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <string>

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"
#include "viwo/eval/association.hpp"
#include "viwo/eval/hints.hpp"
#include "viwo/eval/json.hpp"
#include "viwo/eval/statistics.hpp"

namespace viwo::eval {

namespace {

constexpr double kDegPerRad = 180. / std::numbers::pi;

/// Path lengths are sums of many steps: an end point may miss its length by rounding, not by a
/// step.
constexpr double kLengthTolerance = 1e-9;

void check(const Options& options) {
  if (options.segment_stride < 1) throw InputError("segment_stride must be at least 1");
  if (!(options.max_reference_gap_s > 0.)) throw InputError("max_reference_gap_s must be positive");
  for (const double length_m : options.segment_lengths_m) {
    if (!(length_m > 0.) || !std::isfinite(length_m)) {
      throw InputError("segment length " + length_text(length_m) +
                       " m must be positive and finite");
    }
  }
}

double position_error_m(const PosePair& pair) {
  return (pair.estimate.p_BinW - pair.reference.p_BinW).norm();
}

double angle_error_deg(const PosePair& pair) {
  return pair.reference.q_BtoW.angularDistance(pair.estimate.q_BtoW) * kDegPerRad;
}

std::vector<PosePair> transformed(const std::vector<PosePair>& pairs,
                                  const RigidTransform& T_EtoR) {
  std::vector<PosePair> result = pairs;
  for (PosePair& pair : result) pair.estimate = T_EtoR * pair.estimate;
  return result;
}

std::vector<double> reference_path_m(const std::vector<PosePair>& pairs) {
  std::vector<double> path(pairs.size(), 0.);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    path[i] = path[i - 1] + (pairs[i].reference.p_BinW - pairs[i - 1].reference.p_BinW).norm();
  }
  return path;
}

/// Pose `to` as seen from pose `from`.
StampedPose relative(const StampedPose& from, const StampedPose& to) {
  const Eigen::Quaterniond q_WtoB = from.q_BtoW.conjugate();
  return {to.t_ns, q_WtoB * (to.p_BinW - from.p_BinW), q_WtoB * to.q_BtoW};
}

SegmentErrors segment_errors(const std::vector<PosePair>& pairs, const std::vector<double>& path_m,
                             double length_m, int stride) {
  std::vector<double> errors_m;
  std::vector<double> errors_deg;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < pairs.size(); begin += static_cast<std::size_t>(stride)) {
    const double wanted = length_m * (1. - kLengthTolerance);
    while (end < pairs.size() && path_m[end] - path_m[begin] < wanted) ++end;
    if (end == pairs.size()) break;
    const PosePair motion{relative(pairs[begin].reference, pairs[end].reference),
                          relative(pairs[begin].estimate, pairs[end].estimate)};
    errors_m.push_back(position_error_m(motion));
    errors_deg.push_back(angle_error_deg(motion));
  }
  return {length_m,         static_cast<std::int64_t>(errors_m.size()),
          mean(errors_m),   root_mean_square(errors_m),
          mean(errors_deg), root_mean_square(errors_deg)};
}

/// The two longest of 1, 2.5, 5, 10, .. that the path has at least three of, the shorter one first.
std::vector<double> lengths_of(double path_m) {
  constexpr double kFewest = 3.;
  std::vector<double> lengths_m;
  // In centimetres, which are exact.
  for (double decade_cm = 1.; decade_cm < 1e11; decade_cm *= 10.) {
    for (const double step : {1., 2.5, 5.}) {
      const double length_m = step * decade_cm / 100.;
      if (kFewest * length_m <= path_m) lengths_m.push_back(length_m);
    }
  }
  if (lengths_m.size() > 2) lengths_m.erase(lengths_m.begin(), lengths_m.end() - 2);
  return lengths_m;
}

/// Where the first poses coincide, as far as the alignment leaves the two worlds open.
RigidTransform align_first(std::span<const PosePair> first, Alignment alignment) {
  return align(first, alignment == Alignment::kSe3 ? Alignment::kStart : alignment);
}

/// Whether the reference gives the same orientation all the time while the estimate turns, and
/// bends or goes where the estimate goes: who goes straight on may well not turn.
bool are_positions_alone(const std::vector<PosePair>& pairs) {
  constexpr double kTurns_rad = 0.5, kPart = 0.05, kLeast_m = 0.5;
  bool turns = false;
  for (const PosePair& pair : pairs) {
    const PosePair& first = pairs.front();
    if (pair.reference.q_BtoW.angularDistance(first.reference.q_BtoW) > 1e-6) return false;
    turns = turns || pair.estimate.q_BtoW.angularDistance(first.estimate.q_BtoW) > kTurns_rad;
  }
  if (!turns) return false;
  Trajectory reference;
  std::vector<double> errors_m;
  for (const PosePair& pair : transformed(pairs, align(pairs, Alignment::kYawPosition))) {
    reference.push_back(pair.reference);
    errors_m.push_back(position_error_m(pair));
  }
  const double extent = extent_m(reference);
  return (bends(reference) && extent > kLeast_m) || root_mean_square(errors_m) < kPart * extent;
}

/// A reference without orientations gets those of the estimate, in its world.
void give_orientations(std::vector<PosePair>& pairs, Alignment& alignment) {
  if (alignment == Alignment::kStart) alignment = Alignment::kYawPosition;
  const RigidTransform T_EtoR = align(pairs, alignment);
  for (PosePair& pair : pairs) pair.reference.q_BtoW = (T_EtoR * pair.estimate).q_BtoW;
}

void forget_orientations(Accuracy& result) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  result.ate_deg = result.end_deg = result.end_yaw_deg = kNone;
  for (SegmentErrors& errors : result.rpe) errors.mean_deg = errors.rmse_deg = kNone;
  std::ranges::fill(result.series.yaw_error_deg, kNone);
}

ErrorSeries error_series(const std::vector<PosePair>& pairs, const std::vector<double>& path_m) {
  ErrorSeries series;
  series.path_length_m = path_m;
  double previous_rad = 0.;
  for (const PosePair& pair : pairs) {
    series.t_s.push_back(seconds_between(pairs.front().estimate.t_ns, pair.estimate.t_ns));
    series.position_error_m.push_back(position_error_m(pair));
    const double error_rad = yaw(pair.estimate.q_BtoW) - yaw(pair.reference.q_BtoW);
    // The branch nearest to the previous error: a drift beyond half a turn stays a drift.
    previous_rad += std::remainder(error_rad - previous_rad, 2. * std::numbers::pi);
    series.yaw_error_deg.push_back(previous_rad * kDegPerRad);
  }
  return series;
}

}  // namespace

Accuracy evaluate(const Trajectory& reference, const Trajectory& estimate, const Options& asked) {
  check(asked);
  Association common = associate(reference, estimate, asked.max_reference_gap_s);
  Options options = asked;
  const bool has_orientations = !are_positions_alone(common.pairs);
  if (!has_orientations) give_orientations(common.pairs, options.alignment);
  const std::vector<double> path_m = reference_path_m(common.pairs);

  Accuracy result;
  result.alignment = options.alignment;
  result.n_poses = static_cast<std::int64_t>(common.pairs.size());
  result.n_outside = common.n_outside;
  result.n_in_gap = common.n_in_gap;
  result.duration_s =
      seconds_between(common.pairs.front().estimate.t_ns, common.pairs.back().estimate.t_ns);
  result.path_length_m = path_m.back();

  std::vector<double> errors_m;
  std::vector<double> errors_deg;
  for (const PosePair& pair : transformed(common.pairs, align(common.pairs, options.alignment))) {
    errors_m.push_back(position_error_m(pair));
    errors_deg.push_back(angle_error_deg(pair));
  }
  result.ate_m = root_mean_square(errors_m);
  result.ate_deg = root_mean_square(errors_deg);

  const std::vector<double> lengths_m = options.segment_lengths_m.empty()
                                            ? lengths_of(result.path_length_m)
                                            : options.segment_lengths_m;
  for (const double length_m : lengths_m) {
    result.rpe.push_back(segment_errors(common.pairs, path_m, length_m, options.segment_stride));
  }

  const std::vector<PosePair> from_start =
      transformed(common.pairs, align_first({common.pairs.data(), 1}, options.alignment));
  result.series = error_series(from_start, path_m);
  result.end_m = position_error_m(from_start.back());
  result.end_deg = angle_error_deg(from_start.back());
  result.end_yaw_deg = result.series.yaw_error_deg.back();
  if (!has_orientations) forget_orientations(result);
  return result;
}

Trajectory aligned(const Trajectory& reference, Trajectory estimate, Alignment alignment) {
  if (alignment == Alignment::kNone) return estimate;
  std::vector<PosePair> pairs;
  for (const StampedPose& pose : estimate) {
    constexpr double kAnyGap = std::numeric_limits<double>::infinity();
    if (const auto at = interpolate(reference, pose.t_ns, kAnyGap)) pairs.push_back({*at, pose});
  }
  if (pairs.empty()) return estimate;
  const RigidTransform T_EtoR = align(pairs, alignment);
  for (StampedPose& pose : estimate) pose = T_EtoR * pose;
  return estimate;
}

std::string length_text(double length_m) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), length_m).ptr;
  return {buffer.data(), end};
}

nlohmann::json to_json(const Accuracy& accuracy) {
  nlohmann::json rpe = nlohmann::json::object();
  for (const SegmentErrors& errors : accuracy.rpe) {
    nlohmann::json& entry = rpe[length_text(errors.length_m)];
    if (errors.count == 0) continue;
    entry = {{"m", number_or_null(errors.mean_m)},
             {"deg", number_or_null(errors.mean_deg)},
             {"rmse_m", number_or_null(errors.rmse_m)},
             {"rmse_deg", number_or_null(errors.rmse_deg)},
             {"count", errors.count}};
  }
  return {{"alignment", name(accuracy.alignment)},
          {"poses", accuracy.n_poses},
          {"poses_outside_reference", accuracy.n_outside},
          {"poses_in_reference_gap", accuracy.n_in_gap},
          {"duration_s", number_or_null(accuracy.duration_s)},
          {"path_length_m", number_or_null(accuracy.path_length_m)},
          {"ate_m", number_or_null(accuracy.ate_m)},
          {"ate_deg", number_or_null(accuracy.ate_deg)},
          {"rpe", std::move(rpe)},
          {"end",
           {{"m", number_or_null(accuracy.end_m)},
            {"deg", number_or_null(accuracy.end_deg)},
            {"yaw_deg", number_or_null(accuracy.end_yaw_deg)}}}};
}

}  // namespace viwo::eval
