#include "viwo/calibration_report/calibration_output.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <ostream>

#include "calibration_text.hpp"
#include "viwo/calibration_file/calibration_file.hpp"
#include "viwo/eval/json.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/files/files.hpp"
#include "viwo/math/combination_text.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/text_stream.hpp"

namespace viwo::calibration {
namespace {

using nlohmann::json;

/// Right-aligned in its column, apart from the one before however long it is.
std::string pad(const std::string& text, std::size_t width) {
  return std::string(std::max(width, text.size() + 1) - text.size(), ' ') + text;
}

void describe_errors(const std::string& title, const CalibrationSetup& setup,
                     const std::vector<ValidationRun>& runs, std::ostream& out) {
  const std::vector<ErrorRow> rows = error_rows(setup, runs);
  if (rows.empty()) return;
  out << "\n"
      << title << "\n"
      << pad("", 16) << pad("runs", 6) << pad("nominal", 12) << pad("", 10) << pad("calibrated", 14)
      << "\n"
      << pad("", 22) << pad("[mm]", 12) << pad("[rad]", 10) << pad("[mm]", 14) << pad("[rad]", 10)
      << "\n";
  for (const ErrorRow& row : rows) {
    out << row.name
        << pad(std::to_string(row.runs), 22 - std::min<std::size_t>(row.name.size(), 16))
        << pad(significant(row.nominal.mm, 4), 12) << pad(significant(row.nominal.yaw_rad, 3), 10)
        << pad(significant(row.calibrated.mm, 4), 14)
        << pad(significant(row.calibrated.yaw_rad, 3), 10) << "\n";
  }
}

json errors_json(const CalibrationSetup& setup, const std::vector<ValidationRun>& runs) {
  json out = json::object();
  for (const ErrorRow& row : error_rows(setup, runs)) {
    const auto entry = [](const EndErrors& errors) {
      return json{{"end_m", number_or_null(1e-3 * errors.mm)},
                  {"end_yaw_abs_rad", number_or_null(errors.yaw_rad)}};
    };
    out[row.name] = {
        {"runs", row.runs}, {"nominal", entry(row.nominal)}, {"calibrated", entry(row.calibrated)}};
  }
  return out;
}

void describe_parameters(const CalibrationResult& result, std::ostream& out) {
  const CalibrationEstimate& estimate = result.all;
  out << pad("parameter", 12) << pad("unit", 6) << pad("nominal", 12) << pad("estimate", 12)
      << pad("sigma", 12) << pad("change/prior", 14) << "\n";
  const auto& specs = model_of(result).description().intrinsics;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    out << pad(specs[i].name, 12) << pad(specs[i].unit, 6)
        << pad(significant(specs[i].nominal, 6), 12) << pad(significant(estimate.x_WI[k], 6), 12)
        << pad(estimate.sigma[k] > 0. ? significant(estimate.sigma[k], 3) : "held", 12)
        << pad(significant(estimate.change(k, specs[i].nominal), 3), 14) << "\n";
  }
  for (int i = 0; i < 3; ++i) {
    const char* names[] = {"x_OinB", "y_OinB", "yaw_OinB"};
    if (!(estimate.extrinsics_sigma[i] > 0.)) continue;
    out << pad(names[i], 12) << pad(i < 2 ? "m" : "rad", 6)
        << pad(significant(result.setup->options.extrinsics_x_m_y_m_yaw_rad[i], 6), 12)
        << pad(significant(estimate.extrinsics[i], 6), 12)
        << pad(significant(estimate.extrinsics_sigma[i], 3), 12) << "\n";
  }
  for (const CalibrationEntry& entry : beside_the_wheels(result)) {
    out << pad(entry.name, 12) << pad(entry.unit, 6) << pad(significant(entry.nominal, 6), 12)
        << pad(significant(entry.estimate, 6), 12) << pad(significant(entry.sigma, 3), 12) << "\n";
  }
}

void describe_undetermined(const CalibrationEstimate& estimate, std::ostream& out) {
  if (estimate.undetermined.empty()) {
    out << "the data determine all directions better than the prior\n";
    return;
  }
  out << "directions that the data do not determine (in prior sigmas; posterior / prior):\n";
  for (const auto& direction : estimate.undetermined) {
    out << pad(significant(direction.sigma_ratio, 2), 8) << "  "
        << combination_text(direction.weights) << "\n";
  }
}

/// A number that the data told, or null.
json number_if(bool told, double value) { return told ? number_or_null(value) : json(); }

json intrinsics_json(const CalibrationResult& result) {
  json parameters = json::object();
  const auto& specs = model_of(result).description().intrinsics;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    parameters[specs[i].name] = {{"initial", specs[i].nominal},
                                 {"final", result.all.x_WI[k]},
                                 {"sigma", result.all.sigma[k]},
                                 {"sigma_of_fit", result.sigma_of_fit[k]},
                                 {"unit", specs[i].unit}};
  }
  return parameters;
}

json undetermined_json(const CalibrationEstimate& estimate) {
  json undetermined = json::array();
  for (const auto& direction : estimate.undetermined) {
    json weights = json::object();
    for (const auto& [name, weight] : direction.weights) weights[name] = weight;
    undetermined.push_back({{"sigma_ratio", direction.sigma_ratio}, {"weights", weights}});
  }
  return undetermined;
}

json lengths_json(const CalibrationResult& result) {
  json lengths = json::array();
  for (const CalibrationEstimate& one : result.lengths) {
    lengths.push_back(
        {{"segments", segments_text(one)},
         {"residuals", one.residuals},
         {"prediction_m", number_if(one.prediction_m.has_value(), one.prediction_m.value_or(0.))},
         {"log_volume", number_or_null(one.log_volume)}});
  }
  return lengths;
}

/// Of the smoother; null where none was asked for.
json smoothed_json(const CalibrationResult& result) {
  if (!result.smoothed) return {};
  json entries = json::object();
  for (const CalibrationEntry& entry : beside_the_wheels(result)) {
    entries[entry.name] = {{"initial", entry.nominal},
                           {"final", entry.estimate},
                           {"sigma", entry.sigma},
                           {"unit", entry.unit}};
  }
  return {{"passes", result.smoothed->iterations},
          {"last_step_sigmas", std::sqrt(result.smoothed->left)},
          {"calibration", entries}};
}

json summary_of(const CalibrationResult& result) {
  const CalibrationEstimate& estimate = result.all;
  std::vector<json> left_out;
  json by_label = json::object();
  for (const LeftOut& one : result.left_out) {
    left_out.push_back(errors_json(*result.setup, one.runs));
    by_label[one.by] = left_out.back();
  }
  const CalibrationNoise& noise = estimate.noise;
  return {
      {"status", status_of(result)},
      {"doubts", result.doubts},
      {"warnings", result.warnings},
      {"calibration", intrinsics_json(result)},
      {"extrinsics_x_m_y_m_yaw_rad",
       {{"estimate", std::vector<double>(estimate.extrinsics.begin(), estimate.extrinsics.end())},
        {"sigma",
         std::vector<double>(estimate.extrinsics_sigma.begin(), estimate.extrinsics_sigma.end())}}},
      {"smoothed", smoothed_json(result)},
      {"joints", search_text(result)},
      {"segments", segments_text(estimate)},
      {"lengths", lengths_json(result)},
      {"residuals", estimate.residuals},
      {"unknowns", estimate.unknowns},
      {"noise",
       {{"position_m", number_if(noise.position_is_found, noise.position_m)},
        {"yaw_rad", number_if(noise.yaw_is_found, noise.yaw_rad)},
        {"parity_scale", noise.parity_scale}}},
      {"wander", {{"sigma", result.wander.sigma}, {"time_s", result.wander.time_s}}},
      {"clock_offset_s", estimate.clock_offset_s},
      {"clock_offset_sigma_s", estimate.clock_offset_sigma_s},
      {"gyro_bias_rad_per_s", estimate.gyro_bias_rad_per_s},
      {"undetermined", undetermined_json(estimate)},
      {"fitted", errors_json(*result.setup, result.fitted)},
      {"left_out", left_out.empty() ? json::object() : left_out.front()},
      {"left_out_by", by_label}};
}

/// The wheels' clock over all recordings: as uncertain as they differ, where that is more.
std::optional<CalibrationEntry> clock_of(const CalibrationResult& result) {
  const CalibrationEstimate& estimate = result.all;
  double weights = 0., sum = 0.;
  std::vector<double> offsets_s;
  for (std::size_t i = 0; i < estimate.clock_offset_s.size(); ++i) {
    const double sigma = estimate.clock_offset_sigma_s[i];
    if (!(sigma > 0.)) continue;
    weights += 1. / (sigma * sigma);
    sum += estimate.clock_offset_s[i] / (sigma * sigma);
    offsets_s.push_back(estimate.clock_offset_s[i]);
  }
  if (offsets_s.empty()) return std::nullopt;
  double sigma = std::sqrt(1. / weights);
  if (offsets_s.size() > 1) {
    sigma = std::max(sigma, eval::sample_standard_deviation(offsets_s));
  }
  const double nominal = result.setup->recordings.front().motion.offset_s;
  return CalibrationEntry{"", nominal + sum / weights, sigma, nominal, "s"};
}

/// Where O is in the reference body, and the clock of that, which is the IMU's where the gyro is
/// the reference.
void add_reference(const CalibrationResult& result, CalibrationFile& file) {
  const CalibrationRecording& first = result.setup->recordings.front();
  const bool has_poses = first.motion.kind == ReferenceKind::kPoses;
  if (has_poses) {
    constexpr const char* kNames[] = {"x_OinB", "y_OinB", "yaw_OinB"};
    for (int i = 0; i < 3; ++i) {
      file.reference.push_back({kNames[i], result.all.extrinsics[i], result.all.extrinsics_sigma[i],
                                result.setup->options.extrinsics_x_m_y_m_yaw_rad[i],
                                i < 2 ? "m" : "rad"});
    }
  }
  std::optional<CalibrationEntry> clock = clock_of(result);
  if (!clock) return;
  // That of headings is of no IMU.
  const bool is_of_imu = !has_poses && !first.data.imu().empty();
  clock->name = is_of_imu ? "t_OtoI" : "t_OtoB";
  if (is_of_imu) file.clock.push_back(*clock);
  if (has_poses && !is_of_imu) file.reference.push_back(*clock);
}

CalibrationFile calibration_file_of(const CalibrationResult& result) {
  using Status = CalibrationFile::Status;
  const RunSetup& setup = result.setup->recordings.front().setup;
  CalibrationFile file;
  if (result.smoothed) file = result.smoothed->calibration;
  file.status = result.is_trusted() ? Status::kOk : Status::kDoubtful;
  if (!result.all.converged) file.status = Status::kFailed;
  file.reasons = result.doubts;
  if (result.smoothed) {
    for (std::size_t i = 0; i < file.intrinsics.size(); ++i) {
      file.intrinsics[i].sigma = result.all.sigma[static_cast<Eigen::Index>(i)];
    }
    return file;
  }
  file.model = setup.kinematics.info.name;
  file.drive_signs = result.search.drive_signs;
  const std::vector<int> configured = drive_signs(setup);
  for (std::size_t i = 0; i < file.drive_signs.size(); ++i) file.drive_signs[i] *= configured[i];
  file.twist = setup.preintegration.twist.noise_weighted ? "noise_weighted" : "plain";
  const auto& specs = setup.model->description().intrinsics;
  std::vector<Eigen::Index> known;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    file.intrinsics.push_back(
        {specs[i].name, result.all.x_WI[k], result.all.sigma[k], specs[i].nominal, specs[i].unit});
    if (!(result.all.sigma[k] > 0.)) continue;
    known.push_back(k);
    file.correlations.entries.push_back(specs[i].name);
  }
  file.correlations.matrix = result.all.correlations(known, known);
  add_reference(result, file);
  return file;
}

}  // namespace

std::string describe(const CalibrationResult& result) {
  TextStream out;
  describe_parameters(result, out);
  if (!result.left_out.empty()) {
    std::string labels;
    for (const LeftOut& one : result.left_out) {
      labels += (labels.empty() ? "a " : " or a ") + one.by;
    }
    out << (result.setup->leave_out_is_asked
                ? "sigma: that of the fit, or of how the estimate changes when " + labels +
                      " is left out, if that is larger\n"
                : "sigma: that of the fit; 'leave_out_by' takes in how the estimate changes when " +
                      labels + " is left out\n");
  }
  for (const std::string& text : search_text(result)) out << text << "\n";
  out << left_over_text(result) << "\n" << wander_text(result.wander) << "\n";
  if (const std::string text = clock_text(result); !text.empty()) out << text << "\n";
  if (const std::string text = bias_text(result); !text.empty()) out << text << "\n";
  describe_undetermined(result.all, out);
  describe_errors("End error of dead reckoning, recordings used in the fit", *result.setup,
                  result.fitted, out);
  for (const LeftOut& left_out : result.left_out) {
    describe_errors(left_out_title(left_out), *result.setup, left_out.runs, out);
    for (const std::string& failed : left_out.failed) out << without_text(left_out, failed) << "\n";
  }
  out << "\n";
  for (const std::string& warning : result.warnings) out << "warning: " << warning << "\n";
  for (const std::string& doubt : result.doubts) out << "not to be trusted: " << doubt << "\n";
  out << "status " << status_of(result) << "\n";
  return out.str();
}

void write_calibration(const std::filesystem::path& folder, const CalibrationResult& result) {
  files::NewResults out(folder);
  files::write_text(out.file("calibration.yaml"),
                    calibration_text(calibration_file_of(result), "viwo calibrate"));
  files::write_text(out.file("summary.json"), json_text(summary_of(result)));
  files::write_text(out.file("report.html"), report::to_html(page_of(result)));
  out.commit(kResults);
}

}  // namespace viwo::calibration
