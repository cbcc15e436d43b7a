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
#include "viwo/camera/camera_chain.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/math/rpy.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/random.hpp"
#include "viwo/sim/true_cameras.hpp"
#include "wheels_setup.hpp"
#include "wrong_start.hpp"

namespace viwo {
namespace {

using config::Errors;
using config::Node;
using Eigen::Vector3d;

void read_estimator(const EstimatorParams& p, FilterSetup& setup) {
  setup.options.filter.clones = p.clones;
  setup.options.filter.consistency = p.consistency;
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

/// Draws of cameras follow those of any number of wheel sets.
constexpr std::uint64_t kFirstCameraDraw = 1000;

/// Moves cameras off by draws from their priors, one after the other; what they were is
/// `drawn_from`.
struct WrongCameras {
  ChainedErrors turns, shifts;
  std::vector<CameraView> drawn_from = {};

  void make_wrong(CameraPrior& prior, WrongStart& wrong) {
    if (!wrong.is_wrong()) return;
    CameraView& camera = prior.camera;
    drawn_from.push_back(camera);
    const auto& sigma = prior.sigma_extrinsics;
    const Vector3d turn = turns.next(camera.R_ItoC, wrong.draw(Vector3d(sigma.head<3>())));
    camera.p_IinC += shifts.next(camera.R_ItoC, wrong.draw(Vector3d(sigma.tail<3>())));
    camera.R_ItoC = exp_so3(turn) * camera.R_ItoC;
    for (int i = 0; i < 8; ++i) camera.intrinsics[i] += wrong.draw(prior.sigma_intrinsics[i]);
  }
};

/// What the cameras of a file are off by together.
PriorCorrelations chain_of(const std::vector<CameraPrior>& cameras, double relative) {
  PriorCorrelations chain;
  if (relative == 1. || cameras.size() < 2 || cameras[0].sigma_extrinsics.isZero(0.)) return chain;
  std::vector<CameraView> views;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    views.push_back(cameras[i].camera);
    const BlockSpec extrinsics = camera_blocks(i, cameras[i]).front();
    for (const BlockEntry& entry : extrinsics.entries) chain.entries.push_back(entry.name);
  }
  chain.matrix = chain_correlations(relative, views);
  return chain;
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
  // A calibration.yaml tells by itself what hangs together.
  const bool is_known = context.start != nullptr && context.start->has_cameras();
  const double relative = is_known ? 1. : p.relative;
  WrongCameras wrong_cameras{ChainedErrors(relative), ChainedErrors(relative)};
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
    wrong_cameras.make_wrong(prior, wrong);
    const double own_s = wrong.draw(prior.sigma_clock_s);
    if (wrong.is_wrong()) prior.camera.t_CtoI_s += prior.shares_clock ? *later_s : own_s;
    if (!calibrates || !p.calibrate_extrinsics) prior.sigma_extrinsics.setZero();
    if (!calibrates || !p.calibrate_intrinsics) prior.sigma_intrinsics.setZero();
    if (!calibrates || !p.calibrate_time_offset) prior.sigma_clock_s = 0.;
    setup.cameras.push_back(prior);
  }
  for (const CalibrationSample& true_one : sim::camera_truth(wrong_cameras.drawn_from, 0)) {
    setup.drawn_from[true_one.name] = true_one.value;
  }
  setup.options.filter.correlations.append(chain_of(setup.cameras, relative));
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
    auto params = read_section<T>(section_or_empty(run, key), key, section, errors);
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
    // Wheels alone begin with what is nominal.
    if (!context.exact && wants_filter(run)) {
      error = {params->calibration_error_scale, params->calibration_error};
    }
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
      read_wheels(*params, section_or_empty(run, "wheels"), std::move(set), error, context, setup,
                  errors);
    }
  }
  read_wheel_sets(run, error, context, setup, resolved, errors);
  check_wheel_sensors(run, setup, errors);
  setup.options.filter.correlations.append(correlations_of(setup.wheels));
  // Starts of a file that are made wrong are drawn entry by entry.
  if (context.start != nullptr && error.scale == 0.) {
    setup.options.filter.correlations.append(context.start->correlations());
  }
  read_updates(run, context, setup, resolved, errors);
  return setup;
}

}  // namespace viwo
