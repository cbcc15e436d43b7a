#include "viwo/setup/filter_setup.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>
#include <utility>

#include "calibration_start.hpp"
#include "section.hpp"
#include "section_params.hpp"
#include "update_setup.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/math/rpy.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/random.hpp"
#include "viwo/sim/true_cameras.hpp"

namespace viwo {
namespace {

using config::Errors;
using config::Node;
using Eigen::Vector3d;

/// A section, and resolved; nothing if something in it is wrong.
template <class T>
std::optional<T> read_section(const Node& section, const std::string& path, Node& resolved,
                              Errors& errors) {
  const std::size_t before = errors.size();
  const T params = config::read_section<T>(section, section.mark(), path, errors);
  if (errors.size() > before) return std::nullopt;
  resolved = config::write_section(params);
  return params;
}

void read_estimator(const EstimatorParams& p, FilterSetup& setup) {
  setup.options.filter.clones = p.clones;
  setup.options.filter.first_estimates = p.first_estimates;
  setup.options.filter.gravity_m_per_s2 = p.gravity_m_per_s2;
  setup.options.growing_window = p.growing_window;
  setup.options.schedule.max_epoch_s = p.max_epoch_s;
  setup.options.schedule.max_wait_s = p.max_wait_s;
  setup.options.imu.max_gap_s = p.max_imu_gap_s;
  setup.options.health.max_speed_m_per_s = p.max_speed_m_per_s;
  setup.options.runner.max_update_failures = p.max_update_failures;
  setup.options.monitor.enabled = p.monitor;
  setup.options.monitor.window_s = p.monitor_window_s;
  setup.options.monitor.min_information = p.monitor_min_information;
  setup.options.monitor.hold = p.hold_unexcited;
  setup.restart = p.restart;
  StartSetup& start = setup.start;
  start.mode = p.start;
  start.window_s = p.start_window_s;
  start.sigma_orientation_rad = p.sigma_start_orientation_rad;
  start.sigma_position_m = p.sigma_start_position_m;
  start.sigma_velocity_m_per_s = p.sigma_start_velocity_m_per_s;
  start.sigma_gyro_bias_rad_per_s = p.sigma_start_gyro_bias_rad_per_s;
  start.sigma_accel_bias_m_per_s2 = p.sigma_start_accel_bias_m_per_s2;
  start.state_error_scale = p.start_error_scale;
}

/// What `read` reads from the file that `section` names with the key `kalibr`; nothing if it
/// cannot.
template <class Read>
auto from_kalibr(const std::filesystem::path& file, const Node& section, const std::string& path,
                 Read read, Errors& errors) -> std::optional<decltype(read(file))> {
  try {
    return read(file);
  } catch (const InputError& error) {
    errors.add(section.find("kalibr")->mark(), path + ".kalibr: " + error.what());
    return std::nullopt;
  }
}

/// The noises of the section `imu`, as numbers or in a Kalibr file, whose numbers then are written
/// into the resolved section in its place.
void read_imu(ImuParams p, const Node& section, FilterSetup& setup, Node& resolved,
              Errors& errors) {
  if (!p.kalibr.empty()) {
    for (const ParamSpec& spec : param_specs<sim::ImuNoiseParams>()) {
      const Node::Entry* const written = section.find_entry(spec.name);
      if (written == nullptr) continue;
      errors.add(written->key_mark,
                 "imu." + spec.name + ": imu.kalibr gives it, too - write either");
    }
    const auto from_file = from_kalibr(p.kalibr, section, "imu", log::read_kalibr_imu, errors);
    if (!from_file) return;
    p.set_densities(*from_file);
    p.kalibr.clear();
    resolved.set("imu", config::write_section(p));
  }
  setup.options.filter.imu_noise = p.densities();
  setup.options.imu.max_gyro_rad_per_s = p.range_gyro_rad_per_s;
  setup.options.imu.max_accel_m_per_s2 = p.range_accel_m_per_s2;
}

/// How wrong calibration starts, in prior sigmas.
struct CalibrationError {
  double scale = 0.;
  EstimatorParams::Draw draw = EstimatorParams::Draw::kGaussian;
};

/// Draws how wrong calibration starts: the same whether it is then calibrated or not.
class WrongStart {
 public:
  WrongStart(CalibrationError error, std::uint64_t seed, std::uint64_t index)
      : error_(error), random_(seed, sim::Stream::kCalibrationError, index) {}
  double draw(double sigma) {
    const double gaussian = random_.gaussian();
    switch (error_.draw) {
      case EstimatorParams::Draw::kSign:
        return std::copysign(error_.scale * sigma, gaussian);
      case EstimatorParams::Draw::kPlus:
        return error_.scale * sigma;
      default:
        return error_.scale * sigma * gaussian;
    }
  }
  /// Each axis.
  Vector3d draw(const Vector3d& sigma) {
    Vector3d errors;
    for (int i = 0; i < 3; ++i) errors[i] = draw(sigma[i]);
    return errors;
  }
  bool is_wrong() const { return error_.scale > 0.; }

 private:
  CalibrationError error_;
  sim::RandomStream random_;
};

/// Draws of cameras follow those of any number of wheel sets.
constexpr std::uint64_t kFirstCameraDraw = 1000;

/// Moves a camera off by draws from its prior; what it was goes to `drawn_from`.
void make_wrong(CameraPrior& prior, WrongStart& wrong, std::vector<CameraView>& drawn_from) {
  if (!wrong.is_wrong()) return;
  CameraView& camera = prior.camera;
  drawn_from.push_back(camera);
  camera.R_ItoC = exp_so3(wrong.draw(Vector3d(prior.sigma_extrinsics.head<3>()))) * camera.R_ItoC;
  camera.p_IinC += wrong.draw(Vector3d(prior.sigma_extrinsics.tail<3>()));
  for (int i = 0; i < 8; ++i) camera.intrinsics[i] += wrong.draw(prior.sigma_intrinsics[i]);
}

void read_cameras(const CamerasParams& p, const Node& section, CalibrationError error,
                  const ReadContext& context, FilterSetup& setup, Errors& errors) {
  auto cameras = from_kalibr(p.kalibr, section, "cameras", log::read_kalibr_cameras, errors);
  if (!cameras) return;
  const auto use = static_cast<std::size_t>(p.use);
  if (use > cameras->size()) {
    errors.add(section.find("use")->mark(), "cameras.use: there are only " +
                                                std::to_string(cameras->size()) + " in " +
                                                p.kalibr.string());
    return;
  }
  if (use > 0) cameras->resize(use);
  const bool calibrates = p.calibrate;
  if (!calibrates) error.scale = 0.;
  WrongStart clock(error, context.seed, kFirstCameraDraw);
  std::optional<double> later_s;  // of all that share one clock
  std::vector<CameraView> drawn_from;
  for (const CameraView& camera : *cameras) {
    const std::size_t index = setup.cameras.size();
    CameraPrior prior;
    prior.camera = camera;
    prior.shares_clock = p.synchronised;
    prior.sigma_extrinsics.head<3>().setConstant(p.sigma_orientation_rad);
    prior.sigma_extrinsics.tail<3>().setConstant(p.sigma_position_m);
    prior.sigma_intrinsics.head<4>().setConstant(p.sigma_focal_px);
    prior.sigma_intrinsics.tail<4>().setConstant(p.sigma_distortion);
    prior.sigma_clock_s = p.sigma_t_CtoI_s;
    if (context.start != nullptr) context.start->take_camera(index, prior, errors);
    if (!later_s) later_s = clock.draw(prior.sigma_clock_s);
    WrongStart wrong(error, context.seed, kFirstCameraDraw + 1 + index);
    make_wrong(prior, wrong, drawn_from);
    const double own_s = wrong.draw(prior.sigma_clock_s);
    if (wrong.is_wrong()) prior.camera.t_CtoI_s += prior.shares_clock ? *later_s : own_s;
    if (!calibrates || !p.calibrate_extrinsics) prior.sigma_extrinsics.setZero();
    if (!calibrates || !p.calibrate_intrinsics) prior.sigma_intrinsics.setZero();
    if (!calibrates || !p.calibrate_time_offset) prior.sigma_clock_s = 0.;
    setup.cameras.push_back(prior);
  }
  for (const CalibrationSample& true_one : sim::camera_truth(drawn_from, 0)) {
    setup.drawn_from[true_one.name] = true_one.value;
  }
}

/// A wheel set from its section `wheels`; the intrinsics and their sigmas are those of its model.
void read_wheels(const WheelsParams& p, WheelSet set, CalibrationError error,
                 const ReadContext& context, FilterSetup& setup, Errors& errors) {
  WheelsPrior& prior = set.prior;
  prior.sensor = p.sensor;
  prior.wheels.model = &set.model->model();
  prior.wheels.R_ItoO = rotation_of_rpy(p.rpy_ItoO_rad);
  prior.wheels.p_IinO = p.p_IinO_m;
  prior.wheels.t_OtoI_s = p.t_OtoI_s;
  prior.sigma_extrinsics << p.sigma_R_ItoO_rad, p.sigma_p_IinO_m;
  prior.sigma_time_offset_s = p.sigma_t_OtoI_s;
  if (context.start != nullptr) context.start->take_mount_and_clock(prior, errors);
  for (Eigen::Index i = 0; i < prior.sigma_intrinsics.size(); ++i) {
    const IntrinsicSpec& spec = set.model->description().intrinsics[static_cast<std::size_t>(i)];
    double& sigma = prior.sigma_intrinsics[i];
    if (!spec.gauge_fixed) continue;
    // A calibration.yaml has a sigma where O was placed by something else than the gauge.
    if (p.hold_gauge) sigma = 0.;
    if (!p.hold_gauge && sigma == 0.) sigma = spec.prior_sigma;
  }

  WrongStart wrong(error, context.seed, setup.wheels.size());
  const Vector3d turn = wrong.draw(Vector3d(prior.sigma_extrinsics.head<3>()));
  const Vector3d shift = wrong.draw(Vector3d(prior.sigma_extrinsics.tail<3>()));
  const double later = wrong.draw(prior.sigma_time_offset_s);
  if (wrong.is_wrong()) {
    prior.wheels.R_ItoO = exp_so3(turn) * prior.wheels.R_ItoO;
    prior.wheels.p_IinO += shift;
    prior.wheels.t_OtoI_s += later;
    for (Eigen::Index i = 0; i < prior.wheels.x_WI.size(); ++i) {
      prior.wheels.x_WI[i] += wrong.draw(prior.sigma_intrinsics[i]);
    }
  }
  prior.intrinsics_walk = p.intrinsics_walk_per_sqrt_s;
  if (const double wander = p.intrinsics_wander; wander > 0. && !context.exact) {
    prior.sigma_wander.resize(prior.wheels.x_WI.size());
    for (Eigen::Index i = 0; i < prior.wheels.x_WI.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      prior.sigma_wander[i] = wander * set.model->description().intrinsics[k].prior_sigma;
    }
    prior.wander_time_s = p.intrinsics_wander_time_s;
  }
  if (!p.calibrate_extrinsics) prior.sigma_extrinsics.setZero();
  if (!p.calibrate_time_offset) prior.sigma_time_offset_s = 0.;
  if (!p.calibrate_intrinsics) prior.sigma_intrinsics.setZero();
  setup.wheels.push_back(std::move(set));
}

/// Further wheel sets: NAME: {kinematics: {...}, wheels: {...}}.
void read_wheel_sets(const Node& run, CalibrationError error, const ReadContext& context,
                     FilterSetup& setup, Node& resolved, Errors& errors) {
  const Node* sets = run.find("wheel_sets");
  if (sets == nullptr) return;
  if (!sets->is_map()) {
    errors.add(sets->mark(), "'wheel_sets' is a section NAME: {kinematics: ..., wheels: ...}");
    return;
  }
  Node resolved_sets = Node::empty_map(sets->mark());
  for (const auto& entry : sets->entries()) {
    if (!is_name(entry, "wheel_sets", errors)) continue;
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
    const std::string model_path = path + ".kinematics";
    const auto model = context.plugins.make_kinematics(
        *kinematics, model_path, instance_seed(context.seed, "kinematics", model_path), errors);
    Node resolved_wheels;
    const auto params = read_section<WheelsParams>(section_or_empty(entry.value, "wheels"),
                                                   path + ".wheels", resolved_wheels, errors);
    if (!model.object || !params) continue;
    WheelSet set;
    set.prior.name = entry.key;
    set.model = guarded(model.info, "describe",
                        [&] { return std::make_shared<const WheelModel>(model.object); });
    set.prior.wheels.x_WI = set.model->nominal();
    set.prior.sigma_intrinsics = set.model->prior_sigma();
    set.info = model.info;
    if (context.start != nullptr && context.start->has_wheels(entry.key, set.info.name)) {
      context.start->take_intrinsics(entry.key, *set.model, set.info.name, set.prior.wheels.x_WI,
                                     set.prior.sigma_intrinsics, errors);
    }
    read_wheels(*params, std::move(set), error, context, setup, errors);
    Node resolved_set = Node::empty_map();
    resolved_set.set("kinematics", model.resolved);
    resolved_set.set("wheels", resolved_wheels);
    resolved_sets.set(entry.key, resolved_set);
  }
  resolved.set("wheel_sets", resolved_sets);
}

/// A wheel set whose sensor does not exist would get no samples and never say so.
void check_wheel_sensors(const Node& run, const FilterSetup& setup, Errors& errors) {
  const Node* sensors = run.find("sensors");
  if (sensors == nullptr || !sensors->is_map()) return;
  std::vector<std::string> names;
  for (const auto& entry : sensors->entries()) names.push_back(entry.key);
  for (const WheelSet& set : setup.wheels) {
    const std::string &name = set.prior.name, &sensor = set.prior.sensor;
    if (sensor.empty() || sensors->find(sensor) != nullptr) continue;
    const Node* at = &run;
    if (!name.empty()) at = at->find("wheel_sets")->find(name);
    errors.add(at->find("wheels")->find("sensor")->mark(),
               (name.empty() ? "" : "wheel_sets." + name + ".") + "wheels.sensor: no sensor '" +
                   sensor + "'" + config::did_you_mean(sensor, names));
  }
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
                        const Intrinsics& x_WI, const Intrinsics& sigma, const ReadContext& context,
                        Node& resolved, Errors& errors) {
  FilterSetup setup;
  const auto read = [&]<class T>(const char* key, std::type_identity<T>) {
    Node section = Node::empty_map();
    const auto params = read_section<T>(section_or_empty(run, key), key, section, errors);
    if (params) resolved.set(key, section);
    return params;
  };
  CalibrationError error;
  if (const auto params = read("estimator", std::type_identity<EstimatorParams>())) {
    read_estimator(*params, setup);
    if (setup.options.monitor.hold && !setup.options.monitor.enabled) {
      errors.add(run.find("estimator")->mark(),
                 "estimator.hold_unexcited needs estimator.monitor: true");
    }
    if (!context.exact) error = {params->calibration_error_scale, params->calibration_error};
    if (context.exact) setup.start.state_error_scale = 0.;
  }
  if (const auto params = read("imu", std::type_identity<ImuParams>())) {
    read_imu(*params, section_or_empty(run, "imu"), setup, resolved, errors);
  }
  if (run.find("cameras") != nullptr) {
    if (const auto params = read("cameras", std::type_identity<CamerasParams>())) {
      read_cameras(*params, *run.find("cameras"), error, context, setup, errors);
    }
  }
  if (model != nullptr) {
    if (const auto params = read("wheels", std::type_identity<WheelsParams>())) {
      WheelSet set;
      set.model = model;
      set.prior.wheels.x_WI = x_WI;
      set.prior.sigma_intrinsics = sigma;
      read_wheels(*params, std::move(set), error, context, setup, errors);
    }
  }
  read_wheel_sets(run, error, context, setup, resolved, errors);
  check_wheel_sensors(run, setup, errors);
  // Starts that are made wrong are drawn entry by entry.
  if (context.start != nullptr && error.scale == 0.) {
    setup.options.filter.correlations = context.start->correlations();
  }
  read_updates(run, context, setup, resolved, errors);
  return setup;
}

}  // namespace viwo
