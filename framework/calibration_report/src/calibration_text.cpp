#include "calibration_text.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "viwo/eval/statistics.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::calibration {
namespace {

EndErrors errors_of(const RunResult& run) {
  if (!run.accuracy) return {std::nan(""), std::nan("")};
  return {1e3 * run.accuracy->end_m, std::abs(run.accuracy->end_yaw_deg) * M_PI / 180.};
}

}  // namespace

std::vector<ErrorRow> error_rows(const CalibrationSetup& setup,
                                 const std::vector<ValidationRun>& runs) {
  const auto mean_over = [&](const std::string& name, auto&& passes) {
    std::vector<double> values[4];
    for (const ValidationRun& run : runs) {
      if (!passes(setup.recordings[run.recording].label.labels)) continue;
      const EndErrors nominal = errors_of(run.nominal), calibrated = errors_of(run.calibrated);
      values[0].push_back(nominal.mm);
      values[1].push_back(nominal.yaw_rad);
      values[2].push_back(calibrated.mm);
      values[3].push_back(calibrated.yaw_rad);
    }
    return ErrorRow{name,
                    values[0].size(),
                    {eval::mean(values[0]), eval::mean(values[1])},
                    {eval::mean(values[2]), eval::mean(values[3])}};
  };
  const bool known = std::any_of(runs.begin(), runs.end(), [](const ValidationRun& run) {
    return run.nominal.accuracy || run.calibrated.accuracy;
  });
  if (!known) return {};
  std::vector<ErrorRow> rows{mean_over("all", [](const auto&) { return true; })};
  for (const std::string& label : setup.report_by) {
    std::set<std::string> seen;
    for (const auto& recording : setup.recordings) {
      const auto found = recording.label.labels.find(label);
      if (found == recording.label.labels.end() || !seen.insert(found->second).second) continue;
      rows.push_back(mean_over(found->second, [&](const auto& labels) {
        const auto at = labels.find(label);
        return at != labels.end() && at->second == found->second;
      }));
    }
  }
  return rows;
}

const WheelModel& model_of(const CalibrationResult& result) {
  return *result.setup->recordings.front().setup.model;
}

std::string left_out_title(const LeftOut& left_out) {
  return "End error of dead reckoning, recordings left out of the fit by " + left_out.by;
}

std::string without_text(const LeftOut& left_out, const std::string& failed) {
  return "without " + left_out.by + " " + failed;
}

/// What was found, and what to write.
std::string wander_text(const WheelWander& wander) {
  if (wander.lag_s.empty()) {
    return "whether the intrinsics wander cannot be told: only wheels that could contradict each "
           "other, for longer than a second, tell it";
  }
  constexpr double kLeastWander = 0.01;  // nothing that anybody would notice
  if (!(wander.sigma > kLeastWander))
    return "the wheels contradict each other as noise does: none wanders";
  const std::string sigma = significant(wander.sigma, 2), time_s = significant(wander.time_s, 2);
  // Priors say how far wheels are from nominal at most: what comes and goes by more is none of it.
  constexpr double kMostWander = 3.;
  if (wander.sigma > kMostWander) {
    return "how the wheels contradict each other comes and goes by " + sigma +
           " prior sigmas of the intrinsics, for " + time_s +
           " s: slip, or a model that is not of this base, and nothing that a filter can follow";
  }
  // A decay that is slower than what is compared is seen as none: its time is that of a fit's end.
  const double longest_s = wander.lag_s.back();
  const bool is_slow = wander.time_s > longest_s;
  return "the intrinsics wander by " + sigma + " prior sigmas, for " +
         (is_slow ? "longer than the " + significant(longest_s, 2) +
                        " s that are compared, so that how long is not known"
                  : time_s + " s") +
         ": wheels.intrinsics_wander=" + sigma + ", wheels.intrinsics_wander_time_s=" + time_s +
         " in a filter";
}

std::vector<std::string> search_text(const CalibrationResult& result) {
  std::vector<std::string> out;
  const JointSearch& search = result.search;
  const auto& specs = model_of(result).description().intrinsics;
  for (std::size_t i = 0; i < search.zeros.size(); ++i) {
    const auto zero = static_cast<std::size_t>(search.zeros[i]);
    const double nominal = specs[zero].nominal;
    const double found = result.all.x_WI[search.zeros[i]];
    const double other = std::remainder(found + M_PI - nominal, 2. * M_PI);
    std::string text =
        "steering " + std::to_string(i + 1) + ": zero at " + significant(found, 4) + " rad";
    if (std::abs(other) < M_PI / 2.) {
      text += ", or at " + significant(nominal + other, 4) + " rad of a drive that turns backwards";
    }
    out.push_back(text);
  }
  for (std::size_t i = 0; i < search.drive_signs.size(); ++i) {
    if (search.drive_signs[i] > 0) continue;
    out.push_back("drive " + std::to_string(i + 1) +
                  " turns backwards: the calibration is for readings of the other sign, by "
                  "drive_scale of the sensor, without which no run takes it");
  }
  return out;
}

CalibrationFile::Entries beside_the_wheels(const CalibrationResult& result) {
  CalibrationFile::Entries out;
  if (!result.smoothed) return out;
  const CalibrationFile& file = result.smoothed->calibration;
  for (const auto* entries : {&file.mount, &file.clock, &file.cameras}) {
    std::copy_if(entries->begin(), entries->end(), std::back_inserter(out),
                 [](const CalibrationEntry& entry) { return entry.sigma > 0.; });
  }
  return out;
}

std::string left_over_text(const CalibrationResult& result) {
  const CalibrationEstimate& estimate = result.all;
  if (result.smoothed) {
    const smoother::Smoothed& smoothed = *result.smoothed;
    return "smoothed in " + std::to_string(smoothed.iterations) + " passes; of " +
           std::to_string(smoothed.residuals) + " residual factors " +
           std::to_string(smoothed.weighed_down) + " were beyond their gates and count for less";
  }
  const ReferenceKind kind = result.setup->recordings.front().motion.kind;
  std::string text = "what the fit leaves";
  if (kind != ReferenceKind::kNone) {
    const CalibrationNoise& noise = estimate.noise;
    text += " per segment (" + segments_text(estimate) + "): ";
    if (noise.position_is_found) text += significant(1e3 * noise.position_m, 3) + " mm, ";
    text +=
        noise.yaw_is_found ? significant(noise.yaw_rad, 3) + " rad; " : "too few to say how much; ";
    if (estimate.with_holes > 0) {
      text += std::to_string(estimate.with_holes) +
              " segments with holes of wheels or gyro are left out; ";
    }
    if (estimate.weighed_down > 0) {
      text += std::to_string(estimate.weighed_down) + " segments that do not fit count for less; ";
    }
  } else {
    text += ": ";
  }
  return text + "parity residual " + significant(estimate.noise.parity_scale, 3) +
         " x the model's sigmas";
}

std::string clock_text(const CalibrationResult& result) {
  const CalibrationEstimate& estimate = result.all;
  double most = 0.;
  for (const double sigma : estimate.clock_offset_sigma_s) most = std::max(most, sigma);
  if (!(most > 0.)) return "";
  std::string text = "clock offsets of the recordings: mean " +
                     significant(1e3 * eval::mean(estimate.clock_offset_s), 3) +
                     " ms, each known to " + significant(1e3 * most, 2) + " ms or better";
  if (estimate.clock_offset_s.size() > 1) {
    text += ", spread " +
            significant(1e3 * eval::sample_standard_deviation(estimate.clock_offset_s), 3) + " ms";
  }
  return text;
}

std::string bias_text(const CalibrationResult& result) {
  const auto& biases = result.all.gyro_bias_rad_per_s;
  const auto& sigmas = result.all.gyro_bias_sigma_rad_per_s;
  if (biases.empty() || !(sigmas.front() > 0.)) return "";
  const auto [least, most] = std::minmax_element(biases.begin(), biases.end());
  std::string text = "bias of the gyro: " + significant(*least, 3);
  if (biases.size() > 1) text += " .. " + significant(*most, 3);
  return text + " rad/s";
}

std::string status_of(const CalibrationResult& result) {
  if (!result.all.converged) return "failed";
  return result.is_trusted() ? "ok" : "doubtful";
}

}  // namespace viwo::calibration
