#include "viwo/experiment/calibrate.hpp"

#include <array>
#include <numeric>
#include <set>

#include <tbb/parallel_for.h>

#include "viwo/config/params.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::experiment {
namespace {

using config::Node;

constexpr std::array kCalibrationParams{
    ParamSpec{.name = "calibration", .type = ParamType::kString, .help = "name of the calibration"},
    ParamSpec{.name = "base",
              .type = ParamType::kString,
              .help = "run configuration, relative to this file"},
    ParamSpec{.name = "leave_out_by",
              .type = ParamType::kString,
              .fallback = "''",
              .help = "label of the recordings whose values are left out of the fit in turn"},
    ParamSpec{.name = "report_by",
              .type = ParamType::kStrings,
              .fallback = "[]",
              .help = "labels of the recordings to break the tables down by"},
    ParamSpec{.name = "segment_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0",
              .min = 0.,
              .help = "length of the segments that are compared; 0: whole recordings"},
    ParamSpec{.name = "parity",
              .type = ParamType::kBool,
              .fallback = "true",
              .help = "use the parity residual beside the relative poses"},
    ParamSpec{.name = "estimate_extrinsics",
              .type = ParamType::kBool,
              .fallback = "false",
              .help = "estimate where O is in the reference body; then the gauge entries are held"},
    ParamSpec{.name = "prior_sigma_extrinsics_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .fallback = "0.01",
              .min = 0.,
              .min_exclusive = true,
              .help = "how well the position of O in the reference body is known to be zero"},
    ParamSpec{.name = "prior_sigma_extrinsics_rad",
              .type = ParamType::kNumber,
              .unit = "rad",
              .fallback = "0.02",
              .min = 0.,
              .min_exclusive = true,
              .help = "how well the yaw of O in the reference body is known to be zero"},
    ParamSpec{.name = "prior_sigma_clock_offset_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0",
              .min = 0.,
              .max = 1.,
              .help = "prior of one clock offset per recording; 0: none is estimated"},
};

CalibrationOptions options_of(const ParamSet& params) {
  CalibrationOptions options;
  options.segment_s = params.number("segment_s");
  options.parity = params.flag("parity");
  options.estimate_extrinsics = params.flag("estimate_extrinsics");
  options.extrinsics_sigma_m = params.number("prior_sigma_extrinsics_m");
  options.extrinsics_sigma_rad = params.number("prior_sigma_extrinsics_rad");
  options.clock_offset_sigma_s = params.number("prior_sigma_clock_offset_s");
  return options;
}

}  // namespace

CalibrationSetup read_calibration_setup(const std::filesystem::path& path,
                                        const std::vector<std::string>& assignments,
                                        PluginRegistry& plugins) {
  const Node file = config::load_file(path);
  config::Errors errors;
  constexpr std::string_view kSections[] = {"recordings", "motions", "set"};
  const ParamSet params = config::read_params(file, file.mark(), "calibration", kCalibrationParams,
                                              kSections, {}, errors);
  errors.throw_if_any();
  CalibrationSetup setup;
  setup.name = params.text("calibration");
  setup.options = options_of(params);
  setup.leave_out_by = params.text("leave_out_by");
  const auto report_by = params.texts("report_by");
  setup.report_by.assign(report_by.begin(), report_by.end());
  const std::vector<Recording> recordings = read_recordings(file);
  const Node base = load_base(file, assignments);
  require_labels(setup.report_by, recordings, file, "report_by");
  for (const Recording& recording : recordings) {
    if (!setup.leave_out_by.empty() && !recording.labels.contains(setup.leave_out_by)) {
      config::fail(file.find("leave_out_by")->mark(), "recording '" + recording.name +
                                                          "' has no label '" + setup.leave_out_by +
                                                          "', by which leave_out_by divides them");
    }
    RunSetup run = read_run(resolve_placeholders(base, recording.labels), plugins);
    RunData data = collect(run);
    setup.recordings.push_back({recording, std::move(run), std::move(data)});
  }
  return setup;
}

namespace {

ValidationRun validate(const CalibrationSetup& setup, std::size_t index,
                       const CalibrationEstimate& estimate) {
  const CalibrationRecording& recording = setup.recordings[index];
  RunSetup nominal = recording.setup;
  nominal.x_WI = nominal.model->nominal();
  nominal.extrinsics.setZero();
  RunSetup calibrated = recording.setup;
  calibrated.x_WI = estimate.x_WI;
  calibrated.sigma = estimate.sigma;
  calibrated.extrinsics = estimate.extrinsics;
  return {index, run_odometry(nominal, recording.data), run_odometry(calibrated, recording.data)};
}

}  // namespace

CalibrationResult calibrate(const CalibrationSetup& setup) {
  CalibrationResult result;
  result.setup = &setup;
  std::vector<std::size_t> all(setup.recordings.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::set<std::string> groups;
  if (!setup.leave_out_by.empty()) {
    for (const auto& recording : setup.recordings) {
      groups.insert(recording.label.labels.at(setup.leave_out_by));
    }
    if (groups.size() < 2) {
      throw InputError("all recordings have the same '" + setup.leave_out_by +
                       "': nothing is left to fit when it is left out");
    }
  }
  // Fit number 0 has all recordings; the others leave one group out each.
  std::vector<std::string> left_out{""};
  left_out.insert(left_out.end(), groups.begin(), groups.end());
  std::vector<CalibrationEstimate> estimates(left_out.size());
  const auto is_left_out = [&](std::size_t index, std::size_t f) {
    return f > 0 && setup.recordings[index].label.labels.at(setup.leave_out_by) == left_out[f];
  };
  tbb::parallel_for(std::size_t{0}, left_out.size(), [&](std::size_t f) {
    std::vector<std::size_t> used;
    for (const std::size_t index : all) {
      if (!is_left_out(index, f)) used.push_back(index);
    }
    estimates[f] = fit(setup, used);
  });
  result.all = estimates[0];
  for (const std::size_t index : all) {
    result.fitted.push_back(validate(setup, index, estimates[0]));
    for (std::size_t f = 1; f < estimates.size(); ++f) {
      if (is_left_out(index, f)) result.left_out.push_back(validate(setup, index, estimates[f]));
    }
  }
  return result;
}

}  // namespace viwo::experiment
