#include "viwo/observability/observability.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "covariance_track.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/observability/directions.hpp"
#include "viwo/observability/null_space.hpp"

namespace viwo::observability {
namespace {

using config::Node;
using Eigen::MatrixXd;

/// Directions closer to the null space than this are in it.
constexpr double kHiddenAngle = 1e-4;

/// What of a run's sensors is not free of noise when that is asked for.
void note_noise(const RunSetup& run, std::vector<std::string>& notes) {
  for (const SensorEntry& entry : run.sensors) {
    const Loaded<Sensor>& sensor = entry.sensor;
    if (guarded(sensor.info, "can_be_exact", [&] { return sensor.object->can_be_exact(); })) {
      continue;
    }
    const std::string note =
        "sensor '" + entry.name +
        "' cannot be made exact: what its noise seems to tell counts as observed";
    if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
  }
}

std::vector<std::string> imu_names() {
  std::vector<std::string> names;
  for (const char* block : {"theta_GtoI", "p_IinG", "v_IinG", "gyro_bias", "accel_bias"}) {
    for (const char* axis : {"_x", "_y", "_z"}) names.push_back(std::string(block) + axis);
  }
  return names;
}

/// Names of the state's columns.
std::vector<std::string> state_names(const ObservabilityMatrix& state, const Filter& filter) {
  std::vector<std::string> names = imu_names();
  names.resize(static_cast<std::size_t>(state.size()));
  for (std::size_t b = 0; b < filter.blocks().specs().size(); ++b) {
    const int column = filter.blocks().views()[b].column();
    const auto& entries = filter.blocks().specs()[b].entries;
    for (std::size_t i = 0; column >= 0 && i < entries.size(); ++i) {
      const int own = state.state_column(column + static_cast<int>(i));
      if (own >= 0) names[static_cast<std::size_t>(own)] = entries[i].name;
    }
  }
  if (int column = state.feature_column(); column >= 0) {
    for (const char* axis : {"p_FinG_x", "p_FinG_y", "p_FinG_z"}) {
      names[static_cast<std::size_t>(column++)] = axis;
    }
  }
  return names;
}

/// The wheel sets of a run as the filter began, those that it knows of.
std::vector<WheelsView> wheels_of(const FilterSetup& setup, const Filter& filter) {
  std::vector<WheelsView> all;
  for (const WheelSet& set : setup.wheels) {
    WheelsView& wheels = all.emplace_back(set.prior.wheels);
    const auto blocks = wheels_blocks(set.prior);
    int* const columns[] = {&wheels.extrinsics_column, &wheels.time_offset_column,
                            &wheels.intrinsics_column};
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      for (std::size_t b = 0; b < filter.blocks().specs().size(); ++b) {
        if (filter.blocks().specs()[b].name != blocks[i].name) continue;
        *columns[i] = filter.blocks().views()[b].column();
      }
    }
  }
  return all;
}

/// One run of the frozen estimator, watched.
struct Watched {
  RunSetup setup;
  RunData data;
  std::optional<ObservabilityMatrix> state;
  std::optional<CovarianceTrack> track;
  std::vector<std::string> names;
  std::vector<WheelsView> wheels;  ///< as the filter began
  RunResult result;
  MatrixXd M;  ///< triangle in units of the prior sigmas
};

Eigen::VectorXd calibration_sigma(const ObservabilityMatrix& state) {
  return state.prior_sigma().segment(kImuSize,
                                     static_cast<Eigen::Index>(state.calibration_columns().size()));
}

Watched watch(const Node& run, PluginRegistry& plugins, std::vector<std::string>& notes) {
  Watched out;
  out.setup = read_run(run, plugins, {}, true);
  note_noise(out.setup, notes);
  if (!out.setup.filter) {
    throw InputError(out.setup.name +
                     ": observability is that of the filter: the run needs a section 'updates'");
  }
  FilterSetup& filter = *out.setup.filter;
  if (filter.start.mode != StartMode::kReference) {
    throw InputError(out.setup.name + ": observability needs estimator.start: reference");
  }
  filter.options.runner.frozen = true;
  out.data = collect(out.setup);
  FeatureOptions feature;
  feature.enabled = (!out.data.recorded.of<FeatureSample>().empty() || !out.data.streams.empty()) &&
                    !filter.cameras.empty();
  RunHooks hooks;
  hooks.on_start = [&](const Estimator& estimator) {
    out.state.emplace(estimator.filter(), feature);
    out.names = state_names(*out.state, estimator.filter());
    out.wheels = wheels_of(filter, estimator.filter());
    out.track.emplace(out.state->calibration_columns(), calibration_sigma(*out.state), &*out.state);
    return &*out.track;
  };
  out.result = run_filter(out.setup, out.data, hooks);
  if (out.result.status != RunStatus::kOk) {
    throw InputError(out.setup.name + ": " + out.result.cause);
  }
  out.M = out.state->triangle() * out.state->prior_sigma().asDiagonal();
  return out;
}

/// How directions that theory names lie to the null space: those that are hidden become `known`.
void explain(const std::vector<NamedDirections>& sets, const std::string& of,
             const ObservabilityMatrix& state, const MatrixXd& null, MatrixXd& known,
             Observability& out) {
  for (const NamedDirections& set : sets) {
    const MatrixXd basis = orthonormal(state.prior_sigma().cwiseInverse().asDiagonal() * set.basis);
    const MatrixXd hidden = intersection(basis, null, kHiddenAngle);
    ExplainedDirections explained;
    explained.name = of + set.name;
    explained.when = set.when;
    explained.dimension = static_cast<int>(basis.cols());
    explained.hidden = static_cast<int>(hidden.cols());
    explained.max_angle_rad = largest_angle(basis, null);
    // What is hidden only in part is named by something else.
    if (explained.hidden == explained.dimension) {
      MatrixXd both(state.size(), known.cols() + hidden.cols());
      both << known, hidden;
      const auto before = known.cols();
      known = orthonormal(both, 1e-6);
      explained.adds = static_cast<int>(known.cols() - before);
    }
    out.explained.push_back(explained);
  }
}

/// What theory names, and how many dimensions of the null space it leaves unexplained.
void explain(const Watched& run, const MatrixXd& null, Observability& out) {
  const ObservabilityMatrix& state = *run.state;
  const FilterSetup& filter = *run.setup.filter;
  MatrixXd known(state.size(), 0);
  explain(directions_of_the_robot(state, filter.options.filter.gravity_m_per_s2), "", state, null,
          known, out);
  for (std::size_t k = 0; k < run.wheels.size(); ++k) {
    const WheelSet& wheels = filter.wheels[k];
    const std::string& sensor = wheels.prior.sensor;
    const auto samples =
        run.data.recorded.of<EncoderSample>(sensor.empty() ? run.data.wheels_name : sensor);
    if (samples.empty()) continue;
    explain(directions_of_wheels(state, run.wheels[k], *wheels.model, samples[samples.size() / 2]),
            wheels.prior.name.empty() ? "" : wheels.prior.name + ": ", state, null, known, out);
  }
  out.unexplained = static_cast<int>(null.cols() - known.cols());
}

Observability analysis_of(const Watched& run, double tolerance, MatrixXd* basis) {
  const NullSpace null = null_space(run.M, tolerance);
  Observability out;
  out.states = run.names;
  out.state_size = run.state->size() + ObservabilityMatrix::kCloneSize;
  out.rank = null.rank + ObservabilityMatrix::kCloneSize;
  out.unobservable = out.state_size - out.rank;
  out.gap = null.gap;
  out.singular_values = null.singular_values;
  out.null_basis = readable(null.basis);
  *basis = null.basis;
  return out;
}

/// Directions of the calibration alone that are hidden, and how sure the filter is along them: of
/// the frozen run, and of `run` as it is.
void follow_hidden(const Watched& frozen, const MatrixXd& null, RunSetup& run,
                   ObservabilityResult& out) {
  const auto n = static_cast<Eigen::Index>(frozen.state->calibration_columns().size());
  if (n == 0) return;
  MatrixXd calibration = MatrixXd::Zero(frozen.state->size(), n);
  calibration.middleRows(kImuSize, n).setIdentity();
  const MatrixXd hidden = intersection(calibration, null, kHiddenAngle).middleRows(kImuSize, n);
  out.hidden_calibration = static_cast<int>(hidden.cols());
  out.without_noise = frozen.track->along(hidden);
  const RunData data = collect(run);
  CovarianceTrack track(frozen.state->calibration_columns(), calibration_sigma(*frozen.state));
  RunHooks hooks;
  hooks.on_start = [&](const Estimator&) { return &track; };
  run_filter(run, data, hooks);
  out.as_configured = track.along(hidden);
}

/// The calibration parameters of the state as configured.
std::vector<ObservedParameter> parameters_of(const Watched& run, const MatrixXd& null) {
  std::vector<ObservedParameter> out;
  for (const CalibrationTrack& track : run.result.calibration) {
    const auto name = std::find(run.names.begin(), run.names.end(), track.name);
    if (name == run.names.end()) continue;
    const auto i = static_cast<Eigen::Index>(name - run.names.begin());
    ObservedParameter parameter;
    parameter.name = track.name;
    parameter.observable = null.cols() == 0 || null.row(i).norm() < kHiddenAngle;
    parameter.sigma_ratio = track.sigma.back() / run.state->prior_sigma()[i];
    out.push_back(parameter);
  }
  return out;
}

/// Null space of some columns of the state alone: all others are known.
int null_dimension(const Watched& run, const std::vector<int>& columns, double tolerance) {
  if (columns.empty()) return 0;
  const MatrixXd M = run.M(Eigen::all, columns);
  return M.isZero(0.) ? static_cast<int>(columns.size())
                      : static_cast<int>(columns.size()) - null_space(M, tolerance).rank;
}

/// What the first wheel set tells of its intrinsics when poses are known.
void look_at_wheels_alone(const Watched& run, double tolerance, ObservabilityResult& out) {
  if (run.wheels.empty() || run.wheels.front().intrinsics_column < 0) return;
  const WheelsView& wheels = run.wheels.front();
  std::vector<int> columns;
  const auto add = [&](int filter_column) {
    const int own = run.state->state_column(filter_column);
    if (own >= 0) columns.push_back(own);
  };
  for (int i = 0; i < wheels.x_WI.size(); ++i) add(wheels.intrinsics_column + i);
  out.n_intrinsics = static_cast<int>(columns.size());
  out.wheels_alone = null_dimension(run, columns, tolerance);
  if (wheels.extrinsics_column < 0) return;
  for (const int i : {2, 3, 4}) add(wheels.extrinsics_column + i);
  out.wheels_and_mount = null_dimension(run, columns, tolerance);
}

/// What a motion shows is asked, not what a prior says of one entry by another.
void ask_motion_alone(Node& run) {
  const Node exact = Node::scalar_of("true");
  if (run.find("kinematics") != nullptr) config::set_path(run, "wheels.held_are_exact", exact);
  const Node* const sets = run.find("wheel_sets");
  if (sets == nullptr || !sets->is_map()) return;
  std::vector<std::string> paths;
  for (const auto& set : sets->entries()) {
    paths.push_back("wheel_sets." + set.key + ".wheels.held_are_exact");
  }
  for (const std::string& path : paths) config::set_path(run, path, exact);
}

}  // namespace

ExperimentSetup read_observability(const std::filesystem::path& path,
                                   const ExperimentOptions& options) {
  const Node file = config::load_file(path);
  if (file.find("variants") != nullptr) return read_experiment(path, options);
  ExperimentSetup setup;
  setup.name = path.stem().string();
  setup.base = load_run_configuration(path, options.assignments);
  setup.variants = {{"run", Node::empty_map()}};
  setup.recordings = {{}};
  return setup;
}

ObservabilityReport analyse(const ExperimentSetup& setup, PluginRegistry& plugins,
                            WorkProgress& progress, double tolerance) {
  ObservabilityReport report;
  report.setup = setup;
  report.tolerance = tolerance;
  const auto begin = std::chrono::steady_clock::now();
  progress.begin(setup.name, static_cast<int>(setup.recordings.size() * setup.variants.size()));
  for (std::size_t m = 0; m < setup.recordings.size(); ++m) {
    for (std::size_t v = 0; v < setup.variants.size(); ++v) {
      ObservabilityResult result;
      result.motion = m;
      result.variant = v;
      Node cell = configuration_of(setup, setup.variants[v], setup.recordings[m]);
      ask_motion_alone(cell);
      RunSetup configured =
          of_recording(setup.recordings[m], [&] { return read_run(cell, plugins); });
      Node run = configured.resolved;
      MatrixXd null;
      const Watched held = watch(run, plugins, report.notes);
      result.held = analysis_of(held, tolerance, &null);
      result.parameters = parameters_of(held, null);
      follow_hidden(held, null, configured, result);
      // Each wheel set has a gauge of its own; that of the first is looked at.
      if (Node* wheels = run.find("wheels")) wheels->set("hold_gauge", Node::scalar_of("false"));
      const Watched free = watch(run, plugins, report.notes);
      result.free = analysis_of(free, tolerance, &null);
      explain(free, null, result.free);
      look_at_wheels_alone(free, tolerance, result);
      progress.done(setup.recordings[m].name + "  " + setup.variants[v].name + "  " +
                    std::to_string(result.free.unobservable) + " unobservable, " +
                    std::to_string(result.held.unobservable) + " with the gauge held");
      report.results.push_back(std::move(result));
    }
  }
  report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace viwo::observability
