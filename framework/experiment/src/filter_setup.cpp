#include "viwo/experiment/filter_setup.hpp"

#include <algorithm>
#include <utility>

#include "filter_params.hpp"
#include "section.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/random.hpp"

namespace viwo::experiment {
namespace {

using config::Errors;
using config::Node;
using Eigen::Vector3d;

/// The values of a section, resolved; nothing if something in it is wrong.
std::optional<ParamSet> read_section(const Node& section, const std::string& path,
                                     std::span<const ParamSpec> specs, Node& resolved,
                                     Errors& errors) {
  const std::size_t before = errors.size();
  const ParamSet params = config::read_params(section, section.mark(), path, specs, {}, {}, errors);
  if (errors.size() > before) return std::nullopt;
  resolved = config::write_params(specs, params);
  return params;
}

std::optional<Vector3d> three(const ParamSet& params, const char* key, const Node& section,
                              Errors& errors) {
  const auto values = params.numbers(key);
  if (values.size() == 3) return Vector3d(values[0], values[1], values[2]);
  const Node* node = section.find(key);
  errors.add(node != nullptr ? node->mark() : section.mark(),
             "wheels." + std::string(key) + " needs three numbers");
  return std::nullopt;
}

void read_estimator(const ParamSet& p, FilterSetup& setup) {
  setup.options.filter.clones = static_cast<int>(p.integer("clones"));
  setup.options.filter.first_estimates = p.flag("first_estimates");
  setup.options.filter.gravity_m_per_s2 = p.number("gravity_m_per_s2");
  setup.options.growing_window = p.flag("growing_window");
  setup.options.max_epoch_s = p.number("max_epoch_s");
  setup.options.max_wait_s = p.number("max_wait_s");
  setup.options.max_imu_gap_s = p.number("max_imu_gap_s");
  setup.options.max_update_failures = static_cast<int>(p.integer("max_update_failures"));
  setup.options.monitor.enabled = p.flag("monitor");
  setup.options.monitor.window_s = p.number("monitor_window_s");
  setup.options.monitor.min_information = p.number("monitor_min_information");
  setup.options.monitor.hold = p.flag("hold_unexcited");
  StartSetup& start = setup.start;
  start.mode = p.text("start") == "standstill" ? StartMode::kStandstill
               : p.text("start") == "moving"   ? StartMode::kMoving
                                               : StartMode::kReference;
  start.window_s = p.number("start_window_s");
  start.sigma_orientation_rad = p.number("sigma_start_orientation_rad");
  start.sigma_position_m = p.number("sigma_start_position_m");
  start.sigma_velocity_m_per_s = p.number("sigma_start_velocity_m_per_s");
  start.sigma_gyro_bias_rad_per_s = p.number("sigma_start_gyro_bias_rad_per_s");
  start.sigma_accel_bias_m_per_s2 = p.number("sigma_start_accel_bias_m_per_s2");
  start.state_error_scale = p.number("start_error_scale");
}

/// What `read` reads from the file that `section` names with the key `kalibr`; nothing if it
/// cannot.
template <class Read>
auto from_kalibr(const ParamSet& p, const Node& section, const std::string& path, Read read,
                 Errors& errors) -> std::optional<decltype(read(p.text("kalibr")))> {
  try {
    return read(p.text("kalibr"));
  } catch (const InputError& error) {
    errors.add(section.find("kalibr")->mark(), path + ".kalibr: " + error.what());
    return std::nullopt;
  }
}

/// The noises of the section `imu`, as numbers or in a Kalibr file, whose numbers then are written
/// into the resolved section in its place.
void read_imu(ParamSet p, const Node& section, FilterSetup& setup, Node& resolved, Errors& errors) {
  ImuNoise noise;
  const std::pair<const char*, double&> numbers[] = {
      {"sigma_gyro_rad_per_s_sqrt_hz", noise.gyro_rad_per_s_sqrt_hz},
      {"sigma_accel_m_per_s2_sqrt_hz", noise.accel_m_per_s2_sqrt_hz},
      {"sigma_gyro_walk_rad_per_s2_sqrt_hz", noise.gyro_walk_rad_per_s2_sqrt_hz},
      {"sigma_accel_walk_m_per_s3_sqrt_hz", noise.accel_walk_m_per_s3_sqrt_hz}};
  if (!p.text("kalibr").empty()) {
    for (const auto& [key, value] : numbers) {
      const Node::Entry* const written = section.find_entry(key);
      if (written == nullptr) continue;
      errors.add(written->key_mark,
                 "imu." + std::string(key) + ": imu.kalibr gives it, too - write either");
    }
    const auto from_file = from_kalibr(p, section, "imu", log::read_kalibr_imu, errors);
    if (!from_file) return;
    noise = *from_file;
    for (const auto& [key, value] : numbers) p.set(key, value);
    p.set("kalibr", std::string());
    resolved.set("imu", config::write_params(kImuParams, p));
  }
  for (const auto& [key, value] : numbers) value = p.number(key);
  setup.options.filter.imu_noise = noise;
}

void read_cameras(const ParamSet& p, const Node& section, FilterSetup& setup, Errors& errors) {
  auto cameras = from_kalibr(p, section, "cameras", log::read_kalibr_cameras, errors);
  if (!cameras) return;
  const auto use = static_cast<std::size_t>(p.integer("use"));
  if (use > cameras->size()) {
    errors.add(section.find("use")->mark(), "cameras.use: there are only " +
                                                std::to_string(cameras->size()) + " in " +
                                                p.text("kalibr"));
    return;
  }
  if (use > 0) cameras->resize(use);
  for (const CameraView& camera : *cameras) {
    CameraPrior prior;
    prior.camera = camera;
    prior.sigma_extrinsics.head<3>().setConstant(p.number("sigma_orientation_rad"));
    prior.sigma_extrinsics.tail<3>().setConstant(p.number("sigma_position_m"));
    prior.sigma_intrinsics.head<4>().setConstant(p.number("sigma_focal_px"));
    prior.sigma_intrinsics.tail<4>().setConstant(p.number("sigma_distortion"));
    setup.cameras.push_back(prior);
  }
}

/// A wheel set from its section `wheels`; the intrinsics and their sigmas are those of its model.
void read_wheels(const ParamSet& p, const Node& section, WheelSet set, double error_scale,
                 std::uint64_t seed, FilterSetup& setup, Errors& errors) {
  const auto p_IinO = three(p, "p_IinO_m", section, errors);
  const auto rpy = three(p, "rpy_ItoO_rad", section, errors);
  const auto sigma_p = three(p, "sigma_p_IinO_m", section, errors);
  const auto sigma_R = three(p, "sigma_R_ItoO_rad", section, errors);
  if (!p_IinO || !rpy || !sigma_p || !sigma_R) return;
  set.sensor = p.text("sensor");
  WheelsPrior& prior = set.prior;
  prior.name = set.name;
  prior.wheels.model = &set.model->model();
  prior.wheels.R_ItoO = sim::rotation_from_euler(rpy->z(), rpy->y(), rpy->x());
  prior.wheels.p_IinO = *p_IinO;
  prior.wheels.t_OtoI_s = p.number("t_OtoI_s");
  prior.sigma_extrinsics << *sigma_R, *sigma_p;
  prior.sigma_time_offset_s = p.number("sigma_t_OtoI_s");
  if (!p.flag("hold_gauge")) {
    for (Eigen::Index i = 0; i < prior.sigma_intrinsics.size(); ++i) {
      const IntrinsicSpec& spec = set.model->description().intrinsics[static_cast<std::size_t>(i)];
      if (spec.gauge_fixed) prior.sigma_intrinsics[i] = spec.prior_sigma;
    }
  }

  // A start that is wrong is wrong in the same way whether it is then calibrated or not.
  sim::RandomStream random(seed, sim::Stream::kCalibrationError, setup.wheels.size());
  const auto draw = [&](double sigma) { return error_scale * sigma * random.gaussian(); };
  Vector3d turn, shift;
  for (int i = 0; i < 3; ++i) turn[i] = draw(prior.sigma_extrinsics[i]);
  for (int i = 0; i < 3; ++i) shift[i] = draw(prior.sigma_extrinsics[3 + i]);
  const double later = draw(prior.sigma_time_offset_s);
  if (error_scale > 0.) {
    prior.wheels.R_ItoO = exp_so3(turn) * prior.wheels.R_ItoO;
    prior.wheels.p_IinO += shift;
    prior.wheels.t_OtoI_s += later;
    for (Eigen::Index i = 0; i < prior.wheels.x_WI.size(); ++i) {
      prior.wheels.x_WI[i] += draw(prior.sigma_intrinsics[i]);
    }
  }
  if (!p.flag("calibrate_extrinsics")) prior.sigma_extrinsics.setZero();
  if (!p.flag("calibrate_time_offset")) prior.sigma_time_offset_s = 0.;
  if (!p.flag("calibrate_intrinsics")) prior.sigma_intrinsics.setZero();
  setup.wheels.push_back(std::move(set));
}

/// Further wheel sets: NAME: {kinematics: {...}, wheels: {...}}.
void read_wheel_sets(const Node& run, double error_scale, std::uint64_t seed,
                     PluginRegistry& plugins, FilterSetup& setup, Node& resolved, Errors& errors) {
  const Node* sets = run.find("wheel_sets");
  if (sets == nullptr) return;
  if (!sets->is_map()) {
    errors.add(sets->mark(), "'wheel_sets' is a section NAME: {kinematics: ..., wheels: ...}");
    return;
  }
  Node resolved_sets = Node::empty_map(sets->mark());
  for (const auto& entry : sets->entries()) {
    const std::string path = "wheel_sets." + entry.key;
    const Node* kinematics = entry.value.is_map() ? entry.value.find("kinematics") : nullptr;
    if (kinematics == nullptr) {
      errors.add(entry.value.mark(), path + " needs a section 'kinematics'");
      continue;
    }
    for (const auto& part : entry.value.entries()) {
      if (part.key != "kinematics" && part.key != "wheels") {
        errors.add(part.key_mark,
                   path + ": unknown key '" + part.key + "' - known: kinematics, wheels");
      }
    }
    const auto model = plugins.make_kinematics(*kinematics, path + ".kinematics", errors);
    const Node section = section_or_empty(entry.value, "wheels");
    Node resolved_wheels;
    const auto params =
        read_section(section, path + ".wheels", kWheelsParams, resolved_wheels, errors);
    if (!model.object || !params) continue;
    WheelSet set;
    set.name = entry.key;
    set.model = guarded(model.info, "describe",
                        [&] { return std::make_shared<const WheelModel>(model.object); });
    set.prior.wheels.x_WI = set.model->nominal();
    set.prior.sigma_intrinsics = set.model->prior_sigma();
    read_wheels(*params, section, std::move(set), error_scale, seed, setup, errors);
    Node resolved_set = Node::empty_map();
    resolved_set.set("kinematics", model.resolved);
    resolved_set.set("wheels", resolved_wheels);
    resolved_sets.set(entry.key, resolved_set);
  }
  resolved.set("wheel_sets", resolved_sets);
}

/// Whether the estimator can work with an update as it is configured: tried with instances of their
/// own, because an update is started once.
void try_update(const FilterSetup& setup, const std::shared_ptr<Update>& update, int wheels,
                const config::Mark& mark, const std::string& path, Errors& errors) {
  std::vector<WheelsPrior> priors;
  for (const WheelSet& set : setup.wheels) priors.push_back(set.prior);
  try {
    const Estimator estimator(setup.options, setup.cameras, priors, {{path, update, wheels}});
  } catch (const InputError& error) {
    errors.add(mark, path + ": " + error.what());
  }
}

/// A wheel set whose sensor does not exist would get no samples and never say so.
void check_wheel_sensors(const Node& run, const FilterSetup& setup, Errors& errors) {
  const Node* sensors = run.find("sensors");
  if (sensors == nullptr || !sensors->is_map()) return;
  std::vector<std::string> names;
  for (const auto& entry : sensors->entries()) names.push_back(entry.key);
  for (const WheelSet& set : setup.wheels) {
    if (set.sensor.empty() || sensors->find(set.sensor) != nullptr) continue;
    const Node* at = &run;
    if (!set.name.empty()) at = at->find("wheel_sets")->find(set.name);
    errors.add(at->find("wheels")->find("sensor")->mark(),
               (set.name.empty() ? "" : "wheel_sets." + set.name + ".") +
                   "wheels.sensor: no sensor '" + set.sensor + "'" +
                   config::did_you_mean(set.sensor, names));
  }
}

/// Index of the sensor that an update of kind kPoses names, also one that is turned off; -1 for
/// other updates.
int read_pose_sensor(const Node& run, const Node& section, const std::string& path, bool wants_one,
                     FilterSetup& setup, Errors& errors) {
  const Node* sensor = section.find("sensor");
  if (!wants_one) {
    if (sensor != nullptr) {
      errors.add(sensor->mark(), path + ".sensor: only updates that measure with poses have one");
    }
    return -1;
  }
  const Node* sensors = run.find("sensors");
  std::vector<std::string> names;
  if (sensors != nullptr && sensors->is_map()) {
    for (const auto& entry : sensors->entries()) names.push_back(entry.key);
  }
  if (sensor == nullptr || !sensor->is_scalar()) {
    errors.add(section.mark(), path + " needs the sensor that gives its poses (sensor: NAME)");
    return -1;
  }
  const std::string& name = sensor->scalar();
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    errors.add(sensor->mark(),
               path + ".sensor: no sensor '" + name + "'" + config::did_you_mean(name, names));
    return -1;
  }
  auto& known = setup.pose_sensors;
  const auto found = std::find(known.begin(), known.end(), name);
  const auto index = static_cast<int>(found - known.begin());
  if (found == known.end()) known.push_back(name);
  return index;
}

void read_updates(const Node& run, PluginRegistry& plugins, FilterSetup& setup, Node& resolved,
                  Errors& errors) {
  const Node* updates = run.find("updates");
  if (updates == nullptr) return;
  if (!updates->is_map()) {
    errors.add(updates->mark(), "'updates' is a section NAME: {its parameters}");
    return;
  }
  Node resolved_updates = Node::empty_map(updates->mark());
  for (const auto& entry : updates->entries()) {
    const std::string path = "updates." + entry.key;
    Node section = entry.value.is_null() ? Node::empty_map(entry.value.mark()) : entry.value;
    if (!section.is_map()) {
      errors.add(section.mark(), path + " must be a section of parameters ({} for none)");
      continue;
    }
    bool enabled = true;
    if (const Node* flag = section.find("enabled")) {
      if (!flag->is_scalar() || (flag->scalar() != "true" && flag->scalar() != "false")) {
        errors.add(flag->mark(), path + ".enabled must be true or false");
      } else {
        enabled = flag->scalar() == "true";
      }
    }
    // The name says which update it is unless it says so itself.
    if (section.find("type") == nullptr)
      section.set("type", Node::scalar_of(entry.key, entry.key_mark));
    constexpr std::string_view kHostKeys[] = {"enabled", "sensor"};
    // One instance per wheel set; the first also tells which kind it is.
    auto loaded = plugins.make_update(section, path, errors, kHostKeys);
    if (!loaded.object) continue;
    Node resolved_update = loaded.resolved;
    resolved_update.set("enabled", Node::scalar_of(enabled ? "true" : "false"));
    const UpdateKind kind = loaded.object->kind();
    const int poses =
        read_pose_sensor(run, section, path, kind == UpdateKind::kPoses, setup, errors);
    if (const Node* sensor = section.find("sensor")) resolved_update.set("sensor", *sensor);
    resolved_updates.set(entry.key, resolved_update, entry.key_mark);
    if (!enabled) continue;
    const int wheels = kind == UpdateKind::kWheels ? 0 : -1;
    if (errors.empty() && (wheels < 0 || !setup.wheels.empty())) {
      const auto trial = plugins.make_update(section, path, errors, kHostKeys);
      try_update(setup, trial.object, wheels, entry.key_mark, path, errors);
    }
    if (kind != UpdateKind::kWheels) {
      setup.updates.push_back({entry.key, std::move(loaded), -1, poses, entry.key_mark});
      continue;
    }
    if (run.find("kinematics") == nullptr && run.find("wheel_sets") == nullptr) {
      errors.add(entry.key_mark, path + " needs wheels: the run has no section 'kinematics'");
      continue;
    }
    for (std::size_t i = 0; i < setup.wheels.size(); ++i) {
      const std::string name =
          setup.wheels[i].name.empty() ? entry.key : setup.wheels[i].name + "." + entry.key;
      if (i > 0) loaded = plugins.make_update(section, path, errors, kHostKeys);
      setup.updates.push_back({name, loaded, static_cast<int>(i), -1, entry.key_mark});
    }
  }
  resolved.set("updates", resolved_updates);
}

}  // namespace

bool has_filter_sections(const Node& run) {
  for (const char* key : {"estimator", "imu", "cameras", "wheels", "wheel_sets", "updates"}) {
    if (run.find(key) != nullptr) return true;
  }
  return false;
}

bool wants_filter(const Node& run) {
  if (const Node* estimator = run.find("estimator"); estimator != nullptr && estimator->is_map()) {
    const Node* type = estimator->find("type");
    if (type != nullptr && type->is_scalar() && type->scalar() != "auto") {
      return type->scalar() == "msckf";
    }
  }
  return run.find("updates") != nullptr;
}

FilterSetup read_filter(const Node& run, const std::shared_ptr<const WheelModel>& model,
                        const Intrinsics& x_WI, const Intrinsics& sigma, std::uint64_t seed,
                        PluginRegistry& plugins, Node& resolved, Errors& errors) {
  FilterSetup setup;
  const auto read = [&](const char* key, std::span<const ParamSpec> specs) {
    Node section = Node::empty_map();
    const auto params = read_section(section_or_empty(run, key), key, specs, section, errors);
    if (params) resolved.set(key, section);
    return params;
  };
  double error_scale = 0.;
  if (const auto params = read("estimator", kEstimatorParams)) {
    read_estimator(*params, setup);
    if (setup.options.monitor.hold && !setup.options.monitor.enabled) {
      errors.add(run.find("estimator")->mark(),
                 "estimator.hold_unexcited needs estimator.monitor: true");
    }
    error_scale = params->number("calibration_error_scale");
  }
  if (const auto params = read("imu", kImuParams)) {
    read_imu(*params, section_or_empty(run, "imu"), setup, resolved, errors);
  }
  if (run.find("cameras") != nullptr) {
    if (const auto params = read("cameras", kCamerasParams)) {
      read_cameras(*params, *run.find("cameras"), setup, errors);
    }
  }
  if (model != nullptr) {
    if (const auto params = read("wheels", kWheelsParams)) {
      WheelSet set;
      set.model = model;
      set.prior.wheels.x_WI = x_WI;
      set.prior.sigma_intrinsics = sigma;
      read_wheels(*params, section_or_empty(run, "wheels"), std::move(set), error_scale, seed,
                  setup, errors);
    }
  }
  read_wheel_sets(run, error_scale, seed, plugins, setup, resolved, errors);
  check_wheel_sensors(run, setup, errors);
  read_updates(run, plugins, setup, resolved, errors);
  return setup;
}

}  // namespace viwo::experiment
