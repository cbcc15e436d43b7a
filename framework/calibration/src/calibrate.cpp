#include "viwo/calibration/calibrate.hpp"

#include <algorithm>
#include <set>

#include <tbb/parallel_for.h>

#include "viwo/config/params.hpp"
#include "viwo/config/yaml.hpp"
#include "wheel_wander.hpp"

namespace viwo::calibration {
namespace {

using config::Node;

struct CalibrationParams {
  std::string calibration;
  std::string base;
  std::vector<std::string> leave_out_by;
  std::vector<std::string> report_by;
  double segment_s = 0.;
  bool parity = true;
  bool estimate_extrinsics = false;
  double prior_sigma_extrinsics_m = 0.01;
  double prior_sigma_extrinsics_rad = 0.02;
  double prior_sigma_clock_offset_s = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(calibration), {.required = true, .help = "name of the calibration"});
    b(VIWO_PARAM(base), {.required = true, .help = "run configuration, relative to this file"});
    b(VIWO_PARAM(leave_out_by),
      {.help = "labels of the recordings whose values are left out of the fit in turn"});
    b(VIWO_PARAM(report_by), {.help = "labels of the recordings to break the tables down by"});
    b(VIWO_PARAM(segment_s),
      {.unit = "s",
       .min = 0.,
       .help = "length of the segments that are compared; 0: whole recordings"});
    b(VIWO_PARAM(parity), {.help = "use the parity residual beside the relative poses"});
    b(VIWO_PARAM(estimate_extrinsics),
      {.help = "estimate where O is in the reference body; then the gauge entries are held"});
    b(VIWO_PARAM(prior_sigma_extrinsics_m),
      {.unit = "m",
       .above = 0.,
       .help = "how well the position of O in the reference body is known to be zero"});
    b(VIWO_PARAM(prior_sigma_extrinsics_rad),
      {.unit = "rad",
       .above = 0.,
       .help = "how well the yaw of O in the reference body is known to be zero"});
    b(VIWO_PARAM(prior_sigma_clock_offset_s),
      {.unit = "s",
       .min = 0.,
       .max = 1.,
       .help = "prior of one clock offset per recording; 0: none is estimated"});
  }
};

CalibrationOptions options_of(const CalibrationParams& params) {
  CalibrationOptions options;
  options.segment_s = params.segment_s;
  options.parity = params.parity;
  options.estimate_extrinsics = params.estimate_extrinsics;
  options.extrinsics_sigma_m = params.prior_sigma_extrinsics_m;
  options.extrinsics_sigma_rad = params.prior_sigma_extrinsics_rad;
  options.clock_offset_sigma_s = params.prior_sigma_clock_offset_s;
  return options;
}

}  // namespace

CalibrationSetup read_calibration_setup(const std::filesystem::path& path,
                                        const std::vector<std::string>& assignments,
                                        PluginRegistry& plugins) {
  const Node file = config::load_file(path);
  config::Errors errors;
  constexpr std::string_view kSections[] = {"recordings", "motions", "set"};
  const auto params =
      config::read_section<CalibrationParams>(file, file.mark(), "calibration", errors, kSections);
  errors.throw_if_any();
  CalibrationSetup setup;
  setup.name = params.calibration;
  setup.options = options_of(params);
  setup.leave_out_by = params.leave_out_by;
  setup.report_by = params.report_by;
  const std::vector<Recording> recordings = read_recordings(file);
  const Node base = load_base(file, assignments);
  require_labels(setup.report_by, recordings, file, "report_by");
  for (const Recording& recording : recordings) {
    for (const std::string& label : setup.leave_out_by) {
      if (recording.labels.contains(label)) continue;
      config::fail(file.find("leave_out_by")->mark(), "recording '" + recording.name +
                                                          "' has no label '" + label +
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

/// A fit without the recordings that have one value of a label; with an empty label of all.
struct FitOf {
  std::string label, value;

  bool leaves_out(const CalibrationRecording& recording) const {
    return !label.empty() && recording.label.labels.at(label) == value;
  }
};

/// That of all, then those of each label.
std::vector<FitOf> fits_of(const CalibrationSetup& setup) {
  std::vector<FitOf> fits{{}};
  for (const std::string& label : setup.leave_out_by) {
    std::set<std::string> values;
    for (const auto& recording : setup.recordings) {
      values.insert(recording.label.labels.at(label));
    }
    if (values.size() < 2) {
      throw InputError("all recordings have the same '" + label +
                       "': nothing is left to fit when it is left out");
    }
    for (const std::string& value : values) fits.push_back({label, value});
  }
  return fits;
}

/// The jackknife over the values of a label (CAL-8).
Intrinsics spread_of(const std::string& label, const std::vector<FitOf>& fits,
                     const std::vector<CalibrationEstimate>& estimates) {
  std::vector<const Intrinsics*> without;
  for (std::size_t f = 0; f < fits.size(); ++f) {
    if (fits[f].label == label) without.push_back(&estimates[f].x_WI);
  }
  const auto n = static_cast<double>(without.size());
  Intrinsics mean = Intrinsics::Zero(estimates.front().x_WI.size()), squares = mean;
  for (const Intrinsics* x : without) mean += *x / n;
  for (const Intrinsics* x : without) squares += (*x - mean).cwiseAbs2();
  return ((n - 1.) / n * squares).cwiseSqrt();
}

}  // namespace

CalibrationResult calibrate(const CalibrationSetup& setup, WorkProgress& progress) {
  const std::vector<FitOf> fits = fits_of(setup);
  progress.begin("fits", static_cast<int>(fits.size()));
  std::vector<CalibrationEstimate> estimates(fits.size());
  tbb::parallel_for(std::size_t{0}, fits.size(), [&](std::size_t f) {
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < setup.recordings.size(); ++i) {
      if (!fits[f].leaves_out(setup.recordings[i])) used.push_back(i);
    }
    estimates[f] = fit(setup, used);
    progress.done((fits[f].label.empty() ? "all recordings"
                                         : "without " + fits[f].label + " " + fits[f].value) +
                  ": " + std::to_string(estimates[f].iterations) + " iterations");
  });
  CalibrationResult result;
  result.setup = &setup;
  result.all = estimates[0];
  result.wander = find_wander(setup, result.all.x_WI);
  result.sigma_of_fit = result.all.sigma;
  for (const std::string& label : setup.leave_out_by) {
    result.left_out.push_back({label, spread_of(label, fits, estimates), {}});
    result.all.sigma = result.all.sigma.cwiseMax(result.left_out.back().spread);
  }
  for (std::size_t i = 0; i < setup.recordings.size(); ++i) {
    result.fitted.push_back(validate(setup, i, estimates[0]));
    for (std::size_t f = 1; f < fits.size(); ++f) {
      if (!fits[f].leaves_out(setup.recordings[i])) continue;
      const auto by = std::find_if(result.left_out.begin(), result.left_out.end(),
                                   [&](const LeftOut& l) { return l.by == fits[f].label; });
      by->runs.push_back(validate(setup, i, estimates[f]));
    }
  }
  return result;
}

}  // namespace viwo::calibration
