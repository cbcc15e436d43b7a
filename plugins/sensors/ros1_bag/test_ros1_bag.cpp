// The sensor ros1_bag as the host loads it: what it gives.
#include <array>
#include <thread>

#include "test_fixture.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::StartsWith;

void expect_drive(const std::vector<Measurement>& all) {
  const auto imu = only<ImuSample>(all);
  ASSERT_EQ(imu.size(), 40U);
  EXPECT_EQ(imu[3].t_ns, kStart + 15 * kMs);
  EXPECT_EQ(imu[3].gyro_rad_per_s, (std::array{0.1 * 3 + 1. / 3., -(0.1 * 3 + 1. / 3.), 0.2}));
  EXPECT_EQ(imu[3].accel_m_per_s2, (std::array{1., 0.1 * 3 + 1. / 3., 9.81}));

  const auto wheels = only<EncoderSample>(all);
  ASSERT_EQ(wheels.size(), 20U);
  EXPECT_EQ(wheels[1].t_ns, kStart + 10 * kMs);
  EXPECT_EQ(wheels[1].begin_ns, kStart + 5 * kMs);
  EXPECT_EQ(wheels[1].end_ns, kStart + 15 * kMs);
  EXPECT_EQ(wheels[1].n_drive, 2);
  EXPECT_EQ(wheels[1].n_steer, 1);
  EXPECT_EQ(wheels[1].drive_rad_per_s[0], 3. + (0.1 * 2 + 1. / 3.));
  EXPECT_EQ(wheels[1].drive_rad_per_s[1], 4. + (0.1 * 2 + 1. / 3.));
  EXPECT_EQ(wheels[1].steer_rad[0], 0.1 * 2 + 1. / 3.);

  const auto poses = only<PoseSample>(all);
  ASSERT_EQ(poses.size(), 10U);
  EXPECT_EQ(poses[9].t_ns, kStart + 180 * kMs);
  EXPECT_EQ(poses[9].p_BinW_m, (std::array{0.1 * 36 + 1. / 3., 1., 2.}));
  EXPECT_EQ(poses[9].q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));

  const auto images = only<ImageSample>(all);
  ASSERT_EQ(images.size(), 8U);
  for (std::size_t i = 0; i < images.size(); ++i) {
    EXPECT_EQ(images[i].camera, static_cast<int>(i % 2));
    EXPECT_EQ(images[i].t_ns, kStart + static_cast<std::int64_t>(i / 2) * 50 * kMs);
    Image image;
    images[i].source->read(image);
    EXPECT_EQ(image.width_px, 3);
    EXPECT_EQ(image.height_px, 2);
    EXPECT_THAT(image.pixels, ElementsAre(10 * (i / 2) + 100 * (i % 2), 1, 2, 3, 4, 5)) << i;
  }
}

TEST_F(Ros1Bag, GivesAllTopicsInTimeOrderToTheBit) {
  write_drive();
  const auto sensor = make_sensor(section(kAll));
  EXPECT_THAT(kinds_of(*sensor), ElementsAre("encoders", "images", "imu", "poses"));
  expect_drive(play(*sensor));
  EXPECT_THAT(rejections_of(*sensor), ElementsAre());
}

TEST_F(Ros1Bag, ReadsCompressedBags) {
  for (const std::string compression : {"bz2", "lz4"}) {
    write_drive(40, compression);
    EXPECT_NE(read().find("compression=" + compression), std::string::npos);
    expect_drive(play(*make_sensor(section(kAll))));
  }
}

/// Fixes of 400 ms, the third without one, the fifth of another covariance type each.
void write_fixes(const std::string& file, int n, int without = 3) {
  Ros1Writer out(file);
  for (int k = 0; k < n; ++k) {
    const std::int64_t t = kStart + 400 * k * kMs;
    bag::RawFix fix{k == without ? -1 : 0, 42. + 0.001 * k, -71., 7.5, {}, k % 4};
    fix.covariance_m2 = {0.81, 0.1, 0.2, 0.1, 0.64, 0.3, 0.2, 0.3, 3.24};
    out.write_fix("/fix", {t, t + kMs}, fix);
  }
  out.close();
}

TEST_F(Ros1Bag, GivesFixesWithWhatIsKnownOfTheirCovariance) {
  write_fixes(file(), 8);
  const auto sensor = make_sensor(section("gnss_topic: /fix"));
  EXPECT_THAT(kinds_of(*sensor), ElementsAre("gnss fixes"));
  const auto fixes = only<GnssSample>(play(*sensor));
  ASSERT_EQ(fixes.size(), 7U);
  EXPECT_EQ(fixes[1].t_ns, kStart + 400 * kMs);
  EXPECT_EQ(fixes[1].latitude_deg, 42.001);
  EXPECT_EQ(fixes[1].longitude_deg, -71.);
  EXPECT_EQ(fixes[1].altitude_m, 7.5);
  const std::array<double, 9> all{0.81, 0.1, 0.2, 0.1, 0.64, 0.3, 0.2, 0.3, 3.24};
  const std::array<double, 9> diagonal{0.81, 0., 0., 0., 0.64, 0., 0., 0., 3.24};
  EXPECT_EQ(fixes[0].covariance_ENU_m2, (std::array<double, 9>{})) << "unknown";
  EXPECT_EQ(fixes[1].covariance_ENU_m2, all) << "approximated";
  EXPECT_EQ(fixes[2].covariance_ENU_m2, diagonal) << "of which the diagonal is known";
  EXPECT_EQ(fixes[6].covariance_ENU_m2, all) << "known";
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(AllOf(StartsWith("/fix: message without a fix | "),
                                EndsWith(" | a.bag: message 4"))))
      << "spacings of 400 ms are no gaps";
}

TEST_F(Ros1Bag, GivesEveryNthFix) {
  write_fixes(file(), 8, -1);
  const auto fixes = play_only<GnssSample>(section("gnss_topic: /fix, gnss_stride: 3"));
  ASSERT_EQ(fixes.size(), 3U);
  EXPECT_EQ(fixes[2].t_ns, kStart + 2400 * kMs);
}

TEST_F(Ros1Bag, SaysThatNoMessageHasAFix) {
  write_fixes(file(), 1, 0);
  EXPECT_THAT(error_of(section("gnss_topic: /fix")),
              HasSubstr(file() + "  topic '/fix' has messages, and none has a fix"));
}

TEST_F(Ros1Bag, ReadsOnlyWhatIsWanted) {
  write_drive();
  const auto sensor = make_sensor(section("imu_topic: /imu0"));
  EXPECT_THAT(kinds_of(*sensor), ElementsAre("imu"));
  const auto all = play(*sensor);
  EXPECT_EQ(all.size(), 40U);
  EXPECT_EQ(only<ImuSample>(all).size(), 40U);
}

TEST_F(Ros1Bag, CutsByTheTimeOfRecordingAndTakesItAsClock) {
  write_drive();
  const auto imu = play_only<ImuSample>(
      section("imu_topic: /imu0, clock: reception, start_s: 0.05, duration_s: 0.02"));
  ASSERT_EQ(imu.size(), 5U);  // both ends are in
  EXPECT_EQ(imu.front().t_ns, kStart + 51 * kMs);
  EXPECT_EQ(imu.back().t_ns, kStart + 71 * kMs);
  EXPECT_THAT(error_of(section("imu_topic: /imu0, start_s: 5")),
              HasSubstr(file() + "  topic '/imu0' has no messages in the time that is read"));
}

TEST_F(Ros1Bag, TakesPositionsOfDrivesAsMultiTurnAngles) {
  {
    Ros1Writer out(file());
    for (int k = 0; k < 3; ++k) {
      const std::int64_t t = kStart + 10 * k * kMs;
      out.write_joints("/j", {t, t}, {"d", "s"}, {0.05 * k * k, 0.1 * k}, {});
    }
    out.close();
  }
  const auto wheels = play_only<EncoderSample>(
      section("joint_topic: /j, drive_joints: [d], steer_joints: [s], drive_input: position"));
  ASSERT_EQ(wheels.size(), 2U);
  EXPECT_NEAR(wheels[0].drive_rad_per_s[0], 5., 1e-12);
  EXPECT_NEAR(wheels[1].drive_rad_per_s[0], 15., 1e-12);
  EXPECT_NEAR(wheels[1].steer_rad[0], 0.15, 1e-15);
  EXPECT_EQ(wheels[1].begin_ns, kStart + 10 * kMs);
  const auto mounted = play_only<EncoderSample>(
      section("joint_topic: /j, drive_joints: [d], steer_joints: [s], drive_input: position, "
              "drive_scale: [-2], steer_scale: [-1], steer_shift_rad: [1]"));
  ASSERT_EQ(mounted.size(), 2U);
  EXPECT_NEAR(mounted[1].drive_rad_per_s[0], -30., 1e-12);
  EXPECT_NEAR(mounted[1].steer_rad[0], 0.85, 1e-15);
  EXPECT_THAT(error_of(section("imu_topic: /imu0, drive_scale: [1]")),
              HasSubstr("sensor.drive_scale: has 1 number for 0 drive channels of the log"));
  EXPECT_THAT(
      error_of(section("joint_topic: /j, drive_joints: [d]")),
      HasSubstr("3 of 3 messages rejected, allowed is a fraction of 0.1: /j: message without the "
                "velocities of the joints (3, first at a.bag: message 1)"));
}

TEST_F(Ros1Bag, TakesTheTwistOfAnOdometryForDrives) {
  {
    Ros1Writer out(file());
    for (const std::int64_t t : {kStart, kStart + 100 * kMs}) {
      out.write_odometry("/o", {t, t}, {4., 5., 6.}, {0., 0.6, 0., 0.8}, 0.75, 0.5);
    }
    out.close();
  }
  const auto wheels =
      play_only<EncoderSample>(section("joint_topic: /o, drive_joints: [v_x, omega_z]"));
  ASSERT_EQ(wheels.size(), 2U);
  EXPECT_EQ(wheels[0].drive_rad_per_s[0], 0.75);
  EXPECT_EQ(wheels[0].drive_rad_per_s[1], 0.5);
  EXPECT_THAT(error_of(section("joint_topic: /o, drive_joints: [v_X, omega_z]")),
              HasSubstr("sensor.drive_joints: no joint 'v_X' on topic '/o' in " + file() +
                        " - did you mean 'v_x'?"));
}

TEST_F(Ros1Bag, ReadsPosesWithCovarianceAndOdometry) {
  {
    Ros1Writer out(file());
    out.write_pose_with_covariance("/p", {5, 6}, {1., 2., 3.}, {0.6, 0., 0., 0.8});
    out.write_odometry("/o", {7, 8}, {4., 5., 6.}, {0., 0.6, 0., 0.8});
    out.close();
  }
  const auto poses = play_only<PoseSample>(section("pose_topic: /p"));
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses[0].t_ns, 5);
  EXPECT_EQ(poses[0].p_BinW_m, (std::array{1., 2., 3.}));
  EXPECT_EQ(poses[0].q_BtoW_xyzw, (std::array{0.6, 0., 0., 0.8}));
  const auto odometry = play_only<PoseSample>(section("odometry_topic: /o"));
  ASSERT_EQ(odometry.size(), 1U);
  EXPECT_EQ(odometry[0].t_ns, 7);
  EXPECT_EQ(odometry[0].p_BinW_m, (std::array{4., 5., 6.}));
  EXPECT_EQ(odometry[0].q_BtoW_xyzw, (std::array{0., 0.6, 0., 0.8}));
}

TEST_F(Ros1Bag, ReadsColourSixteenBitAndCompressedImages) {
  const Image png_image{2, 1, {17, 200}};
  {
    Ros1Writer out(file());
    out.write_image("/rgb", {1, 1}, {1, 1, "rgb8", false, 3, {200, 100, 50}});
    out.write_image("/deep", {1, 1}, {2, 1, "mono16", false, 4, {1, 2, 3, 4}});
    out.write_compressed_image("/png", {1, 1}, "mono8; png compressed ", encode_png(png_image));
    out.close();
  }
  const auto images = play_only<ImageSample>(section("image_topics: [/rgb, /deep, /png]"));
  ASSERT_EQ(images.size(), 3U);
  // 0.299 R + 0.587 G + 0.114 B
  EXPECT_THAT(read_image(images[0]).pixels, ElementsAre(124));
  EXPECT_THAT(read_image(images[1]).pixels, ElementsAre(2, 4));
  EXPECT_THAT(read_image(images[2]).pixels, ElementsAre(17, 200));
}

TEST_F(Ros1Bag, GivesTheSamePixelsToSeveralThreads) {
  write_drive(200);
  const auto images =
      play_only<ImageSample>(section("image_topics: [/cam0/image_raw, /cam1/image_raw]"));
  ASSERT_EQ(images.size(), 40U);
  std::array<int, 4> wrong{};
  std::vector<std::thread> threads;
  for (std::size_t thread = 0; thread < wrong.size(); ++thread) {
    threads.emplace_back([&, thread] {
      for (std::size_t i = 0; i < 400; ++i) {
        const std::size_t k = (i * 7 + thread * 11) % images.size();
        const auto value = static_cast<std::uint8_t>(10 * (k / 2) + 100 * (k % 2));
        if (read_image(images[k]).pixels.at(0) != value) ++wrong[thread];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(wrong, ElementsAre(0, 0, 0, 0));
}

TEST_F(Ros1Bag, PlaysTheBagsOfAFolderOneAfterTheOther) {
  const auto write_piece = [&](const std::string& name, int begin, int end) {
    Ros1Writer out(file(name));
    for (int k = begin; k < end; ++k) {
      const std::int64_t t = kStart + k * 5 * kMs;
      out.write_imu("/imu0", {t, t}, {static_cast<double>(k), 0., 0.}, {});
      out.write_image("/cam0", {t, t}, grey(k));
    }
    out.close();
  };
  write_piece("run_10.bag", 10, 15);  // by its name it would be the first
  write_piece("run_9.bag", 5, 10);
  write_piece("run_8.bag", 0, 5);
  const auto all = play(*make_sensor(section("imu_topic: /imu0, image_topics: [/cam0]", "")));
  const auto imu = only<ImuSample>(all);
  const auto images = only<ImageSample>(all);
  ASSERT_EQ(imu.size(), 15U);
  ASSERT_EQ(images.size(), 15U);
  for (std::size_t k = 0; k < 15; ++k) {
    EXPECT_EQ(imu[k].gyro_rad_per_s[0], static_cast<double>(k));
    EXPECT_EQ(read_image(images[k]).pixels[0], k);
  }
  EXPECT_EQ(
      play_only<ImuSample>(section("imu_topic: /imu0, paths: [run_8.bag, run_9.bag]", "")).size(),
      10U);
  EXPECT_THAT(error_of(section("imu_topic: /imu0, paths: [run_7.bag]", "")),
              HasSubstr("sensor.paths: no file 'run_7.bag' in "));
  fs::create_directories(folder_ / "none");
  EXPECT_THAT(error_of(section(kAll, "none")), HasSubstr("sensor.path: no *.bag in the folder "));
  std::ofstream(folder_ / "none/metadata.yaml") << "";
  EXPECT_THAT(error_of(section(kAll, "none")), HasSubstr("did you mean type: ros2_bag?"));
}

}  // namespace
}  // namespace viwo
