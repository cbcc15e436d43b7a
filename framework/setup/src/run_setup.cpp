// Reading a run configuration.
#include "viwo/setup/run_setup.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "calibration_start.hpp"
#include "camera_check.hpp"
#include "section.hpp"
#include "section_params.hpp"
#include "viwo/config/params.hpp"

namespace viwo {
namespace {

using config::Node;

/// The key `input` of a sensor's section; "" if there is none, or if it is wrong.
std::string read_input(const Node::Entry& entry, const Node& sensors, const Loaded<Sensor>& loaded,
                       config::Errors& errors) {
  const std::string path = "sensors." + entry.key;
  const Node* input = entry.value.is_map() ? entry.value.find("input") : nullptr;
  if (!loaded.object) return "";
  const bool takes_input =
      guarded(loaded.info, "takes_input", [&] { return loaded.object->takes_input(); });
  if (input == nullptr) {
    if (takes_input) {
      errors.add(entry.key_mark, path + ": '" + loaded.info.name +
                                     "' needs 'input', the name of the sensor it works on");
    }
    return "";
  }
  if (!takes_input) {
    errors.add(input->mark(), path + ".input: '" + loaded.info.name + "' takes no input");
    return "";
  }
  if (!input->is_scalar() || sensors.find(input->scalar()) == nullptr) {
    errors.add(input->mark(), path + ".input must be the name of another sensor of this run");
    return "";
  }
  return input->scalar();
}

/// Every sensor behind its input. Sensors that have each other as inputs are errors.
void place_behind_inputs(std::vector<SensorEntry> unplaced, const Node& sensors, RunSetup& setup,
                         config::Errors& errors) {
  const auto is_unplaced = [&unplaced](const std::string& name) {
    return std::any_of(unplaced.begin(), unplaced.end(),
                       [&](const SensorEntry& entry) { return entry.name == name; });
  };
  while (!unplaced.empty()) {
    const auto ready = std::find_if(unplaced.begin(), unplaced.end(), [&](const SensorEntry& e) {
      return e.input.empty() || !is_unplaced(e.input);
    });
    if (ready == unplaced.end()) {
      errors.add(sensors.mark(), "sensors: '" + unplaced.front().name +
                                     "' has itself as input, by way of others or not");
      return;
    }
    setup.sensors.push_back(std::move(*ready));
    unplaced.erase(ready);
  }
}

void read_sensors(const Node& run, const ReadContext& context, RunSetup& setup,
                  config::Errors& errors) {
  const Node* sensors = run.find("sensors");
  if (sensors == nullptr || !sensors->is_map() || sensors->entries().empty()) {
    errors.add(sensors != nullptr ? sensors->mark() : run.mark(),
               "'sensors' must be a section that names at least one sensor");
    return;
  }
  setup.sensors_mark = sensors->mark();
  Node resolved = Node::empty_map(sensors->mark());
  constexpr std::string_view kHostKeys[] = {"input"};
  std::uint64_t index = 0;
  std::vector<SensorEntry> unplaced;
  for (const auto& entry : sensors->entries()) {
    if (!is_name(entry, "sensors", errors)) continue;
    // Sensors of one run have seeds of their own; the same sensor keeps its own in every variant.
    const std::uint64_t seed = setup.seed * 1000 + index++;
    auto loaded = context.plugins.make_sensor(entry.value, "sensors." + entry.key, seed, errors,
                                              kHostKeys, context.exact);
    Node section = loaded.resolved;
    std::string input = read_input(entry, *sensors, loaded, errors);
    if (!input.empty()) section.set("input", Node::scalar_of(input));
    resolved.set(entry.key, section, entry.key_mark);
    if (loaded.object) unplaced.push_back({entry.key, std::move(loaded), std::move(input)});
  }
  setup.resolved.set("sensors", resolved);
  place_behind_inputs(std::move(unplaced), *sensors, setup, errors);
}

/// What a calibration.yaml says of the wheels by themselves, and of the reference.
void take_wheels(CalibrationStart& start, RunSetup& setup, config::Errors& errors) {
  const std::string& model = setup.kinematics.info.name;
  if (!start.has_wheels("", model)) return;
  const CalibrationFile& file = start.file();
  start.take_intrinsics("", *setup.model, model, setup.x_WI, setup.sigma, errors);
  setup.preintegration.twist.noise_weighted = file.twist == "noise_weighted";
  constexpr const char* kPose[] = {"x_OinB", "y_OinB", "yaw_OinB"};
  for (int i = 0; i < 3; ++i) {
    const CalibrationEntry* const entry = find(file.reference, kPose[i]);
    if (entry == nullptr) continue;
    if (!setup.extrinsics) setup.extrinsics = PlanarExtrinsics::Zero();
    (*setup.extrinsics)[i] = entry->estimate;
  }
}

void read_kinematics(const Node& run, PluginRegistry& plugins, CalibrationStart* start,
                     RunSetup& setup, config::Errors& errors) {
  const Node* section = run.find("kinematics");
  if (section == nullptr) {
    if (!wants_filter(run)) {
      errors.add(run.mark(),
                 "'kinematics' is missing: the section of the kinematic model (a filter, with "
                 "'updates', does without)");
    }
    return;
  }
  setup.kinematics_mark = section->mark();
  constexpr std::string_view kHostKeys[] = {"calibration"};
  const std::uint64_t seed = instance_seed(setup.seed, "kinematics", "kinematics");
  setup.kinematics = plugins.make_kinematics(*section, "kinematics", seed, errors, kHostKeys);
  if (!setup.kinematics.object) return;
  setup.model = guarded(setup.kinematics.info, "describe", [&] {
    return std::make_shared<const WheelModel>(setup.kinematics.object);
  });
  setup.x_WI = setup.model->nominal();
  setup.sigma = setup.model->prior_sigma();
  Node resolved = setup.kinematics.resolved;
  if (start != nullptr) take_wheels(*start, setup, errors);
  if (const auto file = kinematics_calibration(*section); !file.empty()) {
    resolved.set("calibration", Node::scalar_of(file.string()));
  }
  setup.resolved.set("kinematics", resolved);
}

void read_options(const Node& run, const CalibrationStart* start, RunSetup& setup,
                  config::Errors& errors) {
  const Node odometry = section_or_empty(run, "odometry");
  const Node evaluation = section_or_empty(run, "evaluation");
  const std::size_t before = errors.size();
  auto o = config::read_section<OdometryParams>(odometry, odometry.mark(), "odometry", errors);
  const auto e =
      config::read_section<EvaluationParams>(evaluation, evaluation.mark(), "evaluation", errors);
  if (errors.size() > before) return;
  using Twist = OdometryParams::Twist;
  if (o.twist != Twist::kAuto) {
    setup.preintegration.twist.noise_weighted = o.twist == Twist::kNoiseWeighted;
  }
  setup.preintegration.twist.rank_tolerance = o.rank_tolerance;
  setup.preintegration.parity_gate_probability = o.parity_gate_probability;
  setup.preintegration.parity = false;
  setup.epoch_s = o.epoch_s;
  const CalibrationEntry* const clock =
      start != nullptr ? find(start->file().reference, "t_OtoB") : nullptr;
  if (clock != nullptr && odometry.find("reference_time_offset_s") == nullptr) {
    o.reference_time_offset_s = clock->estimate;
  }
  setup.reference_time_offset_s = o.reference_time_offset_s;
  setup.knows_reference_time_offset =
      clock != nullptr || odometry.find("reference_time_offset_s") != nullptr;
  setup.evaluation.alignment = e.alignment;
  setup.evaluation.segment_lengths_m = e.segment_lengths_m;
  setup.evaluation.max_reference_gap_s = e.reference_max_gap_s;
  if (const auto& place = e.extrinsics_x_m_y_m_yaw_rad; place.size() == 3) {
    setup.extrinsics = PlanarExtrinsics(place[0], place[1], place[2]);
  } else if (!place.empty()) {
    errors.add(evaluation.find("extrinsics_x_m_y_m_yaw_rad")->mark(),
               "evaluation.extrinsics_x_m_y_m_yaw_rad: three numbers, x [m], y [m] and yaw [rad]");
  }
  setup.resolved.set("odometry", config::write_section(o));
  setup.resolved.set("evaluation", config::write_section(e));
}

/// The sensor that the section `wheels` of a run names; "" for none.
std::string wheels_sensor(const Node& run) {
  const Node* wheels = run.find("wheels");
  const Node* sensor = wheels != nullptr && wheels->is_map() ? wheels->find("sensor") : nullptr;
  return sensor != nullptr && sensor->is_scalar() ? sensor->scalar() : "";
}

/// Who gets what; all sections have been read.
Routes read_routes(const Node& run, const RunSetup& setup, std::vector<std::string> measuring,
                   config::Errors& errors) {
  std::vector<SensorYield> sensors;
  for (const SensorEntry& entry : setup.sensors) {
    SensorYield& sensor = sensors.emplace_back();
    sensor.name = entry.name;
    sensor.types =
        guarded(entry.sensor.info, "yields", [&] { return entry.sensor.object->yields(); });
  }
  Wanted wanted;
  if (setup.filter) wanted.streams = setup.filter->streams;
  wanted.filter = setup.filter.has_value();
  wanted.wheels = setup.model != nullptr;
  wanted.wheels_sensor = wheels_sensor(run);
  wanted.measuring = std::move(measuring);
  return Routes::resolve(sensors, wanted, setup.sensors_mark, errors);
}

/// Pose of O in I, seen from above, as a wheel set's mount says.
PlanarExtrinsics planar_mount(const WheelsView& wheels) {
  const Eigen::Matrix3d R_OtoI = wheels.R_ItoO.transpose();
  const Eigen::Vector3d p_OinI = -(R_OtoI * wheels.p_IinO);
  return {p_OinI.x(), p_OinI.y(), std::atan2(R_OtoI(1, 0), R_OtoI(0, 0))};
}

/// Where the run says that O is in the body of the reference, or null.
const Node* place_of_O(const Node& run) {
  const Node* const place = run.at_path("evaluation.extrinsics_x_m_y_m_yaw_rad");
  return place == nullptr || place->items().empty() ? nullptr : place;
}

/// Where O is in the body of the poses tells where the IMU is by way of the wheels' mount.
void require_wheels_for_place(const Node& run, const RunSetup& setup, config::Errors& errors) {
  const Node* const place = place_of_O(run);
  if (!setup.filter || setup.O_in_I || place == nullptr) return;
  errors.add(place->mark(),
             "evaluation.extrinsics_x_m_y_m_yaw_rad: this filter has no wheels, whose O it is of: "
             "errors are of the IMU");
}

/// Wheels that turn the other way are not those that were calibrated.
void require_drive_signs(const CalibrationFile& file, const RunSetup& setup) {
  if (file.drive_signs.empty() || !setup.model) return;
  const std::vector<int> configured = drive_signs(setup);
  if (file.drive_signs == configured) return;
  if (file.drive_signs.size() != configured.size()) {
    throw InputError(file.path.string() + "  'drive_signs' has " +
                     std::to_string(file.drive_signs.size()) + " signs, but kinematics '" +
                     setup.kinematics.info.name + "' has " + std::to_string(configured.size()) +
                     " drives");
  }
  std::string scale;
  for (const int sign : file.drive_signs) {
    scale += (scale.empty() ? "[" : ", ") + std::to_string(sign);
  }
  throw InputError(file.path.string() +
                   "  this calibration is for drives that turn otherwise than configured: write "
                   "sensors." +
                   setup.routes.sensor_of(Consumer::kWheels) + ".drive_scale: " + scale +
                   "], with the sizes that are there");
}

/// The twist of an odometry (joints v_x, v_y and omega_z of the readers of ROS) is no wheels.
void require_no_twist_for_wheels(const Node& run, const RunSetup& setup) {
  if (!setup.model) return;
  for (const NoiseSpec& noise : setup.model->description().noises) {
    if (noise.kind == NoiseKind::kDrive && !noise.parameter.ends_with("rad_per_s")) return;
  }
  const std::string sensor = setup.routes.sensor_of(Consumer::kWheels);
  const Node* const joints = run.at_path("sensors." + sensor + ".drive_joints");
  if (joints == nullptr || joints->items().empty()) return;
  for (const Node& joint : joints->items()) {
    const std::string& name = joint.scalar();
    if (name != "v_x" && name != "v_y" && name != "omega_z") return;
  }
  config::fail(joints->mark(), "sensors." + sensor +
                                   ".drive_joints are the twist of an odometry, but kinematics '" +
                                   setup.kinematics.info.name +
                                   "' takes angular velocities of wheels - did you mean "
                                   "kinematics: {type: body_twist}?");
}

/// The file of `imu.kalibr`; "" for none.
std::filesystem::path file_of_imu(const Node& run) {
  const Node* const file = run.at_path("imu.kalibr");
  if (file == nullptr || !file->is_scalar() || file->scalar().empty()) return {};
  const std::filesystem::path from = file->mark().line > 0 ? file->mark().file : "";
  return std::filesystem::absolute(from.parent_path() / file->scalar()).lexically_normal();
}

/// What the user of a calibration.yaml should know.
void warn_of(const CalibrationStart& start, RunSetup& setup) {
  if (const std::string doubts = doubts_of(start.file()); !doubts.empty()) {
    setup.warnings.push_back("calibration " + doubts);
  }
  if (!setup.filter || start.correlations().entries.empty()) return;
  const std::vector<std::string>& used = setup.filter->options.filter.correlations.entries;
  if (std::ranges::find(used, start.correlations().entries.front()) == used.end()) {
    setup.warnings.push_back(
        "estimator.calibration_error_scale draws each parameter by itself: the correlations of " +
        start.file().path.string() + " are not used");
  }
}

}  // namespace

std::vector<int> drive_signs(const RunSetup& setup) {
  std::vector<int> signs(static_cast<std::size_t>(setup.model->description().n_drive), 1);
  const std::string sensor = setup.routes.sensor_of(Consumer::kWheels);
  const std::string section = "sensors." + sensor + ".drive_";
  const Node* const scale = setup.resolved.at_path(section + "scale");
  if (scale == nullptr) return signs;
  const Node* const channel = setup.resolved.at_path(section + "channel");
  const bool has_order = channel != nullptr && channel->items().size() == scale->items().size();
  for (std::size_t i = 0; i < scale->items().size(); ++i) {
    if (!scale->items()[i].scalar().starts_with('-')) continue;
    // Of the log's channel (J-3), counted from 1; 0 is none.
    const std::size_t drive = has_order ? std::stoul(channel->items()[i].scalar()) - 1 : i;
    if (drive < signs.size()) signs[drive] = -1;
  }
  return signs;
}

WheelSet wheels_alone(const RunSetup& setup) {
  WheelSet set{setup.model, {}};
  set.prior.wheels.x_WI = setup.x_WI;
  set.prior.sigma_intrinsics = setup.sigma;
  return set;
}

RunSetup read_run(const Node& run, PluginRegistry& plugins, std::optional<std::uint64_t> seed,
                  bool exact) {
  RunSetup setup;
  config::Errors errors;
  constexpr std::string_view kSections[] = {"sensors", "kinematics", "odometry",    "evaluation",
                                            "imu",     "cameras",    "wheels",      "wheel_sets",
                                            "updates", "estimator",  "placeholders"};
  const auto top = config::read_section<RunParams>(run, run.mark(), "run", errors, kSections);
  if (errors.empty()) {
    setup.name = top.name;
    setup.seed = seed.value_or(top.seed);
    setup.resolved = config::write_section(top);
    setup.resolved.set("seed", Node::scalar_of(std::to_string(setup.seed)));
  } else {
    setup.resolved = Node::empty_map();
  }
  auto start = read_calibration_start(run, top.calibration, errors);
  CalibrationStart* const from = start ? &*start : nullptr;
  read_kinematics(run, plugins, from, setup, errors);
  read_options(run, from, setup, errors);
  const ReadContext context{plugins, setup.seed, exact, from};
  std::vector<std::string> measuring;
  if (has_filter_sections(run)) {
    // Read also when the wheels run alone: what is wrong in it is wrong.
    FilterSetup filter =
        read_filter(run, setup.model, setup.x_WI, setup.sigma, context, setup.resolved, errors);
    if (!filter.wheels.empty()) {
      const WheelsView& wheels = filter.wheels.front().prior.wheels;
      // Wheels alone have no other use for it than to say whose errors these are.
      if (wants_filter(run) || place_of_O(run) == nullptr) setup.O_in_I = planar_mount(wheels);
      const auto& sigma = filter.wheels.front().prior.sigma_extrinsics;
      setup.O_in_I_is_exact = sigma[2] == 0. && sigma[3] == 0. && sigma[4] == 0.;
      setup.t_OtoI_s = wheels.t_OtoI_s;
    }
    measuring = filter.measuring;
    const bool has_base = setup.model != nullptr && !filter.wheels.empty();
    if (has_base) filter.wheels.front().info = setup.kinematics.info;
    if (wants_filter(run)) setup.filter = std::move(filter);
  }
  setup.imu_file = file_of_imu(run);
  require_wheels_for_place(run, setup, errors);
  read_sensors(run, context, setup, errors);
  if (errors.empty()) setup.routes = read_routes(run, setup, std::move(measuring), errors);
  errors.throw_if_any();
  require_no_twist_for_wheels(run, setup);
  if (start) {
    if (!start->took_anything()) {
      config::fail(start->file().model_mark, "this calibration has nothing that the run has");
    }
    require_drive_signs(start->file(), setup);
    warn_of(*start, setup);
  }
  if (!start || !start->took_cameras()) {
    for (std::string& line : compare_cameras(setup)) setup.warnings.push_back(std::move(line));
  }
  return setup;
}

}  // namespace viwo
