#include "viwo/export/export_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "formats.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/number_text.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::exports {
namespace {

struct Format {
  const char* name;
  const char* holds_what;
  std::vector<Base> bases;  ///< that it can hold; none: it asks for `has` alone
  bool (*has)(const Robot&);
  Exported (*write)(const Robot&);
};

bool always(const Robot& /*robot*/) { return true; }
bool has_corners(const Robot& robot) {
  return robot.base != Base::kMecanum || corners(robot).size() == 4;
}
bool has_cameras(const Robot& robot) { return !robot.cameras.empty(); }

const std::vector<Format>& all_formats() {
  static const std::vector<Format> all{
      {"urdf",
       "wheels whose places are known: swerve, differential, skid steering, Ackermann",
       {Base::kSteered, Base::kDifferential, Base::kSkidSteer, Base::kAckermann},
       always,
       to_urdf},
      {"ros2_control",
       "differential, skid steering, Ackermann, four mecanum wheels (there is no standard "
       "controller of swerve bases)",
       {Base::kDifferential, Base::kSkidSteer, Base::kAckermann, Base::kMecanum},
       has_corners,
       to_ros2_control},
      {"wpilib",
       "swerve, differential, skid steering, four mecanum wheels",
       {Base::kSteered, Base::kDifferential, Base::kSkidSteer, Base::kMecanum},
       has_corners,
       to_wpilib},
      {"kalibr", "cameras", {}, has_cameras, to_kalibr},
      {"csv", "every calibration", {}, always, to_csv}};
  return all;
}

bool can_hold(const Format& format, const Robot& robot) {
  const auto& bases = format.bases;
  const bool is_known =
      bases.empty() || std::find(bases.begin(), bases.end(), robot.base) != bases.end();
  return is_known && format.has(robot);
}

[[noreturn]] void refuse(const Format& format, const Robot& robot) {
  std::string can;
  for (const Format& other : all_formats()) {
    if (can_hold(other, robot)) can += (can.empty() ? "" : ", ") + std::string(other.name);
  }
  const CalibrationFile& file = *robot.file;
  const std::string model = file.model.empty() ? "no wheels" : "a base '" + file.model + "'";
  const std::string names = names_of(file.intrinsics);
  throw InputError(file.path.string() + " has " + model +
                   (names.empty() ? "" : " (" + names + ")") +
                   (robot.cameras.empty() ? " and no cameras" : "") + "; " + format.name +
                   " holds " + format.holds_what + " - formats that hold this one: " + can);
}

}  // namespace

void Lost::sigmas() { add("standard deviations and correlations"); }

void Lost::mount() {
  if (robot_.mount) add("the mount of the IMU: " + names_of(robot_.file->mount));
}

void Lost::clocks() {
  CalibrationFile::Entries clocks = robot_.file->clock;
  for (const CalibrationEntry& entry : robot_.file->cameras) {
    if (entry.name.ends_with(".t_CtoI")) clocks.push_back(entry);
  }
  if (!clocks.empty()) add("clocks: " + names_of(clocks));
}

void Lost::cameras() {
  if (!robot_.cameras.empty()) add("cameras (format kalibr)");
}

void Lost::beside() {
  std::string text;
  for (const std::string& name : robot_.beside) text += (text.empty() ? "" : ", ") + name;
  if (!text.empty()) add("what has no place in it: " + text);
  const CalibrationFile::Entries& reference = robot_.file->reference;
  if (!reference.empty()) add("the pose and the clock of the reference: " + names_of(reference));
  for (const auto& [name, model] : robot_.file->wheel_sets) {
    add("wheel set '" + name + "' (" + model + ")");
  }
}

void Lost::all_but_geometry() {
  sigmas();
  mount();
  clocks();
  cameras();
  beside();
}

void Lost::radii_but_the_mean(const std::vector<Wheel>& wheels) {
  double least = wheels.front().radius_m, most = least;
  for (const Wheel& wheel : wheels) {
    least = std::min(least, wheel.radius_m);
    most = std::max(most, wheel.radius_m);
  }
  if (most > least) {
    add("one radius for all wheels, their mean; they are from " + significant(least, 6) + " to " +
        significant(most, 6) + " m");
  }
}

config::Node real_number(double value) {
  std::string text = number_text(value);
  if (text.find('.') == std::string::npos) {
    text.insert(std::min(text.find('e'), text.size()), ".0");
  }
  return config::Node::scalar_of(text);
}

std::string head(const Robot& robot, const std::vector<std::string>& lost,
                 const std::string& mark) {
  std::string text;
  // Texts of the file end no comment: in Java a backslash can be the end of a line.
  const auto add = [&](const std::string& line) {
    std::string clean = log::printable(line);
    std::replace(clean.begin(), clean.end(), '\\', '/');
    text += mark + clean + "\n";
  };
  add("Written by viwo export from " + robot.file->path.filename().string() +
      (robot.file->model.empty() ? "" : " (" + robot.file->model + ")") + ".");
  std::istringstream doubts(doubts_of(*robot.file));
  for (std::string line; std::getline(doubts, line);) add(line);
  for (const std::string& line : lost) add("Not in here: " + line);
  return text;
}

std::string drive_joint(const Wheel& wheel) { return "drive_" + wheel.name + "_joint"; }
std::string steer_joint(const Wheel& wheel) { return "steer_" + wheel.name + "_joint"; }

std::vector<Wheel> corners(const Robot& robot) {
  // In the row [1, tan_gamma, k]: the signs of front left, front right, rear left, rear right.
  constexpr double kSigns[4][2] = {{-1., -1.}, {1., 1.}, {1., -1.}, {-1., 1.}};
  std::vector<Wheel> ordered;
  for (const auto& [tan_gamma, k] : kSigns) {
    std::vector<Wheel> here;
    for (const Wheel& wheel : robot.wheels) {
      if (wheel.tan_gamma * tan_gamma > 0. && wheel.k_m * k > 0.) here.push_back(wheel);
    }
    if (here.size() != 1 || robot.wheels.size() != 4) return {};
    ordered.push_back(here.front());
  }
  return ordered;
}

std::vector<std::string> formats() {
  std::vector<std::string> names;
  for (const Format& format : all_formats()) names.emplace_back(format.name);
  return names;
}

Exported export_calibration(const CalibrationFile& calibration, const std::string& format) {
  const Robot robot = robot_of(calibration);
  for (const Format& known : all_formats()) {
    if (known.name != format) continue;
    if (!can_hold(known, robot)) refuse(known, robot);
    return known.write(robot);
  }
  throw InputError("no format '" + format + "'" + config::did_you_mean(format, formats()));
}

}  // namespace viwo::exports
