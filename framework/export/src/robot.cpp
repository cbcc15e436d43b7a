#include "robot.hpp"

#include <algorithm>
#include <cmath>

#include "viwo/config/errors.hpp"
#include "viwo/math/number_text.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::exports {
namespace {

struct Named {
  const char* begin;
  const char* unit;
};
/// Of what the formats hold.
constexpr Named kUnits[] = {{"r_", "m"},         {"x_", "m"},        {"y_", "m"},
                            {"k_", "m"},         {"baseline", "m"},  {"track", "m"},
                            {"wheel_base", "m"}, {"delta_o", "rad"}, {"gamma_", "rad"}};

/// Looks intrinsics up and remembers which were used. Those of further wheel sets are left out.
class Intrinsics {
 public:
  explicit Intrinsics(const CalibrationFile& file) : entries_(file.intrinsics) {
    std::erase_if(entries_, [](const auto& e) { return e.name.find('.') != std::string::npos; });
  }

  bool has(const std::string& name) const { return find(entries_, name) != nullptr; }
  bool has_all(const std::vector<std::string>& names) const {
    return std::all_of(names.begin(), names.end(), [&](const auto& name) { return has(name); });
  }
  /// Whether there are stem_1 .. stem_n.
  bool has_each(const std::string& stem, int n) const {
    for (int i = 1; i <= n; ++i) {
      if (!has(stem + std::to_string(i))) return false;
    }
    return n > 0;
  }
  /// 0 without it.
  double take(const std::string& name) {
    const CalibrationEntry* const entry = find(entries_, name);
    if (entry == nullptr) return 0.;
    const double value = entry->estimate;
    used_.push_back(name);
    return value;
  }
  std::vector<std::string> unused() const {
    std::vector<std::string> names;
    for (const CalibrationEntry& entry : entries_) {
      if (std::find(used_.begin(), used_.end(), entry.name) == used_.end()) {
        names.push_back(entry.name);
      }
    }
    return names;
  }

 private:
  CalibrationFile::Entries entries_;
  std::vector<std::string> used_;
};

void add_numbered_wheels(Intrinsics& intrinsics, int n, Robot& robot) {
  robot.base = intrinsics.has_each("x_", n) ? Base::kSteered : Base::kMecanum;
  for (int i = 1; i <= n; ++i) {
    const std::string j = std::to_string(i);
    Wheel wheel{.name = j, .radius_m = intrinsics.take("r_" + j)};
    if (robot.base == Base::kSteered) {
      wheel.steers = true;
      wheel.x_m = intrinsics.take("x_" + j);
      wheel.y_m = intrinsics.take("y_" + j);
      wheel.zero_rad = intrinsics.take("delta_o" + j);
    } else {
      wheel.tan_gamma = std::tan(intrinsics.take("gamma_" + j));
      wheel.k_m = intrinsics.take("k_" + j);
    }
    robot.wheels.push_back(wheel);
  }
}

void add_sides(Intrinsics& intrinsics, Robot& robot) {
  const bool skids = !intrinsics.has("baseline");
  robot.base = skids ? Base::kSkidSteer : Base::kDifferential;
  const double half = 0.5 * intrinsics.take("baseline");
  const double x = intrinsics.take("x_icr");
  const double left = skids ? intrinsics.take("y_icr_left") : half;
  const double right = skids ? intrinsics.take("y_icr_right") : -half;
  robot.track_m = left - right;
  robot.wheels = {
      {.name = "left", .radius_m = intrinsics.take("r_left"), .x_m = x, .y_m = left},
      {.name = "right", .radius_m = intrinsics.take("r_right"), .x_m = x, .y_m = right}};
}

void add_axles(Intrinsics& intrinsics, Robot& robot) {
  robot.base = Base::kAckermann;
  robot.track_m = intrinsics.take("track");
  robot.wheel_base_m = intrinsics.take("wheel_base");
  for (const bool front : {false, true}) {
    for (const std::string side : {"left", "right"}) {
      const std::string name = (front ? "front_" : "rear_") + side;
      Wheel wheel{.name = name, .steers = front};
      // Without encoders of their own the front wheels are taken to be like those behind them.
      wheel.radius_m =
          intrinsics.take((intrinsics.has("r_" + name) ? "r_" + name : "r_rear_" + side));
      wheel.x_m = front ? robot.wheel_base_m : 0.;
      wheel.y_m = (side == "left" ? 0.5 : -0.5) * robot.track_m;
      if (front) wheel.zero_rad = intrinsics.take("delta_o_" + side);
      robot.wheels.push_back(wheel);
    }
  }
}

/// An Ackermann base may have encoders at its rear wheels only, which come first; a side of others
/// may have several drives, and the calibration does not say which ones.
void take_signs(const CalibrationFile& file, Robot& robot) {
  const std::vector<int>& signs = file.drive_signs;
  const std::size_t n = signs.size();
  if (n == 0 || robot.base == Base::kUnknown) return;
  const bool has_sides = robot.base == Base::kDifferential || robot.base == Base::kSkidSteer;
  if (has_sides && n > robot.wheels.size()) {
    const bool are_alike = std::equal(signs.begin() + 1, signs.end(), signs.begin());
    for (Wheel& wheel : robot.wheels) wheel.reversed = are_alike && signs[0] < 0;
    if (!are_alike) {
      robot.beside.push_back("drive_signs of " + std::to_string(n) +
                             " drives (which of them are on which side is not known)");
    }
    return;
  }
  if (n != robot.wheels.size() && !(robot.base == Base::kAckermann && n == 2)) {
    throw InputError(file.path.string() + ": 'drive_signs' has " + std::to_string(n) +
                     " signs for " + std::to_string(robot.wheels.size()) + " wheels");
  }
  for (std::size_t i = 0; i < n; ++i) robot.wheels[i].reversed = signs[i] < 0;
}

/// Throws InputError for sizes that no robot has, also because they are in another unit.
void check_sizes(const CalibrationFile& file) {
  for (const CalibrationEntry& entry : file.intrinsics) {
    const std::string name = entry.name.substr(entry.name.rfind('.') + 1);
    for (const Named& known : kUnits) {
      if (!name.starts_with(known.begin) || entry.unit.empty() || entry.unit == known.unit)
        continue;
      config::fail(entry.mark, "intrinsics." + entry.name + ".unit: '" + entry.unit + "', not '" +
                                   known.unit + "', which is that of every model");
    }
    const bool is_size =
        name.starts_with("r_") || name == "baseline" || name == "track" || name == "wheel_base";
    if (!is_size || entry.estimate > 0.) continue;
    config::fail(entry.mark, "intrinsics." + entry.name + ".estimate: " +
                                 number_text(entry.estimate) + " m is no size of a robot");
  }
}

void recognise(const CalibrationFile& file, Robot& robot) {
  Intrinsics intrinsics(file);
  int n = 0;
  while (intrinsics.has("r_" + std::to_string(n + 1))) ++n;
  const auto has_each = [&](const char* stem) { return intrinsics.has_each(stem, n); };
  const bool is_swerve = has_each("x_") && has_each("y_") && has_each("delta_o");
  const bool is_mecanum = has_each("gamma_") && has_each("k_");
  if (is_swerve || is_mecanum) {
    add_numbered_wheels(intrinsics, n, robot);
  } else if (intrinsics.has_all({"r_left", "r_right", "baseline"}) ||
             intrinsics.has_all({"r_left", "r_right", "y_icr_left", "y_icr_right", "x_icr"})) {
    add_sides(intrinsics, robot);
  } else if (intrinsics.has_all({"r_rear_left", "r_rear_right", "wheel_base", "track"})) {
    add_axles(intrinsics, robot);
  }
  robot.beside = intrinsics.unused();
  take_signs(file, robot);
}

/// The values of entries; InputError if one is missing.
Eigen::VectorXd values_of(const CalibrationFile& file, const CalibrationFile::Entries& entries,
                          const std::vector<std::string>& names) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(names.size()));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const CalibrationEntry* const entry = find(entries, names[i]);
    if (entry == nullptr) {
      throw InputError(file.path.string() + ": '" + names[i] + "' is missing");
    }
    values[static_cast<Eigen::Index>(i)] = entry->estimate;
  }
  return values;
}

CameraView camera_of(const CalibrationFile& file, std::size_t index) {
  const CalibratedCamera& model = file.camera_models[index];
  const std::string cam = "cam" + std::to_string(index) + ".";
  std::vector<std::string> names;
  for (const char* name : {"theta_ItoC_x", "theta_ItoC_y", "theta_ItoC_z", "p_IinC_x", "p_IinC_y",
                           "p_IinC_z", "fx", "fy", "cx", "cy", "d1", "d2", "d3", "d4", "t_CtoI"}) {
    names.push_back(cam + name);
  }
  const Eigen::VectorXd values = values_of(file, file.cameras, names);
  CameraView camera;
  camera.distortion = model.distortion;
  camera.width_px = model.width_px;
  camera.height_px = model.height_px;
  camera.R_ItoC = exp_so3(Eigen::Vector3d(values.head<3>()));
  camera.p_IinC = values.segment<3>(3);
  camera.intrinsics = values.segment<8>(6);
  camera.t_CtoI_s = values[14];
  camera.line_delay_s = model.line_delay_s;
  return camera;
}

}  // namespace

std::string Robot::reversed_wheels() const {
  std::string names;
  for (const Wheel& wheel : wheels) {
    if (wheel.reversed) names += (names.empty() ? "" : ", ") + wheel.name;
  }
  return names;
}

double Robot::mean_radius_m() const {
  double sum = 0.;
  for (const Wheel& wheel : wheels) sum += wheel.radius_m;
  return sum / static_cast<double>(wheels.size());
}

std::string names_of(const CalibrationFile::Entries& entries) {
  std::string text;
  for (const CalibrationEntry& entry : entries) text += (text.empty() ? "" : ", ") + entry.name;
  return text;
}

Robot robot_of(const CalibrationFile& file) {
  Robot robot;
  robot.file = &file;
  recognise(file, robot);
  if (robot.base != Base::kUnknown) check_sizes(file);
  if (find(file.mount, "p_IinO_x") != nullptr) {
    const Eigen::VectorXd values = values_of(
        file, file.mount,
        {"theta_ItoO_x", "theta_ItoO_y", "theta_ItoO_z", "p_IinO_x", "p_IinO_y", "p_IinO_z"});
    robot.mount = {exp_so3(Eigen::Vector3d(values.head<3>())), values.tail<3>()};
  }
  for (std::size_t i = 0; i < file.camera_models.size(); ++i) {
    robot.cameras.push_back(camera_of(file, i));
  }
  return robot;
}

}  // namespace viwo::exports
