#include "viwo/calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "by_smoother.hpp"
#include "joint_search.hpp"
#include "judgement.hpp"
#include "motion_reference.hpp"
#include "recording_name.hpp"
#include "segment_choice.hpp"
#include "viwo/config/file_kind.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/run/parallel_for.hpp"
#include "wheel_wander.hpp"

namespace viwo::calibration {
namespace {

using config::Node;

struct CalibrationParams : CalibrationOptions {
  std::string calibration;
  std::string base;
  std::vector<std::string> leave_out_by;
  std::vector<std::string> report_by;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(calibration), {.required = true, .help = "name of the calibration"});
    b(VIWO_PARAM(base), {.required = true, .help = "run configuration, relative to this file"});
    b(VIWO_PARAM(leave_out_by),
      {.help = "labels of the recordings whose values are left out of the fit in turn"});
    b(VIWO_PARAM(report_by), {.help = "labels of the recordings to break the tables down by"});
    CalibrationOptions::bind(b);
  }
};

/// Assignments to keys of the calibration file itself; the others are for its base.
std::vector<std::string> assign(const std::vector<std::string>& assignments, Node& file) {
  std::vector<std::string> others;
  for (const std::string& text : assignments) {
    const config::Assignment assignment = config::parse_assignment(text);
    const auto& specs = param_specs<CalibrationOptions>();
    const bool is_own = std::any_of(specs.begin(), specs.end(), [&](const ParamSpec& spec) {
      return spec.name == assignment.path;
    });
    if (is_own) {
      config::set_path(file, assignment.path, assignment.value);
    } else {
      others.push_back(text);
    }
  }
  return others;
}

/// What is nearly the name of a label with a meaning is meant to be it.
void refuse_misspelt_labels(const Recording& recording) {
  for (const auto& [label, value] : recording.labels) {
    for (const char* known : {"distance_m", "turn_deg"}) {
      const std::string_view stem(known, std::string_view(known).find('_'));
      const bool is_near = label.starts_with(stem) ||
                           !config::nearest(label, std::vector<std::string>{known}).empty();
      if (label == known || !is_near) continue;
      fail(recording, ": label '" + label + "' - did you mean '" + known + "'?");
    }
  }
}

/// Shorter than the interval between two readings there is nothing to compare.
void require_readings_in_segments(const CalibrationSetup& setup, const Node& file) {
  const double segment_s = setup.options.segment_s;
  for (const CalibrationRecording& recording : setup.recordings) {
    const auto wheels = recording.data.wheels();
    const double interval_s = seconds_between(wheels.front().begin_ns, wheels.back().end_ns) /
                              static_cast<double>(wheels.size());
    if (!(segment_s > 0.) || segment_s >= interval_s) continue;
    config::fail(file.find("segment_s")->mark(),
                 "segment_s is shorter than the interval between readings of the wheels, " +
                     significant(interval_s, 2) + " s");
  }
  const double interval_s = pose_interval_s(setup);
  if (!(segment_s > 0.) || segment_s >= interval_s || !std::isfinite(interval_s)) return;
  config::fail(
      file.find("segment_s")->mark(),
      "segment_s is shorter than the interval between poses, " + significant(interval_s, 2) + " s");
}

/// What a smoother takes from the base, or does not look at.
void require_for_smoother(const CalibrationSetup& setup, const Node& file) {
  for (const char* key : {"segments", "segment_s", "find_steering_zeros", "find_drive_signs",
                          "estimate_extrinsics", "extrinsics_x_m_y_m_yaw_rad"}) {
    const Node* const node = file.find(key);
    if (node == nullptr) continue;
    config::fail(node->mark(), std::string(key) +
                                   " is not for reference: smoother, which takes what is "
                                   "estimated, and where it begins, from the base; zeros anywhere "
                                   "are found with reference: gyro first (calibration: FILE)");
  }
  for (const CalibrationRecording& recording : setup.recordings) {
    if (!recording.motion.distance_m && !recording.motion.turn_rad) continue;
    fail(recording.label, ": distance_m and turn_deg are not for reference: smoother");
  }
}

/// A fit has one noise for all turns, and one gauge.
void require_one_kind(const std::vector<CalibrationRecording>& recordings) {
  const auto other = std::find_if(recordings.begin(), recordings.end(), [&](const auto& r) {
    return r.motion.kind != recordings.front().motion.kind;
  });
  if (other == recordings.end()) return;
  config::fail(other->label.mark,
               name_of(recordings.front().label) + " and " + name_of(other->label) +
                   ": one has reference poses and one has a gyro only; say reference: gyro");
}

CalibrationRecording read_recording(const Recording& label, const Node& base, ReferenceKind kind,
                                    PluginRegistry& plugins) {
  const Node run = resolve_placeholders(base, label.labels);
  Node wheels_alone = run;
  if (run.find("updates") != nullptr) {
    config::set_path(wheels_alone, "estimator.type", Node::scalar_of("dead_reckoning"));
  }
  auto [setup, data] = of_recording(label, [&] {
    RunSetup read = read_run(wheels_alone, plugins);
    RunData collected = collect(read);
    return std::pair(std::move(read), std::move(collected));
  });
  const bool is_smoothed = kind == ReferenceKind::kSmoother;
  MotionReference motion =
      motion_reference(label, setup, data, is_smoothed ? ReferenceKind::kNone : kind);
  return {label, std::move(setup), std::move(data), std::move(motion), run};
}

}  // namespace

std::vector<ParamSpec> calibration_params() { return param_specs<CalibrationParams>(); }

CalibrationSetup read_calibration_setup(const std::filesystem::path& path,
                                        const std::vector<std::string>& assignments,
                                        PluginRegistry& plugins) {
  Node file = config::load_file(path);
  config::require_file_of("calibrate", file);
  const std::vector<std::string> of_base = assign(assignments, file);
  config::Errors errors;
  constexpr std::string_view kSections[] = {"recordings", "motions", "set"};
  const auto params =
      config::read_section<CalibrationParams>(file, file.mark(), "calibration", errors, kSections);
  errors.throw_if_any();
  CalibrationSetup setup;
  setup.name = params.calibration;
  setup.options = static_cast<const CalibrationOptions&>(params);
  setup.plugins = &plugins;
  if (setup.options.segment_s > 0. && setup.options.segments == Segments::kAuto) {
    setup.options.segments = Segments::kLength;
  }
  const bool by_length = setup.options.segments == Segments::kLength ||
                         setup.options.segments == Segments::kTrajectory;
  if (by_length != (setup.options.segment_s > 0.)) {
    config::fail(file.mark(), by_length ? "segments: length and trajectory need segment_s above 0"
                                        : "segment_s goes with segments: length or trajectory");
  }
  setup.leave_out_by = params.leave_out_by;
  setup.report_by = params.report_by;
  const std::vector<Recording> recordings = read_recordings(file);
  const Node base = load_base(file, of_base);
  require_labels(setup.report_by, recordings, file, "report_by");
  for (const Recording& recording : recordings) {
    refuse_misspelt_labels(recording);
    for (const std::string& label : setup.leave_out_by) {
      if (recording.labels.contains(label)) continue;
      config::fail(
          file.find("leave_out_by")->mark(),
          name_of(recording) + " has no label '" + label + "', by which leave_out_by divides them");
    }
    setup.recordings.push_back(read_recording(recording, base, params.reference, plugins));
    require_one_kind(setup.recordings);
  }
  if (setup.options.reference == ReferenceKind::kSmoother) require_for_smoother(setup, file);
  require_readings_in_segments(setup, file);
  if (file.find("extrinsics_x_m_y_m_yaw_rad") == nullptr) {
    setup.options.extrinsics_x_m_y_m_yaw_rad =
        setup.recordings.front().setup.extrinsics.value_or(PlanarExtrinsics::Zero());
  }
  return setup;
}

std::vector<std::size_t> all_of(const CalibrationSetup& setup) {
  std::vector<std::size_t> all(setup.recordings.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

FitStart start_of(const CalibrationSetup& setup, const JointSearch& search) {
  constexpr double kFoundZero_rad = 0.1;
  const WheelModel& model = *setup.recordings.front().setup.model;
  FitStart start{model.nominal(), model.nominal()};
  for (int i = 0; i < start.sigma.size(); ++i) {
    start.sigma[i] = model.description().intrinsics[static_cast<std::size_t>(i)].prior_sigma;
  }
  for (const int zero : search.zeros) {
    start.x_WI[zero] = search.x_WI[zero];
    start.sigma[zero] = kFoundZero_rad;
  }
  return start;
}

RunResult dead_reckon(const CalibrationRecording& recording, const CalibrationEstimate& estimate) {
  RunSetup calibrated = recording.setup;
  calibrated.x_WI = estimate.x_WI;
  calibrated.sigma = estimate.sigma;
  calibrated.extrinsics = estimate.extrinsics;
  return run_odometry(calibrated, recording.data);
}

namespace {

ValidationRun validate(const CalibrationSetup& setup, std::size_t index,
                       const CalibrationEstimate& estimate) {
  const CalibrationRecording& recording = setup.recordings[index];
  RunSetup nominal = recording.setup;
  nominal.x_WI = nominal.model->nominal();
  nominal.extrinsics = setup.options.extrinsics_x_m_y_m_yaw_rad;
  return {index, run_odometry(nominal, recording.data), dead_reckon(recording, estimate)};
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

/// What is to be found before a fit; drives that turn backwards are put right in the recordings.
JointSearch find_joints(CalibrationSetup& setup, WorkProgress& progress) {
  if (!setup.options.find_steering_zeros && !setup.options.find_drive_signs) return {};
  progress.begin("search", 1);
  JointSearch search = search_joints(setup, all_of(setup));
  progress.done("joints of the wheels");
  reverse_drives(setup, search.drive_signs);
  return search;
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

void TurnAgreement::add(double wheels_rad, double reference_rad) {
  ++segments;
  wheels_rad2 += wheels_rad * wheels_rad;
  reference_rad2 += reference_rad * reference_rad;
  product_rad2 += wheels_rad * reference_rad;
}

double TurnAgreement::correlation() const {
  const double size = std::sqrt(wheels_rad2 * reference_rad2);
  return size > 0. ? product_rad2 / size : 0.;
}

double TurnAgreement::ratio() const {
  return wheels_rad2 > 0. ? std::sqrt(reference_rad2 / wheels_rad2) : 0.;
}

CalibrationResult calibrate(CalibrationSetup& setup, WorkProgress& progress) {
  const std::vector<FitOf> fits = fits_of(setup);
  CalibrationResult result;
  result.search = find_joints(setup, progress);
  const FitStart start = start_of(setup, result.search);
  const bool is_smoothed = setup.options.reference == ReferenceKind::kSmoother;
  const CalibrationOptions options =
      is_smoothed ? setup.options : choose_segments(setup, start, result, progress);
  progress.begin("fits", static_cast<int>(fits.size()));
  std::vector<CalibrationEstimate> estimates(fits.size());
  parallel_for(fits.size(), [&](std::size_t f) {
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < setup.recordings.size(); ++i) {
      if (!fits[f].leaves_out(setup.recordings[i])) used.push_back(i);
    }
    if (is_smoothed) {
      smoother::Smoothed smoothed = smooth(setup, used, f == 0 ? progress : no_progress());
      estimates[f] = estimate_of(smoothed, setup);
      if (f == 0) result.smoothed = std::move(smoothed);
    } else {
      estimates[f] = fit(setup, used, options, start);
    }
    progress.done((fits[f].label.empty() ? "all recordings"
                                         : "without " + fits[f].label + " " + fits[f].value) +
                  ": " + std::to_string(estimates[f].iterations) + " iterations");
  });
  result.setup = &setup;
  result.all = estimates[0];
  result.wander = find_wander(setup, result.all.x_WI);
  result.sigma_of_fit = result.all.sigma;
  for (const std::string& label : setup.leave_out_by) {
    result.left_out.push_back({label, spread_of(label, fits, estimates), {}});
    // What is held has no sigma, whatever is left out.
    result.all.sigma = (result.all.sigma.array() > 0.)
                           .select(result.all.sigma.cwiseMax(result.left_out.back().spread), 0.);
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
  judge(result);
  return result;
}

}  // namespace viwo::calibration
