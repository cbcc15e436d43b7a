// Frames of a robot: chains, turns, names, and what is none.
#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frame_tree.hpp"

namespace viwo::live {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// By the half angle about one axis: an own computation, not that of the code.
bag::Transform turned_z(const std::string& parent, const std::string& child, double x, double y,
                        double yaw_rad) {
  return {parent, child, {x, y, 0.}, {0., 0., std::sin(0.5 * yaw_rad), std::cos(0.5 * yaw_rad)}};
}

void expect_at(const std::optional<FramePose>& pose, double x, double y, double z, double yaw_rad) {
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->p_AinB.x(), x, 1e-12);
  EXPECT_NEAR(pose->p_AinB.y(), y, 1e-12);
  EXPECT_NEAR(pose->p_AinB.z(), z, 1e-12);
  EXPECT_NEAR(std::atan2(pose->R_AtoB(1, 0), pose->R_AtoB(0, 0)), yaw_rad, 1e-12);
}

TEST(FrameTree, FindsTheWayOverACommonFrame) {
  FrameTree tree;
  // The body is a child of chassis, turned left by a quarter; so is the plate with the IMU.
  EXPECT_EQ(tree.add(turned_z("chassis", "/base_link", 1., 0., M_PI_2)), "");
  EXPECT_EQ(tree.add(turned_z("/chassis", "plate", 3., 2., 0.)), "");
  EXPECT_EQ(tree.add(turned_z("plate", "imu", 0.5, 0., M_PI)), "");
  // In chassis the IMU is at (3.5, 2) and looks back. From the base at (1, 0), whose x is the
  // chassis' y: 2 ahead, 2.5 to the right.
  expect_at(tree.find("imu", "base_link"), 2., -2.5, 0., M_PI_2);
  expect_at(tree.find("imu", "plate"), 0.5, 0., 0., M_PI);
  // Back: the base, seen from the IMU.
  expect_at(tree.find("base_link", "/imu"), 2.5, 2., 0., -M_PI_2);
  expect_at(tree.find("imu", "imu"), 0., 0., 0., 0.);
  EXPECT_FALSE(tree.find("imu", "elsewhere"));
  EXPECT_THAT(tree.names(), ElementsAre("base_link", "chassis", "imu", "plate"));
  // What is newer holds.
  EXPECT_EQ(tree.add(turned_z("plate", "imu", 0.75, 0., M_PI)), "");
  expect_at(tree.find("imu", "plate"), 0.75, 0., 0., M_PI);
}

TEST(FrameTree, RefusesWhatIsNoTransformAndSurvivesRings) {
  FrameTree tree;
  EXPECT_THAT(tree.add({"", "imu", {}, {0., 0., 0., 1.}}), HasSubstr("without a name"));
  EXPECT_THAT(tree.add({"/", "imu", {}, {0., 0., 0., 1.}}), HasSubstr("without a name"));
  EXPECT_THAT(tree.add({"imu", "/imu", {}, {0., 0., 0., 1.}}), HasSubstr("to itself"));
  EXPECT_THAT(tree.add({"base", "imu", {}, {0., 0., 0., 0.}}), HasSubstr("that is none"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(tree.add({"base", "imu", {}, {0., 0., nan, 1.}}), HasSubstr("that is none"));
  EXPECT_THAT(tree.add({"base", "imu", {0., nan, 0.}, {0., 0., 0., 1.}}),
              HasSubstr("that is none"));
  EXPECT_THAT(tree.add({"base", "imu", {1e308, 0., 0.}, {0., 0., 0., 1.}}), HasSubstr("is none"));
  EXPECT_THAT(tree.add(turned_z("base", std::string(1000, 'x'), 1., 0., 0.)), HasSubstr("256"));
  EXPECT_THAT(tree.add({"base", "\x1b[31m", {}, {0., 0., 0., 0.}}),
              ::testing::Not(HasSubstr("\x1b")));
  EXPECT_TRUE(tree.names().empty());
  tree.add(turned_z("a", "b", 1., 0., 0.));
  tree.add(turned_z("b", "c", 1., 0., 0.));
  tree.add(turned_z("c", "a", 1., 0., 0.));
  EXPECT_FALSE(tree.find("a", "base"));
  EXPECT_TRUE(tree.find("a", "b"));
}

TEST(FrameTree, TakesNoMoreThanARobotHas) {
  FrameTree tree;
  for (std::size_t i = 0; i < FrameTree::kMost; ++i) {
    ASSERT_EQ(tree.add(turned_z("f" + std::to_string(i), "f" + std::to_string(i + 1), 0., 1., 0.)),
              "");
  }
  EXPECT_THAT(tree.add(turned_z("f0", "one", 1., 0., 0.)), HasSubstr("more frames"));
  EXPECT_EQ(tree.add(turned_z("f999", "f1000", 0., 2., 0.)), "") << "known ones may change";
  expect_at(tree.find("f1000", "f0"), 0., 1001., 0., 0.);
}

#if VIWO_HAS_TINYXML2
TEST(FrameTree, TakesTheFixedJointsOfADescription) {
  FrameTree tree;
  const std::string urdf = R"(<?xml version="1.0"?><robot name="r">
    <joint name="mast" type="fixed"><parent link="base_link"/><child link="mast"/>
      <origin xyz="0.1 0 0.5" rpy="0 0 1.5707963267948966"/></joint>
    <joint name="imu" type="fixed"><parent link="mast"/><child link="imu"/>
      <origin xyz="1 0 0"/></joint>
    <joint name="steer" type="continuous"><parent link="base_link"/><child link="wheel"/></joint>
    <joint name="bad" type="fixed"><parent link="base_link"/><child link="lamp"/>
      <origin xyz="1 two 3"/></joint></robot>)";
  EXPECT_THAT(tree.add_urdf(urdf), HasSubstr("of 'lamp': its origin is not of three numbers"));
  expect_at(tree.find("imu", "base_link"), 0.1, 1., 0.5, M_PI_2);
  EXPECT_FALSE(tree.find("wheel", "base_link")) << "it moves";
  EXPECT_FALSE(tree.find("lamp", "base_link"));
  // What is newer holds.
  std::string moved = urdf;
  moved.replace(moved.find("\"1 0 0\"") + 1, 1, "3");
  tree.add_urdf(moved);
  expect_at(tree.find("imu", "base_link"), 0.1, 3., 0.5, M_PI_2);
  // /tf_static holds, whichever came first.
  EXPECT_EQ(tree.add(turned_z("mast", "imu", 2., 0., 0.)), "");
  tree.add_urdf(urdf);
  expect_at(tree.find("imu", "base_link"), 0.1, 2., 0.5, M_PI_2);
}

TEST(FrameTree, SaysWhatIsNoDescription) {
  FrameTree tree;
  EXPECT_THAT(tree.add_urdf("<robot><joint>"), HasSubstr("is no XML"));
  EXPECT_THAT(tree.add_urdf(""), HasSubstr("is no XML"));
  EXPECT_THAT(tree.add_urdf("<sdf/>"), HasSubstr("no element 'robot'"));
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  EXPECT_THAT(tree.add_urdf(deep), HasSubstr("is no XML"));
  EXPECT_TRUE(tree.names().empty());
}
#endif

}  // namespace
}  // namespace viwo::live
