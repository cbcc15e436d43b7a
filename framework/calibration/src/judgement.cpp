#include "judgement.hpp"

#include <cmath>

#include "segment_choice.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::calibration {
namespace {

/// Prior sigmas from the nominal value that are strange, and that nobody would believe.
constexpr double kStrange = 3., kUnbelievable = 5.;
/// A solution of the search is the only one when every other is worse by this factor.
constexpr double kOnlyOne = 1.2;
/// Sigmas by which estimates of two lengths of segments may differ.
constexpr double kSameEstimate = 3.;
/// Sigmas of the model that the wheels may contradict each other by.
constexpr double kQuiet = 3.;

const std::vector<IntrinsicSpec>& specs_of(const CalibrationResult& result) {
  return result.setup->recordings.front().setup.model->description().intrinsics;
}

void judge_search(CalibrationResult& result) {
  const JointSearch& search = result.search;
  if (search.drive_signs.empty() || search.other_cost > kOnlyOne * search.cost) return;
  std::string other;
  for (const int zero : search.zeros) {
    other += (other.empty() ? "" : ", ") + specs_of(result)[static_cast<std::size_t>(zero)].name +
             " = " + significant(search.other[zero], 3) + " rad";
  }
  result.doubts.push_back("another solution of the joints fits as well" +
                          (other.empty() ? "" : ": " + other) +
                          " - drive so that the base turns while it moves, to all sides");
}

void judge_change(CalibrationResult& result) {
  const auto& specs = specs_of(result);
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const auto& zeros = result.search.zeros;
    if (std::find(zeros.begin(), zeros.end(), static_cast<int>(i)) != zeros.end()) continue;
    const double value = result.all.x_WI[k];
    if (std::min(value - specs[i].lowest, specs[i].highest - value) < 0.01 * specs[i].prior_sigma) {
      result.doubts.push_back(
          specs[i].name + " has gone to its bound " + significant(value, 3) +
          ": a base that is mirrored, or joints that are exchanged or reversed");
    }
    const double change = (result.all.x_WI[k] - specs[i].nominal) / specs[i].prior_sigma;
    if (std::abs(change) < kStrange) continue;
    auto& list = std::abs(change) < kUnbelievable ? result.warnings : result.doubts;
    list.push_back(specs[i].name + " is " + significant(std::abs(change), 2) +
                   " prior sigmas from its nominal value: a wrong nominal value, a prior that is "
                   "too narrow, or joints, units or clocks that are wrong");
  }
}

/// A fit that leaves a good part of the motion has the wrong robot.
void judge_left_over(CalibrationResult& result) {
  constexpr double kPart = 0.1, kLeast_rad = 0.02, kLeast_m = 0.02;
  const CalibrationEstimate& all = result.all;
  const auto doubt = [&](double left, double moved, double least, const std::string& what) {
    if (left < least || left < kPart * moved) return;
    result.doubts.push_back("the wheels do not move as the reference does: " + what + " of " +
                            significant(moved, 2) + " in a segment " + significant(left, 2) +
                            " is left - drives that turn backwards, zeros, units, channels that "
                            "are exchanged, or clocks (find_drive_signs, find_steering_zeros, "
                            "prior_sigma_clock_offset_s)");
  };
  const ReferenceKind kind = result.setup->recordings.front().motion.kind;
  if (kind == ReferenceKind::kNone) return;
  doubt(all.noise.yaw_rad, all.turn_rms_rad, kLeast_rad, "of turns [rad]");
  if (kind == ReferenceKind::kPoses) {
    doubt(all.noise.position_m, all.way_rms_m, kLeast_m, "of ways [m]");
  }
}

void judge_lengths(CalibrationResult& result) {
  const auto& specs = specs_of(result);
  for (const CalibrationEstimate& other : result.lengths) {
    double most = 0.;
    std::size_t which = 0;
    for (std::size_t i = 0; i < specs.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const double sigma = std::max(other.sigma[k], result.all.sigma[k]);
      const double change = sigma > 0. ? std::abs(other.x_WI[k] - result.all.x_WI[k]) / sigma : 0.;
      if (change > most) {
        most = change;
        which = i;
      }
    }
    if (most < kSameEstimate) continue;
    result.warnings.push_back("the estimate depends on what is compared: with " +
                              segments_text(other) + " " + specs[which].name + " differs by " +
                              significant(most, 2) + " sigmas from that with " +
                              segments_text(result.all));
  }
}

}  // namespace

void judge(CalibrationResult& result) {
  const CalibrationEstimate& all = result.all;
  if (!all.converged) result.doubts.push_back("the fit did not converge");
  if (!all.has_enough_residuals()) {
    result.doubts.push_back("only " + std::to_string(all.residuals) + " residuals for " +
                            std::to_string(all.unknowns - all.parity_directions) +
                            " unknowns that the wheels among themselves do not tell: more or "
                            "longer recordings, or segments: auto");
  }
  judge_search(result);
  judge_left_over(result);
  judge_change(result);
  judge_lengths(result);
  if (all.noise.parity_scale > kQuiet) {
    result.warnings.push_back("the wheels contradict each other by " +
                              significant(all.noise.parity_scale, 2) +
                              " times what the model's sigmas say: slip, play, or sigmas that are "
                              "too small for this base");
  }
}

}  // namespace viwo::calibration
