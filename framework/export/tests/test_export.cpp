// Every format gives back the numbers that went in, read by the format's own library where there is
// one, and says what it cannot hold.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration_files.hpp"
#include "message_of.hpp"
#include "simulated.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/export/export_calibration.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/number_text.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::exports {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using viwo::testing::error_of;

config::Node yaml_of(const Exported& exported) { return config::parse(exported.text, "exported"); }

double number_at(const config::Node& root, const std::string& path) {
  const config::Node* const node = root.at_path(path);
  EXPECT_NE(node, nullptr) << path;
  return node != nullptr ? *log::parse_number(node->scalar()) : std::nan("");
}

/// All numbers of a text, in order.
std::vector<double> numbers_in(const std::string& text) {
  std::vector<double> out;
  const std::regex number("-?[0-9]+(\\.[0-9]+)?(e-?[0-9]+)?");
  for (std::sregex_iterator i(text.begin(), text.end(), number), end; i != end; ++i) {
    out.push_back(*log::parse_number(i->str()));
  }
  return out;
}

/// What stands between `from` and the next `to`.
std::string between_texts(const std::string& text, const std::string& from, const std::string& to) {
  const std::size_t begin = text.find(from);
  EXPECT_NE(begin, std::string::npos) << from << " in\n" << text;
  if (begin == std::string::npos) return "";
  const std::size_t after = begin + from.size();
  return text.substr(after, text.find(to, after) - after);
}

TEST(Export, SaysInTheFileWhatItDoesNotHold) {
  for (const std::string& format : formats()) {
    const Exported exported = export_calibration(with_rig(differential()), format);
    EXPECT_FALSE(exported.lost.empty()) << format;
    for (const std::string& line : exported.lost) EXPECT_THAT(exported.text, HasSubstr(line));
    EXPECT_THAT(exported.text, HasSubstr("from calibration.yaml (differential)"));
  }
  CalibrationFile doubtful = with_rig(differential());
  doubtful.status = CalibrationFile::Status::kDoubtful;
  doubtful.reasons = {"too few turns -- drive more"};
  for (const std::string& format : formats()) {
    EXPECT_THAT(export_calibration(doubtful, format).text, HasSubstr("too few turns -"));
  }
}

TEST(Export, WritesNoTextOfTheFileThatEndsAComment) {
  CalibrationFile file = with_rig(differential());
  file.status = CalibrationFile::Status::kDoubtful;
  file.path = "robot/a\rint b;.yaml";
  file.reasons = {"\\u000a int evil;", "cr\rint evil;",
                  "nel\xc2\x85"
                  "evil: 1",
                  "ls\xe2\x80\xa8"
                  "evil: 1",
                  "--><robot/>"};
  for (const std::string& format : formats()) {
    const std::string text = export_calibration(file, format).text;
    EXPECT_EQ(text.find_first_of("\r\\"), std::string::npos) << format;
    EXPECT_THAT(text, Not(AnyOf(HasSubstr("\xc2\x85"), HasSubstr("\xe2\x80\xa8")))) << format;
    EXPECT_THAT(text, HasSubstr("evil"));
  }
  EXPECT_THAT(export_calibration(file, "urdf").text, Not(HasSubstr("--><robot/>")));
}

TEST(Export, KnowsSidesOfSeveralDrives) {
  CalibrationFile file = differential();
  file.drive_signs = {-1, -1, -1, -1};
  EXPECT_THAT(export_calibration(file, "urdf").text, HasSubstr("<axis xyz=\"0 -1 0\"/>"));
  // Which of them are on which side is not in the file.
  file.drive_signs = {1, -1, 1, -1};
  const Exported urdf = export_calibration(file, "urdf");
  EXPECT_THAT(urdf.text, Not(HasSubstr("<axis xyz=\"0 -1 0\"/>")));
  EXPECT_THAT(urdf.text, HasSubstr("drive_signs of 4 drives (which of them are on which side"));
  EXPECT_THAT(export_calibration(file, "csv").text, HasSubstr("drive_sign_4,-1,0,"));
}

TEST(Export, RefusesWhatIsNoRobot) {
  for (const double size : {0., -0.1}) {
    CalibrationFile file = differential();
    file.intrinsics[1].estimate = size;
    EXPECT_THAT(error_of([&] { export_calibration(file, "urdf"); }),
                HasSubstr("intrinsics.r_right.estimate: " + number_text(size) +
                          " m is no size of a robot"));
  }
  CalibrationFile file = differential();
  file.intrinsics[1].unit = "mm";
  EXPECT_THAT(error_of([&] { export_calibration(file, "urdf"); }),
              HasSubstr("intrinsics.r_right.unit: 'mm', not 'm'"));
  file = differential();
  file.drive_signs = {-1};
  EXPECT_EQ(error_of([&] { export_calibration(file, "csv"); }),
            "robot/calibration.yaml: 'drive_signs' has 1 signs for 2 wheels");
  // Of an Ackermann base the rear wheels alone may have encoders.
  file = ackermann();
  file.drive_signs = {1, -1};
  const std::string urdf = export_calibration(file, "urdf").text;
  const auto joint = between_texts(urdf, "\"drive_rear_right_joint\"", "</joint>");
  EXPECT_THAT(joint, HasSubstr("<axis xyz=\"0 -1 0\"/>"));
}

TEST(Export, NamesTheFormatsThatHoldABaseWhereOneCannot) {
  const CalibrationFile unknown = file_of("body_twist", {{"s_v", 1.01}, {"s_omega", 0.99}});
  EXPECT_EQ(error_of([&] { export_calibration(unknown, "urdf"); }),
            "robot/calibration.yaml has a base 'body_twist' (s_v, s_omega) and no cameras; urdf "
            "holds wheels whose places are known: swerve, differential, skid steering, Ackermann - "
            "formats that hold this one: csv");
  EXPECT_THAT(error_of([&] { export_calibration(swerve(), "ros2_control"); }),
              AllOf(HasSubstr("no standard controller of swerve bases"),
                    HasSubstr("formats that hold this one: urdf, wpilib, csv")));
  EXPECT_THAT(error_of([&] { export_calibration(ackermann(), "wpilib"); }),
              HasSubstr("formats that hold this one: urdf, ros2_control, csv"));
  EXPECT_THAT(error_of([&] { export_calibration(mecanum(), "urdf"); }),
              HasSubstr("formats that hold this one: ros2_control, wpilib, csv"));
  EXPECT_THAT(error_of([&] { export_calibration(swerve(), "kalibr"); }), HasSubstr("no cameras"));
  EXPECT_EQ(error_of([&] { export_calibration(swerve(), "urfd"); }),
            "no format 'urfd' - did you mean 'urdf'?");
  // Two wheels in one corner are no mecanum base that a controller knows.
  CalibrationFile crossed = mecanum();
  crossed.intrinsics[8].estimate *= -1.;
  EXPECT_THAT(error_of([&] { export_calibration(crossed, "ros2_control"); }),
              HasSubstr("formats that hold this one: csv"));
}

TEST(Export, AsRos2ControlIsWhatTheControllersComputeWith) {
  auto root = yaml_of(export_calibration(differential(), "ros2_control"));
  std::string path = "diff_drive_controller.ros__parameters.";
  const double radius = number_at(root, path + "wheel_radius");
  EXPECT_NEAR(radius * number_at(root, path + "left_wheel_radius_multiplier"), 0.101, kRounding);
  EXPECT_NEAR(radius * number_at(root, path + "right_wheel_radius_multiplier"), 0.099, kRounding);
  EXPECT_NEAR(number_at(root, path + "wheel_separation"), 0.55, kRounding);
  // Integers are refused where a controller declares doubles.
  EXPECT_EQ(root.at_path(path + "wheel_separation_multiplier")->scalar(), "1.0");
  const Exported skids = export_calibration(skid_steer(), "ros2_control");
  EXPECT_NEAR(number_at(yaml_of(skids), path + "wheel_separation"), 0.8, kRounding);
  EXPECT_THAT(skids.lost, Contains(HasSubstr("x_icr")));

  root = yaml_of(export_calibration(ackermann(), "ros2_control"));
  path = "ackermann_steering_controller.ros__parameters.";
  EXPECT_NEAR(number_at(root, path + "wheelbase"), 2.7, kRounding);
  EXPECT_NEAR(number_at(root, path + "traction_track_width"), 1.5, kRounding);
  EXPECT_NEAR(number_at(root, path + "traction_wheels_radius"), 0.305, kRounding);
  EXPECT_EQ(root.at_path(path + "traction_joints_names.0")->scalar(), "drive_rear_right_joint");

  root = yaml_of(export_calibration(mecanum(), "ros2_control"));
  path = "mecanum_drive_controller.ros__parameters.";
  EXPECT_NEAR(number_at(root, path + "kinematics.wheels_radius"), 0.0525, kRounding);
  EXPECT_NEAR(number_at(root, path + "kinematics.sum_of_robot_center_projection_on_X_Y_axis"),
              0.525, kRounding);
  // Of the rows [1, tan gamma, k] of docs: 1 front left, 2 rear left, 3 rear right, 4 front right.
  const std::map<std::string, std::string> joints{
      {"front_left", "1"}, {"rear_left", "2"}, {"rear_right", "3"}, {"front_right", "4"}};
  for (const auto& [corner, wheel] : joints) {
    EXPECT_EQ(root.at_path(path + corner + "_wheel_command_joint_name")->scalar(),
              "drive_" + wheel + "_joint");
  }
}

TEST(Export, AsJavaForWpilibHasPlacesRadiiAndOffsetsInTurns) {
  const std::string text = export_calibration(swerve(), "wpilib").text;
  const auto places = numbers_in(std::regex_replace(
      between_texts(text, "kModuleLocations = {", "};"), std::regex("Translation2d"), ""));
  EXPECT_EQ(places, (std::vector<double>{0.21, 0.31, -0.22, 0.32, -0.23, -0.33, 0.24, -0.34}));
  EXPECT_EQ(numbers_in(between_texts(text, "kWheelRadiiMeters = {", "}")),
            (std::vector<double>{0.0501, 0.0502, 0.0503, 0.0504}));
  const auto offsets = numbers_in(between_texts(text, "kEncoderOffsetsRotations = {", "}"));
  const double zeros[] = {0.1, -2.5, 3.5 - 2. * M_PI, -0.4};
  ASSERT_EQ(offsets.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(2. * M_PI * offsets[i], zeros[i], kRounding);
  EXPECT_EQ(std::count(text.begin(), text.end(), '{'), std::count(text.begin(), text.end(), '}'));

  const std::string sides = export_calibration(differential(), "wpilib").text;
  EXPECT_EQ(numbers_in(between_texts(sides, "kTrackWidthMeters = ", ";")),
            (std::vector<double>{0.55}));
  const std::string rollers = export_calibration(mecanum(), "wpilib").text;
  const auto corners = numbers_in(std::regex_replace(
      between_texts(rollers, "MecanumDriveKinematics(", ");\n"), std::regex("Translation2d"), ""));
  // Front left, front right, rear left, rear right: x + y is the lever arm.
  const double levers[] = {0.51, 0.54, 0.52, 0.53};
  ASSERT_EQ(corners.size(), 8u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(std::abs(corners[2 * i]) + std::abs(corners[2 * i + 1]), levers[i], kRounding);
    EXPECT_EQ(corners[2 * i] > 0., i < 2);
    EXPECT_EQ(corners[2 * i + 1] > 0., i % 2 == 0);
  }
}

TEST(Export, SaysWhichDrivesTurnBackwards) {
  CalibrationFile file = differential();
  file.drive_signs = {1, -1};
  const std::string urdf = export_calibration(file, "urdf").text;
  const auto axis_of = [&urdf](const std::string& joint) {
    const auto begin = urdf.find("\"" + joint + "\"");
    const auto axis = urdf.find("<axis xyz=\"", begin) + 11;
    return urdf.substr(axis, urdf.find('"', axis) - axis);
  };
  EXPECT_EQ(axis_of("drive_left_joint"), "0 1 0");
  EXPECT_EQ(axis_of("drive_right_joint"), "0 -1 0");
  EXPECT_THAT(export_calibration(file, "wpilib").text,
              HasSubstr("boolean[] kDriveInverted = {false, true};"));
  EXPECT_THAT(export_calibration(file, "csv").text,
              AllOf(HasSubstr("\ndrive_sign_1,1,0,\n"), HasSubstr("\ndrive_sign_2,-1,0,\n")));
  EXPECT_THAT(export_calibration(file, "ros2_control").lost,
              Contains(HasSubstr("the drives of right turn backwards")));
  file.drive_signs = {1, 1};
  EXPECT_THAT(export_calibration(file, "wpilib").text, Not(HasSubstr("kDriveInverted")));
}

TEST(Export, AsKalibrChainIsReadBackAsTheSameCameras) {
  const CalibrationFile file = with_rig(differential());
  const auto path = std::filesystem::path(::testing::TempDir()) / "viwo_export_camchain.yaml";
  std::ofstream(path) << export_calibration(file, "kalibr").text;
  const auto cameras = log::read_kalibr_cameras(path);
  std::filesystem::remove(path);
  ASSERT_EQ(cameras.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const CameraView& camera = cameras[i];
    const double one = i == 0 ? 1. : 1.01;
    const Eigen::Matrix3d R_ItoC = exp_so3(one * Eigen::Vector3d(1.2, -1.21, 1.22));
    EXPECT_LT((camera.R_ItoC - R_ItoC).norm(), kRounding);
    EXPECT_LT((camera.p_IinC - one * Eigen::Vector3d(0.05, 0.06, -0.07)).norm(), kRounding);
    EXPECT_NEAR(camera.intrinsics[0], one * 285.1, kRounding);
    EXPECT_NEAR(camera.intrinsics[7], one * 0.002, kRounding);
    EXPECT_NEAR(camera.t_CtoI_s, one * -0.0011, kRounding);
    EXPECT_EQ(camera.distortion, file.camera_models[i].distortion);
    EXPECT_EQ(camera.width_px, file.camera_models[i].width_px);
    EXPECT_EQ(camera.height_px, file.camera_models[i].height_px);
    EXPECT_DOUBLE_EQ(camera.line_delay_s, file.camera_models[i].line_delay_s);
  }
}

TEST(Export, WritesNumbersAsYamlKnowsThem) {
  CalibrationFile file = with_rig(differential());
  for (CalibrationEntry& entry : file.cameras) {
    if (entry.name == "cam0.t_CtoI") entry.estimate = 1e-5;
  }
  const std::string text = export_calibration(file, "kalibr").text;
  EXPECT_THAT(text, HasSubstr("timeshift_cam_imu: 1.0e-05\n"));
  EXPECT_THAT(text, HasSubstr("[0.0, 0.0, 0.0, 1.0]"));
  EXPECT_THAT(text, HasSubstr("resolution: [848, 800]"));
  // Each camera but the first has its place in the one before it.
  EXPECT_EQ(text.find("T_cn_cnm1"), text.rfind("T_cn_cnm1"));
  EXPECT_GT(text.find("T_cn_cnm1"), text.find("cam1"));
}

TEST(Export, AsTableHasEveryNumberWithSigmaAndUnit) {
  const CalibrationFile file = with_rig(swerve());
  std::istringstream in(export_calibration(file, "csv").text);
  std::vector<std::string> rows;
  for (std::string line; std::getline(in, line);) {
    if (line[0] != '#') rows.push_back(line);
  }
  ASSERT_EQ(rows.size(), 1u + 16u + 6u + 1u + 30u);
  EXPECT_EQ(rows[0], "name,value,sigma,unit");
  EXPECT_EQ(rows[1], "r_1,0.0501,1e-04,m");
  EXPECT_THAT(rows, Contains("t_OtoI,0.004,0.001,s"));
  EXPECT_THAT(rows, Contains("cam0.fx,285.1,0.001,"));
}

}  // namespace
}  // namespace viwo::exports
