// Every format gives back the numbers that went in, read by the format's own library where there is
// one, and says what it cannot hold.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulated.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/export/export_calibration.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/so3.hpp"

#ifdef VIWO_HAS_URDFDOM
#include <urdf_parser/urdf_parser.h>
#endif

namespace viwo::exports {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using viwo::testing::error_of;

constexpr double kRounding = 1e-12;

CalibrationFile file_of(const std::string& model,
                        const std::vector<std::pair<const char*, double>>& intrinsics) {
  CalibrationFile file;
  file.path = "robot/calibration.yaml";
  file.model = model;
  file.twist = "plain";
  for (const auto& [name, value] : intrinsics) {
    const std::string text = name;
    const bool is_angle = text.starts_with("delta") || text.starts_with("gamma");
    file.intrinsics.push_back({text, value, 1e-4, value, is_angle ? "rad" : "m"});
  }
  return file;
}

CalibrationFile swerve() {
  return file_of("four_wis_wid", {{"r_1", 0.0501},
                                  {"r_2", 0.0502},
                                  {"r_3", 0.0503},
                                  {"r_4", 0.0504},
                                  {"x_1", 0.21},
                                  {"x_2", -0.22},
                                  {"x_3", -0.23},
                                  {"x_4", 0.24},
                                  {"y_1", 0.31},
                                  {"y_2", 0.32},
                                  {"y_3", -0.33},
                                  {"y_4", -0.34},
                                  {"delta_o1", 0.1},
                                  {"delta_o2", -2.5},
                                  {"delta_o3", 3.5},
                                  {"delta_o4", -0.4}});
}

CalibrationFile differential() {
  return file_of("differential", {{"r_left", 0.101}, {"r_right", 0.099}, {"baseline", 0.55}});
}

CalibrationFile skid_steer() {
  return file_of("skid_steer", {{"r_left", 0.101},
                                {"r_right", 0.099},
                                {"y_icr_left", 0.41},
                                {"y_icr_right", -0.39},
                                {"x_icr", -0.02}});
}

CalibrationFile ackermann() {
  return file_of("ackermann", {{"r_rear_left", 0.31},
                               {"r_rear_right", 0.30},
                               {"r_front_left", 0.32},
                               {"r_front_right", 0.33},
                               {"wheel_base", 2.7},
                               {"track", 1.5},
                               {"delta_o_left", 0.01},
                               {"delta_o_right", -0.02}});
}

CalibrationFile mecanum() {
  return file_of("mecanum", {{"r_1", 0.051},
                             {"r_2", 0.052},
                             {"r_3", 0.053},
                             {"r_4", 0.054},
                             {"gamma_1", -0.78},
                             {"gamma_2", 0.79},
                             {"gamma_3", -0.80},
                             {"gamma_4", 0.77},
                             {"k_1", -0.51},
                             {"k_2", -0.52},
                             {"k_3", 0.53},
                             {"k_4", 0.54}});
}

/// With a mount that is turned about all axes, clocks and two cameras of different kinds.
CalibrationFile with_rig(CalibrationFile file) {
  const char* mount[] = {"theta_ItoO_x", "theta_ItoO_y", "theta_ItoO_z",
                         "p_IinO_x",     "p_IinO_y",     "p_IinO_z"};
  for (int i = 0; i < 6; ++i) {
    file.mount.push_back({mount[i], 0.1 * (i + 1), 0.01, 0., i < 3 ? "rad" : "m"});
  }
  file.clock.push_back({"t_OtoI", 0.004, 1e-3, 0., "s"});
  for (const char* cam : {"cam0.", "cam1."}) {
    const double one = cam[3] == '0' ? 1. : 1.01;
    const std::pair<const char*, double> entries[] = {
        {"theta_ItoC_x", 1.2}, {"theta_ItoC_y", -1.21}, {"theta_ItoC_z", 1.22}, {"p_IinC_x", 0.05},
        {"p_IinC_y", 0.06},    {"p_IinC_z", -0.07},     {"fx", 285.1},          {"fy", 286.2},
        {"cx", 421.3},         {"cy", 399.4},           {"d1", -0.01},          {"d2", 0.04},
        {"d3", -0.003},        {"d4", 0.002},           {"t_CtoI", -0.0011}};
    for (const auto& [name, value] : entries) {
      file.cameras.push_back({std::string(cam) + name, one * value, 1e-3, 0., ""});
    }
  }
  file.camera_models = {{CameraDistortion::kEquidistant, 848, 800},
                        {CameraDistortion::kRadtan, 752, 480}};
  return file;
}

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

#ifdef VIWO_HAS_URDFDOM

Eigen::Matrix3d matrix_of(const urdf::Rotation& r) {
  return Eigen::Quaterniond(r.w, r.x, r.y, r.z).toRotationMatrix();
}

Eigen::Vector3d vector_of(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

/// Pose of a link in base_link where all joints read zero.
Eigen::Isometry3d place_of(const urdf::ModelInterface& robot, const std::string& name) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (auto link = robot.getLink(name); link && link->parent_joint; link = link->getParent()) {
    const urdf::Pose& origin = link->parent_joint->parent_to_joint_origin_transform;
    Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
    step.linear() = matrix_of(origin.rotation);
    step.translation() = vector_of(origin.position);
    T = step * T;
  }
  return T;
}

std::shared_ptr<urdf::ModelInterface> urdf_of(const CalibrationFile& file) {
  const auto robot = urdf::parseURDF(export_calibration(file, "urdf").text);
  EXPECT_NE(robot, nullptr);
  return robot;
}

double radius_of(const urdf::ModelInterface& robot, const std::string& link) {
  const auto shape = robot.getLink(link)->collision->geometry;
  return dynamic_cast<const urdf::Cylinder&>(*shape).radius;
}

TEST(Export, AsUrdfPutsWheelsWhereTheyAreAndTurnsThemAsTheyRead) {
  const CalibrationFile file = swerve();
  const auto robot = urdf_of(file);
  EXPECT_EQ(robot->getName(), "four_wis_wid");
  for (int j = 1; j <= 4; ++j) {
    const std::string n = std::to_string(j);
    const auto value = [&](const std::string& name) {
      return find(file.intrinsics, name + n)->estimate;
    };
    const Eigen::Isometry3d T = place_of(*robot, "wheel_" + n + "_link");
    const Eigen::Vector3d hub(value("x_"), value("y_"), value("r_"));
    EXPECT_LT((T.translation() - hub).norm(), kRounding);
    EXPECT_NEAR(radius_of(*robot, "wheel_" + n + "_link"), value("r_"), kRounding);
    const auto steer = robot->getJoint("steer_" + n + "_joint");
    EXPECT_EQ(steer->type, urdf::Joint::CONTINUOUS);
    EXPECT_EQ(robot->getJoint("drive_" + n + "_joint")->type, urdf::Joint::CONTINUOUS);
    // Turned to what its encoder reads straight ahead, the wheel points along x and rolls forward.
    const Eigen::AngleAxisd turn(value("delta_o"), vector_of(steer->axis));
    const Eigen::Vector3d axle =
        T.linear() * turn * vector_of(robot->getJoint("drive_" + n + "_joint")->axis);
    EXPECT_LT((axle - Eigen::Vector3d::UnitY()).norm(), kRounding) << n;
  }
}

TEST(Export, AsUrdfPutsTheWheelsOfOtherBases) {
  const auto place = [](const CalibrationFile& file, const char* wheel) {
    return Eigen::Vector3d(
        place_of(*urdf_of(file), std::string("wheel_") + wheel + "_link").translation());
  };
  const auto near = [](const Eigen::Vector3d& a, double x, double y, double z) {
    return (a - Eigen::Vector3d(x, y, z)).norm() < kRounding;
  };
  EXPECT_TRUE(near(place(differential(), "left"), 0., 0.275, 0.101));
  EXPECT_TRUE(near(place(differential(), "right"), 0., -0.275, 0.099));
  EXPECT_TRUE(near(place(skid_steer(), "left"), -0.02, 0.41, 0.101));
  EXPECT_TRUE(near(place(skid_steer(), "right"), -0.02, -0.39, 0.099));
  EXPECT_TRUE(near(place(ackermann(), "rear_right"), 0., -0.75, 0.30));
  EXPECT_TRUE(near(place(ackermann(), "front_left"), 2.7, 0.75, 0.32));
}

TEST(Export, AsUrdfPutsImuAndCamerasOnTheBase) {
  const CalibrationFile file = with_rig(differential());
  const auto robot = urdf_of(file);
  const Eigen::Isometry3d imu = place_of(*robot, "imu_link");
  const Eigen::Matrix3d R_ItoO = exp_so3({0.1, 0.2, 0.3});
  EXPECT_LT((imu.linear() - R_ItoO).norm(), kRounding);
  EXPECT_LT((imu.translation() - Eigen::Vector3d(0.4, 0.5, 0.6)).norm(), kRounding);
  const Eigen::Isometry3d camera = imu.inverse() * place_of(*robot, "cam1_optical_frame");
  const Eigen::Matrix3d R_ItoC = exp_so3(1.01 * Eigen::Vector3d(1.2, -1.21, 1.22));
  const Eigen::Vector3d p_IinC = 1.01 * Eigen::Vector3d(0.05, 0.06, -0.07);
  EXPECT_LT((camera.linear() - R_ItoC.transpose()).norm(), 1e-11);
  EXPECT_LT((camera.translation() + R_ItoC.transpose() * p_IinC).norm(), kRounding);
}

TEST(Export, AsUrdfTurnsAnImuThatPointsUp) {
  for (const double pitch : {M_PI_2, -M_PI_2}) {
    CalibrationFile file = with_rig(differential());
    const Eigen::Matrix3d R = (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()))
                                  .toRotationMatrix();
    for (int i = 0; i < 3; ++i) file.mount[static_cast<std::size_t>(i)].estimate = log_so3(R)[i];
    EXPECT_LT((place_of(*urdf_of(file), "imu_link").linear() - R).norm(), 1e-9) << pitch;
  }
}

#else

TEST(Export, AsUrdfIsReadBackByUrdfdom) { GTEST_SKIP() << "built without urdfdom"; }

#endif

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
  }
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
