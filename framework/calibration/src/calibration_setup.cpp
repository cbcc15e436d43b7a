// The file of a calibration, read and checked, with its recordings.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "motion_reference.hpp"
#include "recording_name.hpp"
#include "segment_choice.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/config/file_kind.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/math/significant.hpp"

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
      {.help = "labels of the recordings whose values are left out of the fit in turn; by default "
               "motion and repetition, for what is predicted without them, where there are two"});
    b(VIWO_PARAM(report_by), {.help = "labels of the recordings to break the tables down by"});
    CalibrationOptions::bind(b);
  }
};

/// Assignments to keys of the calibration file itself; the others are for its base.
std::vector<std::string> assign(const std::vector<std::string>& assignments, Node& file) {
  std::vector<std::string> others;
  for (const std::string& text : assignments) {
    const config::Assignment assignment = config::parse_assignment(text);
    const auto& specs = param_specs<CalibrationParams>();
    // A run may begin with a calibration, too.
    const bool is_own = assignment.path != "calibration" &&
                        std::any_of(specs.begin(), specs.end(), [&](const ParamSpec& spec) {
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

/// What a calibration is to be judged by, where the file does not say: labels that divide the
/// recordings, each in a way of its own, where a trajectory can judge. A smoother takes too long.
std::vector<std::string> usual_labels(const CalibrationSetup& setup) {
  std::vector<std::string> out;
  std::set<std::vector<std::set<std::size_t>>> seen;
  const bool can_be_judged =
      std::any_of(setup.recordings.begin(), setup.recordings.end(),
                  [](const CalibrationRecording& one) { return !one.data.reference.empty(); });
  if (setup.options.reference == ReferenceKind::kSmoother || !can_be_judged) return out;
  for (const std::string label : {"motion", "repetition"}) {
    std::map<std::string, std::set<std::size_t>> by_value;
    for (std::size_t i = 0; i < setup.recordings.size(); ++i) {
      const auto& labels = setup.recordings[i].label.labels;
      if (const auto found = labels.find(label); found != labels.end()) {
        by_value[found->second].insert(i);
      }
    }
    std::vector<std::set<std::size_t>> parts;
    std::size_t recordings = 0;
    for (const auto& [value, part] : by_value) {
      parts.push_back(part);
      recordings += part.size();
    }
    std::sort(parts.begin(), parts.end());
    if (parts.size() > 1 && recordings == setup.recordings.size() && seen.insert(parts).second) {
      out.push_back(label);
    }
  }
  return out;
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
  if (file.find("leave_out_by") == nullptr) {
    setup.leave_out_by = usual_labels(setup);
    setup.leave_out_is_asked = false;
  }
  require_readings_in_segments(setup, file);
  if (file.find("extrinsics_x_m_y_m_yaw_rad") == nullptr) {
    setup.options.extrinsics_x_m_y_m_yaw_rad =
        setup.recordings.front().setup.extrinsics.value_or(PlanarExtrinsics::Zero());
  }
  return setup;
}

}  // namespace viwo::calibration
