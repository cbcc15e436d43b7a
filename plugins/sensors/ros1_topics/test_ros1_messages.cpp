// What is published, as messages of ROS 1.
#include <gtest/gtest.h>

#include "ros1_messages.hpp"

namespace viwo::ros1 {
namespace {

live::Odometry odometry() {
  live::Odometry odometry;
  odometry.pose = {1'700'000'000'123'456'789, {1., 2., 3.}, {0.1, 0.2, 0.3, 0.9}};
  odometry.world = "odom";
  odometry.body = "base_link";
  odometry.v_BinB_m_per_s = {4., 5., 6.};
  odometry.w_BinB_rad_per_s = {7., 8., 9.};
  for (std::size_t i = 0; i < 36; ++i) {
    odometry.pose_covariance[i] = static_cast<double>(i);
    odometry.twist_covariance[i] = 100. + static_cast<double>(i);
  }
  return odometry;
}

TEST(Ros1Messages, OdometryHasEachNumberAtItsPlace) {
  const msg::Odometry message = odometry_message(odometry());
  EXPECT_EQ(message.header.stamp.sec, 1'700'000'000U);
  EXPECT_EQ(message.header.stamp.nsec, 123'456'789U);
  EXPECT_EQ(message.header.frame_id, "odom");
  EXPECT_EQ(message.child_frame_id, "base_link");
  EXPECT_EQ(message.pose.pose.position.z, 3.);
  EXPECT_EQ(message.pose.pose.orientation.x, 0.1);
  EXPECT_EQ(message.pose.pose.orientation.w, 0.9);
  EXPECT_EQ(message.twist.twist.linear.y, 5.);
  EXPECT_EQ(message.twist.twist.angular.x, 7.);
  EXPECT_EQ(message.pose.covariance[7], 7.);
  EXPECT_EQ(message.twist.covariance[35], 135.);
}

TEST(Ros1Messages, TfHasTheSamePose) {
  const msg::TFMessage message = tf_message(odometry());
  ASSERT_EQ(message.transforms.size(), 1U);
  const auto& transform = message.transforms[0];
  EXPECT_EQ(transform.header.stamp.nsec, 123'456'789U);
  EXPECT_EQ(transform.header.frame_id, "odom");
  EXPECT_EQ(transform.child_frame_id, "base_link");
  EXPECT_EQ(transform.transform.translation.x, 1.);
  EXPECT_EQ(transform.transform.translation.y, 2.);
  EXPECT_EQ(transform.transform.translation.z, 3.);
  EXPECT_EQ(transform.transform.rotation.x, 0.1);
  EXPECT_EQ(transform.transform.rotation.w, 0.9);
}

TEST(Ros1Messages, APathHasItsPosesInTheWorld) {
  live::Path path;
  live::Pose pose = odometry().pose;
  path.add(pose, 0);
  pose.t_ns += 1'000'000'000;
  pose.p_BinG_m[0] = -1.;
  path.add(pose, 0);
  const msg::Path message = path_message(path, "map");
  EXPECT_EQ(message.header.frame_id, "map");
  EXPECT_EQ(message.header.stamp.sec, 1'700'000'001U);
  ASSERT_EQ(message.poses.size(), 2U);
  EXPECT_EQ(message.poses[0].header.stamp.sec, 1'700'000'000U);
  EXPECT_EQ(message.poses[1].pose.position.x, -1.);
  EXPECT_EQ(message.poses[1].header.frame_id, "map");
}

TEST(Ros1Messages, DiagnosticsAreOneStatus) {
  live::Diagnostics diagnostics{1'000'000'007, true, false, "latency 0.3 s", {{"r_1", "0.0255"}}};
  msg::DiagnosticArray message = diagnostics_message(diagnostics);
  EXPECT_EQ(message.header.stamp.nsec, 7U);
  ASSERT_EQ(message.status.size(), 1U);
  EXPECT_EQ(message.status[0].name, "viwo: odometry");
  EXPECT_EQ(message.status[0].level, msg::DiagnosticStatus::WARN);
  EXPECT_EQ(message.status[0].message, "latency 0.3 s");
  ASSERT_EQ(message.status[0].values.size(), 1U);
  EXPECT_EQ(message.status[0].values[0].key, "r_1");
  EXPECT_EQ(message.status[0].values[0].value, "0.0255");
  diagnostics.warns = false;
  EXPECT_EQ(diagnostics_message(diagnostics).status[0].level, msg::DiagnosticStatus::OK);
  diagnostics.fails = true;
  EXPECT_EQ(diagnostics_message(diagnostics).status[0].level, msg::DiagnosticStatus::ERROR);
}

TEST(Ros1Messages, CalibrationIsAJointOfEachParameter) {
  EstimateSample estimate;
  estimate.t_ns = 1'000'000'007;
  estimate.calibration_names = {"r_1", "t_OtoI"};
  estimate.calibration = {0.0255, 0.005};
  estimate.calibration_sigma = {0.00025, 0.001};
  const msg::JointState message = calibration_message(estimate);
  EXPECT_EQ(message.header.stamp.nsec, 7U);
  ASSERT_EQ(message.name.size(), 2U);
  EXPECT_EQ(message.name[1], "t_OtoI");
  EXPECT_EQ(std::vector<double>(message.position.begin(), message.position.end()),
            estimate.calibration);
  EXPECT_EQ(std::vector<double>(message.effort.begin(), message.effort.end()),
            estimate.calibration_sigma);
  EXPECT_TRUE(message.velocity.empty());
}

}  // namespace
}  // namespace viwo::ros1
