// Mounts that a robot tells of: as a configuration has them, and against estimates of them.
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "mounts.hpp"
#include "viwo/api/params.hpp"

namespace viwo::live {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// By half angles: a quarter about z, and an optical frame that looks along x of base_link (its z is
// ahead, its x to the right).
const bag::Transform kImuFrame{"base_link", "imu", {0.1, 0.2, 0.3}, {0., 0., M_SQRT1_2, M_SQRT1_2}};
const bag::Transform kCameraFrame{"base_link", "optical", {0.5, 0., 0.3}, {-0.5, 0.5, -0.5, 0.5}};

/// What the host is told.
struct Told {
  static void log_text(void* host, LogLevel /*level*/, const char* text, std::uint64_t size) {
    static_cast<Told*>(host)->texts.emplace_back(text, size);
  }
  HostServices services{this, &Told::log_text, 1};
  std::vector<std::string> texts;
};

LiveParams params_of_all() {
  LiveParams params;
  params.imu_frame = "imu";
  params.body_frame = "base_link";
  params.wheel_frame = "base_link";
  params.image_topics = {"/image"};
  params.camera_frames = {"optical"};
  return params;
}

/// An estimate of one mount, all numbers of one sigma.
EstimateSample estimate_of(const std::string& prefix, const std::string& frame,
                           const Eigen::Vector3d& theta, const Eigen::Vector3d& p, double sigma) {
  EstimateSample estimate;
  for (const auto& [name, values] : {std::pair{"theta_Ito", theta}, std::pair{"p_Iin", p}}) {
    for (int i = 0; i < 3; ++i) {
      estimate.calibration_names.push_back(prefix + name + frame + "_" + "xyz"[i]);
      estimate.calibration.push_back(values[i]);
      estimate.calibration_sigma.push_back(sigma);
    }
  }
  return estimate;
}

TEST(Mounts, AreToldAsAConfigurationHasThem) {
  Told told;
  Mounts mounts(params_of_all(), told.services);
  EXPECT_TRUE(mounts.are_asked_for());
  EXPECT_FALSE(mounts.frames());
  mounts.take({kImuFrame});
  ASSERT_TRUE(mounts.frames());
  EXPECT_FALSE(mounts.are_known());
  mounts.take({kCameraFrame});
  EXPECT_TRUE(mounts.are_known());
  // x of the IMU is y of the base, that is left: -x of the camera; its y is back: -z. Seen from the
  // camera it is 0.4 m behind and 0.2 m to the left.
  EXPECT_THAT(
      told.texts,
      ElementsAre(
          "frame 'imu' is in 'base_link' at p_IinB_m: [0.1, 0.2, 0.3], rpy_ItoB_rad: [0, 0, "
          "1.5708]",
          "frame 'imu' is in 'base_link', wheels: {p_IinO_m: [0.1, 0.2, 0.3], rpy_ItoO_rad: "
          "[0, 0, 1.5708]}",
          AllOf(HasSubstr("frame 'imu' is in 'optical', cam0: {T_cam_imu: [[-1, "),
                HasSubstr(", -0.2], ["), HasSubstr(", -0.4], [0, 0, 0, 1]]}"))));
  mounts.take({kImuFrame});
  EXPECT_EQ(told.texts.size(), 3U) << "said again";
}

TEST(Mounts, EstimatesThatAreElsewhereAreTold) {
  Told told;
  Mounts mounts(params_of_all(), told.services);
  mounts.take({kImuFrame, kCameraFrame});
  told.texts.clear();
  const Eigen::Vector3d theta(0., 0., M_PI_2), p(0.1, 0.2, 0.3);
  EXPECT_EQ(mounts.trouble(estimate_of("", "O", theta, p, 1e-6)), "");
  EXPECT_EQ(mounts.trouble(estimate_of("", "O", theta, 2. * p, 0.)), "") << "it is held";
  EXPECT_EQ(mounts.trouble(estimate_of("", "O", theta, p + Eigen::Vector3d(0.1, 0., 0.), 0.05)), "")
      << "within its sigmas";
  EXPECT_THAT(mounts.trouble(estimate_of("", "O", theta, p + Eigen::Vector3d(0.1, 0., 0.), 0.01)),
              HasSubstr("in frame 'base_link' is 0.1 m and 0 rad from what the robot says"));
  // The other way round, R_OtoI, is another mount.
  EXPECT_THAT(mounts.trouble(estimate_of("", "O", -theta, p, 0.01)), HasSubstr("3.142 rad"));
  EXPECT_THAT(told.texts, ElementsAre(HasSubstr("0.1 m and 0 rad"))) << "not said once";
  // [-1 0 0; 0 0 -1; 0 -1 0] is half a turn: its trace is -1, and what it keeps is (0, 1, -1).
  const Eigen::Vector3d of_camera = M_PI * Eigen::Vector3d(0., M_SQRT1_2, -M_SQRT1_2);
  EXPECT_EQ(mounts.trouble(estimate_of("cam0.", "C", of_camera, {-0.2, 0., -0.4}, 1e-6)), "");
  EXPECT_THAT(mounts.trouble(estimate_of("cam0.", "C", of_camera, {-0.2, 0.4, 0.}, 1e-6)),
              HasSubstr("in frame 'optical' is 0.566 m"));
  EXPECT_EQ(mounts.trouble({}), "") << "of what is not estimated";
}

TEST(Mounts, FramesThatNobodyTellsOf) {
  Told told;
  LiveParams params = params_of_all();
  params.wheel_frame = "base_lnk";
  Mounts mounts(params, told.services);
  EXPECT_THAT(mounts.trouble({}), HasSubstr("where frame 'imu' is in 'base_link'"));
  mounts.take({kImuFrame});
  told.texts.clear();
  mounts.say_missing();
  EXPECT_THAT(
      told.texts,
      ElementsAre("nothing says where frame 'imu' is in 'base_lnk'; there is no 'base_lnk' - "
                  "did you mean 'base_link'?",
                  HasSubstr("there is no 'optical'")));
  EXPECT_EQ(mounts.trouble({}), "") << "the pose of the body is there";
}

TEST(Mounts, NeedTheFrameOfTheImu) {
  LiveParams params;
  EXPECT_FALSE(Mounts(params, {}).are_asked_for());
  params.wheel_frame = "base_link";
  EXPECT_THAT(testing::error_of([&] { params.frames(); }), HasSubstr("needs imu_frame"));
  params = params_of_all();
  params.camera_frames.push_back("right");
  EXPECT_THAT(testing::error_of([&] { params.frames(); }), HasSubstr("more of them than"));
  params.publish = false;
  params.wheel_frame.clear();
  params.camera_frames.clear();
  EXPECT_FALSE(Mounts(params, {}).are_asked_for()) << "nothing is published";
}

}  // namespace
}  // namespace viwo::live
