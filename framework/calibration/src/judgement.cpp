#include "judgement.hpp"

#include <algorithm>
#include <cmath>

#include <boost/math/distributions/students_t.hpp>

#include "recording_name.hpp"
#include "segment_choice.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::calibration {
namespace {

/// Prior sigmas from the nominal value that are strange, and that nobody would believe.
constexpr double kStrange = 3., kUnbelievable = 5.;
/// A solution of the search is the only one when every other is worse by this factor.
constexpr double kOnlyOne = 1.2;

const std::vector<IntrinsicSpec>& specs_of(const CalibrationResult& result) {
  return result.setup->recordings.front().setup.model->description().intrinsics;
}

/// What else it may be where poses are of a body that is not known to be at O.
std::string or_elsewhere(const CalibrationResult& result) {
  const CalibrationSetup& setup = *result.setup;
  const bool has_poses = std::ranges::any_of(setup.recordings, [](const auto& recording) {
    return recording.motion.kind == ReferenceKind::kPoses;
  });
  if (!has_poses || setup.options.estimate_extrinsics) return "";
  return ", or the body of the poses is not at O (estimate_extrinsics: true)";
}

/// Strange is a warning, unbelievable a doubt.
void add_by_size(double sigmas, const std::string& text, CalibrationResult& result) {
  if (std::abs(sigmas) < kStrange) return;
  auto& list = std::abs(sigmas) < kUnbelievable ? result.warnings : result.doubts;
  list.push_back(text);
}

/// What nothing was learned of.
void judge_knowledge(CalibrationResult& result) {
  const CalibrationEstimate& all = result.all;
  const auto free = (all.sigma.array() > 0.).count();
  if (free > 0 && static_cast<Eigen::Index>(all.undetermined.size()) >= free) {
    result.doubts.push_back(
        "the recordings tell less than the priors of all intrinsics: drive more, and so that the "
        "base turns while it moves");
    return;
  }
  constexpr double kUnknownZero_rad = 0.05;  // half of what the fit is given
  for (const int zero : result.search.zeros) {
    if (all.sigma[zero] < kUnknownZero_rad) continue;
    result.doubts.push_back("the motion does not tell " +
                            specs_of(result)[static_cast<std::size_t>(zero)].name +
                            ", which was searched: turn while moving, to both sides");
  }
}

/// Measurements by hand that the wheels contradict, and a gyro that would have to be very wrong.
void judge_what_was_given(CalibrationResult& result) {
  for (const ByHand& one : result.all.by_hand) {
    add_by_size(one.sigmas,
                name_of(result.setup->recordings[one.recording].label) + ": the wheels miss its " +
                    one.label + " by " + significant(std::abs(one.sigmas), 2) +
                    " sigmas: a measurement of another drive, its unit, or sigma_distance_m, "
                    "sigma_turn_deg",
                result);
  }
  const double of_clock_s = result.setup->options.prior_sigma_clock_offset_s;
  for (std::size_t i = 0; i < result.all.clock_offset_s.size(); ++i) {
    // It is estimated all the same, if not as far as it goes: no reason to doubt the rest.
    const double offset_s = result.all.clock_offset_s[i];
    if (!(of_clock_s > 0.) || std::abs(offset_s) < kStrange * of_clock_s) continue;
    result.warnings.push_back(
        name_of(result.setup->recordings[i].label) + ": its reference would be " +
        significant(1e3 * std::abs(offset_s), 2) + " ms " + (offset_s > 0. ? "later" : "earlier") +
        " than the wheels: a clock that viwo inspect writes, or prior_sigma_clock_offset_s is too "
        "narrow");
  }
  const double prior = result.setup->options.prior_sigma_gyro_bias_rad_per_s;
  for (std::size_t i = 0; i < result.all.gyro_bias_rad_per_s.size(); ++i) {
    const double bias = result.all.gyro_bias_rad_per_s[i];
    if (!(result.all.gyro_bias_sigma_rad_per_s[i] > 0.)) continue;
    add_by_size(bias / prior,
                name_of(result.setup->recordings[i].label) + ": the gyro would need a bias of " +
                    significant(bias, 2) +
                    " rad/s: it turns where the wheels do not, or "
                    "prior_sigma_gyro_bias_rad_per_s is too narrow",
                result);
  }
}

void judge_smoothed(const smoother::Smoothed& smoothed, CalibrationResult& result) {
  constexpr double kPart = 0.33;
  const auto part = static_cast<double>(smoothed.weighed_down) /
                    static_cast<double>(std::max(1L, smoothed.residuals));
  if (part > kPart) {
    result.doubts.push_back(significant(100. * part, 2) +
                            " % of the residual factors are beyond their gates: sensors that "
                            "contradict each other, or sigmas that are too small");
  }
  result.warnings.insert(result.warnings.end(), smoothed.warnings.begin(), smoothed.warnings.end());
}

/// Dead reckoning by the wheels that were calibrated ought to end nearer than by the nominal ones.
void judge_ends(CalibrationResult& result) {
  constexpr double kWorse = 1.2;
  double nominal_m = 0., calibrated_m = 0., nominal_deg = 0., calibrated_deg = 0.;
  for (const ValidationRun& run : result.fitted) {
    if (!run.nominal.accuracy || !run.calibrated.accuracy) return;
    nominal_m += run.nominal.accuracy->end_m;
    calibrated_m += run.calibrated.accuracy->end_m;
    nominal_deg += std::abs(run.nominal.accuracy->end_yaw_deg);
    calibrated_deg += std::abs(run.calibrated.accuracy->end_yaw_deg);
  }
  if (calibrated_m > kWorse * nominal_m) {
    result.doubts.push_back(
        "calibrated, dead reckoning ends further off than nominal: see the "
        "table of end errors");
  } else if (calibrated_deg > kWorse * nominal_deg) {
    result.warnings.push_back("calibrated, dead reckoning ends further off in yaw than nominal");
  }
}

/// A gyro tells no scale.
void judge_scale(CalibrationResult& result) {
  const auto& recordings = result.setup->recordings;
  if (result.smoothed) return;  // cameras and accelerometer do
  const bool has_scale = std::any_of(recordings.begin(), recordings.end(), [](const auto& one) {
    return one.motion.kind == ReferenceKind::kPoses || one.motion.distance_m.has_value();
  });
  if (has_scale) return;
  result.warnings.push_back(
      "nothing tells the scale: radii and lengths are as right as the nominal lengths of the base; "
      "a distance measured with a tape (distance_m) would tell");
}

/// States of the IMU are a reference by way of the wheels' mount.
void judge_mount(CalibrationResult& result) {
  const CalibrationRecording& first = result.setup->recordings.front();
  const bool is_used = first.motion.kind == ReferenceKind::kPoses && !first.data.states().empty() &&
                       first.setup.O_in_I && !result.setup->options.estimate_extrinsics;
  if (!is_used || first.setup.O_in_I_is_exact) return;
  result.warnings.push_back(
      "the mount of the IMU (wheels.p_IinO_m and R_ItoO, whose sigmas are above 0) is taken to be "
      "exact: what it is off by is learned as wheels (estimate_extrinsics: true finds it)");
}

/// What turns the base as drives that are all reversed do, and drives it the other way.
void judge_signs(CalibrationResult& result) {
  const auto& signs = result.search.drive_signs;
  const bool are_all = std::all_of(signs.begin(), signs.end(), [](int sign) { return sign < 0; });
  const ReferenceKind kind = result.setup->recordings.front().motion.kind;
  if (signs.size() < 2 || !are_all || kind == ReferenceKind::kPoses) return;
  const bool steers = result.setup->recordings.front().setup.model->description().n_steer > 0;
  result.warnings.push_back(
      steers ? "all drives turn backwards, or all zeros of the steering are off by half a turn, "
               "which a gyro cannot tell apart: see which way the wheels point"
             : "all drives turn backwards, or those on the left and on the right are exchanged, "
               "which a gyro cannot tell apart: turn one wheel by hand and see whose reading "
               "changes");
}

void judge_search(CalibrationResult& result) {
  const JointSearch& search = result.search;
  if (search.drive_signs.empty() || search.other_cost > kOnlyOne * search.cost) return;
  std::string other;
  for (const int zero : search.zeros) {
    other += (other.empty() ? "" : ", ") + specs_of(result)[static_cast<std::size_t>(zero)].name +
             " = " + significant(search.other[zero], 3) + " rad";
  }
  if (search.other_drive_signs != search.drive_signs) {
    std::string signs;
    for (const int sign : search.other_drive_signs) {
      signs += (signs.empty() ? "" : ", ") + std::to_string(sign);
    }
    other += (other.empty() ? "" : ", with ") + ("drive signs [" + signs + "]");
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
    const double change = result.all.change(k, specs[i].nominal);
    add_by_size(change,
                specs[i].name + " is " + significant(std::abs(change), 2) +
                    " prior sigmas from its nominal value: a wrong nominal value, a prior that is "
                    "too narrow, or joints, units or clocks that are wrong" +
                    or_elsewhere(result),
                result);
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
                            "prior_sigma_clock_offset_s)" +
                            or_elsewhere(result));
  };
  if (all.noise.yaw_is_found) {
    doubt(all.noise.yaw_rad, all.turn_rms_rad, kLeast_rad, "of turns [rad]");
  }
  if (all.noise.position_is_found) {
    doubt(all.noise.position_m, all.way_rms_m, kLeast_m, "of ways [m]");
  }
}

/// What turns the other way, or so many times as far, is no calibration: however little it turns.
void judge_turns(CalibrationResult& result) {
  constexpr double kSigmas = 5., kLeast = 0.5, kMostRatio = 2.;
  const TurnAgreement& turns = result.all.turns;
  const double correlation = turns.correlation(), ratio = turns.ratio();
  if (std::abs(correlation) < kLeast || turns.sigmas() < kSigmas) return;
  if (correlation < 0.) {
    result.doubts.push_back(
        "the reference turns the other way than the wheels (correlation " +
        significant(correlation, 2) +
        "): an axis of the gyro that is reversed, or left and right of the wheels exchanged");
  } else if (ratio > kMostRatio || ratio < 1. / kMostRatio) {
    result.doubts.push_back("the reference turns " + significant(ratio, 3) +
                            " times as far as the wheels: units, or gears");
  }
}

void judge_lengths(CalibrationResult& result) {
  for (const std::string& text : result.failed_lengths) {
    result.warnings.push_back("segments that could not be compared: " + text);
  }
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
    const int spare = other.residuals - other.to_be_told();
    const int compared = static_cast<int>((other.sigma.array() > 0.).count());
    if (!other.has_enough_residuals() || most < most_by_chance(spare, compared)) continue;
    result.warnings.push_back("the estimate depends on what is compared: with " +
                              segments_text(other) + " " + specs[which].name + " differs by " +
                              significant(most, 2) + " sigmas from that with " +
                              segments_text(result.all));
  }
}

}  // namespace

double most_by_chance(int spare_residuals, int estimates) {
  constexpr double kProbability = 0.0027;  // three sigmas of one that is normal
  const boost::math::students_t distribution(std::max(1, spare_residuals));
  return boost::math::quantile(
      boost::math::complement(distribution, 0.5 * kProbability / std::max(1, estimates)));
}

void judge(CalibrationResult& result) {
  const CalibrationEstimate& all = result.all;
  if (!all.converged) result.doubts.push_back("the fit did not converge");
  if (!all.has_enough_residuals()) {
    result.doubts.push_back("only " + std::to_string(all.residuals) + " residuals for " +
                            std::to_string(all.to_be_told()) +
                            " unknowns that the wheels among themselves do not tell: more or "
                            "longer recordings, or segments: auto");
  }
  if (result.smoothed) judge_smoothed(*result.smoothed, result);
  judge_knowledge(result);
  judge_what_was_given(result);
  judge_search(result);
  judge_signs(result);
  judge_left_over(result);
  judge_turns(result);
  judge_wheels(result);
  judge_change(result);
  judge_ends(result);
  judge_lengths(result);
  judge_scale(result);
  judge_mount(result);
}

}  // namespace viwo::calibration
