// URDF gives back where everything is on a base, read by urdfdom.
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "calibration_files.hpp"
#include "viwo/export/export_calibration.hpp"
#include "viwo/math/so3.hpp"

#ifdef VIWO_HAS_URDFDOM
#include <urdf_parser/urdf_parser.h>
#endif

namespace viwo::exports {
namespace {

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

}  // namespace
}  // namespace viwo::exports
