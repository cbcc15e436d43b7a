// Java constants for WPILib, whose frames are those of viwo: x forward, y left.
#include <cmath>

#include "formats.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::exports {
namespace {

std::string numbers(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + number_text(value);
  return text;
}

std::string constant(const std::string& type, const std::string& name, const std::string& value) {
  return "  public static final " + type + " " + name + " = " + value + ";\n";
}

std::string place(double x_m, double y_m) {
  return "new Translation2d(" + number_text(x_m) + ", " + number_text(y_m) + ")";
}

std::string radii(const std::vector<Wheel>& wheels) {
  std::vector<double> all;
  for (const Wheel& wheel : wheels) all.push_back(wheel.radius_m);
  return constant("double[]", "kWheelRadiiMeters", "{" + numbers(all) + "}");
}

/// Nothing where no drive is: what is not said to be so is not.
std::string inverted(const Robot& robot, const std::vector<Wheel>& wheels) {
  if (robot.reversed_wheels().empty()) return "";
  std::string all;
  for (const Wheel& wheel : wheels) {
    all += (all.empty() ? "" : ", ") + std::string(wheel.reversed ? "true" : "false");
  }
  return "  /** Against the readings of the recording: drives that turn backwards. */\n" +
         constant("boolean[]", "kDriveInverted", "{" + all + "}");
}

std::string kinematics(const std::string& type, const std::string& arguments) {
  return constant(type, "kKinematics", "new " + type + "(" + arguments + ")");
}

std::string swerve(const Robot& robot) {
  std::string places;
  std::vector<double> zeros;
  for (const Wheel& wheel : robot.wheels) {
    places += (places.empty() ? "\n      " : ",\n      ") + place(wheel.x_m, wheel.y_m);
    // A turn more or less is the same zero.
    zeros.push_back(std::remainder(wheel.zero_rad, 2. * M_PI) / (2. * M_PI));
  }
  return "  // In the order of the modules in viwo's configuration.\n" + radii(robot.wheels) +
         inverted(robot, robot.wheels) +
         "  /** What the steering encoders read where the wheels point forward, from -0.5 to 0.5, "
         "as turned by\n   * steer_scale and steer_shift_rad of the configuration. To be taken off "
         "the reading: for a CANcoder,\n   * off the MagnetOffset that was set while recording. */"
         "\n" +
         constant("double[]", "kEncoderOffsetsRotations", "{" + numbers(zeros) + "}") +
         constant("Translation2d[]", "kModuleLocations", "{" + places + "}") +
         kinematics("SwerveDriveKinematics", "kModuleLocations");
}

std::string mecanum(const Robot& robot) {
  const std::vector<Wheel> wheels = corners(robot);
  constexpr double kSigns[4][2] = {{1., 1.}, {1., -1.}, {-1., 1.}, {-1., -1.}};
  std::string places;
  for (std::size_t i = 0; i < 4; ++i) {
    const double half = 0.5 * std::abs(wheels[i].k_m);
    places += (i == 0 ? "\n      " : ",\n      ") + place(kSigns[i][0] * half, kSigns[i][1] * half);
  }
  return "  // Front left, front right, rear left, rear right.\n" + radii(wheels) +
         inverted(robot, wheels) + kinematics("MecanumDriveKinematics", places);
}

std::string differential(const Robot& robot) {
  return "  // Left, right.\n" + radii(robot.wheels) + inverted(robot, robot.wheels) +
         constant("double", "kTrackWidthMeters", number_text(robot.track_m)) +
         kinematics("DifferentialDriveKinematics", "kTrackWidthMeters");
}

std::string import_of(const std::string& package) {
  return "import edu.wpi.first.math." + package + ";\n";
}

}  // namespace

Exported to_wpilib(const Robot& robot) {
  Lost lost(robot);
  lost.all_but_geometry();
  std::string imports = import_of("geometry.Translation2d"), body;
  if (robot.base == Base::kSteered) {
    imports += import_of("kinematics.SwerveDriveKinematics");
    body = swerve(robot);
  } else if (robot.base == Base::kMecanum) {
    imports += import_of("kinematics.MecanumDriveKinematics");
    body = mecanum(robot);
    lost.add("angles of the rollers: WPILib takes 45 deg");
    lost.add(
        "where the wheels are: their lever arms k tell the sum of x and y alone, half of "
        "which is written for each");
  } else {
    imports = import_of("kinematics.DifferentialDriveKinematics");
    body = differential(robot);
    if (robot.base == Base::kSkidSteer) {
      lost.add(
          "x_icr, and the middle of y_icr_left and y_icr_right; the track is the distance "
          "of the two");
    }
  }
  lost.add(
      "radii in the kinematics, which are for speeds of wheels in m/s: take kWheelRadiiMeters "
      "where rotations become metres");
  return {head(robot, lost.texts(), "// ") + "\n" + imports +
              "\npublic final class ViwoConstants {\n" +
              constant("double", "kWheelRadiusMeters", number_text(robot.mean_radius_m())) + body +
              "\n  private ViwoConstants() {}\n}\n",
          lost.texts()};
}

}  // namespace viwo::exports
