// The image simulator as the host loads it, on the true states of sensor simulator or of a test.
#include <cmath>
#include <thread>

#include <Eigen/Geometry>

#include "image_simulator_fixture.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/rendering/image_renderer.hpp"

namespace viwo {
namespace {

TEST(ImageSimulator, ImagesStandAtTheStampsOfTheSimulatorsCameras) {
  const std::string simulator =
      "{type: simulator, robot: {type: differential, radius_left_m: 0.1, radius_right_m: 0.1, "
      "baseline_m: 0.5}, motion: figure_eight, duration_s: 2, camera_phase_s: 0.0137, ground: "
      "uneven";
  const auto tracked = play_only<FeatureSample>(simulator + ", features: 5, n_cameras: 2, " +
                                                "cameras: " + kCameraFile + "}");
  const auto sensor = make_sensor(section("n_cameras: 2"));
  const auto input = make_sensor(simulator + ", features: 0}");
  sensor->connect(*input);
  const auto rendered = only<ImageSample>(play(*sensor));
  ASSERT_EQ(rendered.size(), tracked.size());
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    EXPECT_EQ(rendered[i].t_ns, tracked[i].t_ns);
    EXPECT_EQ(rendered[i].camera, tracked[i].camera);
  }
}

/// A robot in motion, and its gyro; `after_s` moves it as it moves.
std::vector<Measurement> in_motion(double after_s, bool with_gyro) {
  const Eigen::Vector3d v(0.8, -0.3, 0.1), w(0.4, -0.2, 1.1), bias(0.02, -0.01, 0.03);
  std::vector<Measurement> out = states(1);
  out.erase(out.begin());  // the state only
  StateSample state;
  state.t_ns = 2'100'000'000;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.1, 0.2, 1.).normalized()));
  const Eigen::Vector3d turn = after_s * w;
  const Eigen::Quaterniond turned =
      q * Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  const Eigen::Vector3d p = Eigen::Vector3d(0.1, 0.05, 0.15) + after_s * v;
  state.q_ItoG_xyzw = {turned.x(), turned.y(), turned.z(), turned.w()};
  state.p_IinG_m = {p.x(), p.y(), p.z()};
  state.v_IinG_m_per_s = {v.x(), v.y(), v.z()};
  state.gyro_bias_rad_per_s = {bias.x(), bias.y(), bias.z()};
  const Eigen::Vector3d gyro = w + bias;
  for (int k = -4; with_gyro && k <= 0; ++k) {
    out.emplace_back(ImuSample{state.t_ns + 5'000'000 * k, {gyro.x(), gyro.y(), gyro.z()}, {}});
  }
  out.emplace_back(state);
  return out;
}

TEST(ImageSimulator, RowsOfARollingShutterAreSeenOneAfterTheOther) {
  const std::string folder = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/cameras/";
  const auto of = [&](const std::string& file) {
    return "{type: image_simulator, texture_size_px: 256, boxes: 0, n_cameras: 2, sigma_grey: 0, "
           "room_size_m: [8, 7], room_centre_m: [0, 0], cameras: " +
           folder + file + "}";
  };
  const std::string rolling = of("rolling_shutter.yaml"), global = of("t265_like.yaml");
  const auto images_of = images(rolling, in_motion(0., true));
  ASSERT_EQ(images_of.size(), 2U);
  for (std::size_t camera = 0; camera < 2; ++camera) {
    EXPECT_EQ(images_of[camera].t_ns, 2'100'000'000 - 11'985'000);
    const Image image = pixels_of(images_of[camera]);
    for (const int row : {20, 399, 780}) {
      const double after_s = 3e-5 * (row - 399.5);
      const auto row_of = [&](double s) {
        Image then = pixels_of(images(global, in_motion(s, true))[camera]);
        const auto begin = then.pixels.begin() + std::ptrdiff_t{848} * row;
        return std::vector<std::uint8_t>(begin, begin + 848);
      };
      const auto begin = image.pixels.begin() + std::ptrdiff_t{848} * row;
      const std::vector<std::uint8_t> seen(begin, begin + 848);
      const auto difference = [&](const std::vector<std::uint8_t>& other) {
        double sum = 0.;
        for (std::size_t u = 0; u < seen.size(); ++u) sum += std::abs(double(seen[u]) - other[u]);
        return sum / static_cast<double>(seen.size());
      };
      EXPECT_LT(difference(row_of(after_s)), 0.5) << "row " << row;
      if (row != 399) {  // 15 µs from the middle: nothing is told apart
        EXPECT_GT(difference(row_of(-after_s)), 3.) << "row " << row;
      }
    }
  }
  EXPECT_EQ(refusal(rolling, in_motion(0., false)),
            "the input gives no IMU samples at its true states: images of a rolling shutter "
            "(line_delay_nanoseconds of the cameras) need them");
}

TEST(ImageSimulator, TheFirstStateHasImagesOnlyIfAskedFor) {
  EXPECT_EQ(images(section(""), states(4)).size(), 3U);
  EXPECT_EQ(images(section("n_cameras: 2"), states(4)).size(), 6U);
  const auto all = images(section("skip_first: false"), states(4));
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(all[0].t_ns, 2'000'000'000);
}

TEST(ImageSimulator, CamerasAreWhereTheirChainPutsThemOnTheImu) {
  const auto rendered =
      images(section("n_cameras: 2, sigma_grey: 0, room_size_m: [8, 7], room_centre_m: [0.2, 0.1]"),
             states(5));
  rendering::RoomOptions options;
  options.size_m = {8., 7.};
  options.centre_m = {0.2, 0.1};
  options.texture_size = 256;
  options.blocks = 10;
  const auto input = only<StateSample>(states(5));
  const auto cameras = log::read_kalibr_cameras(kCameraFile);
  // Homogeneous matrices, inverted by Eigen.
  std::vector<Eigen::Vector3d> path;
  std::vector<rendering::CameraPose> poses;
  for (std::size_t k = 1; k < input.size(); ++k) {
    Eigen::Isometry3d T_GfromI = Eigen::Isometry3d::Identity();
    T_GfromI.translate(Eigen::Vector3d(input[k].p_IinG_m.data()));
    T_GfromI.rotate(Eigen::AngleAxisd(0.05 * static_cast<double>(k), Eigen::Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(0.02 * static_cast<double>(k), Eigen::Vector3d::UnitX()));
    for (const CameraView& camera : cameras) {
      Eigen::Isometry3d T_CfromI = Eigen::Isometry3d::Identity();
      T_CfromI.translate(camera.p_IinC);
      T_CfromI.rotate(camera.R_ItoC);
      const Eigen::Isometry3d T_GfromC = T_GfromI * T_CfromI.inverse();
      poses.push_back({T_GfromC.linear(), T_GfromC.translation()});
      path.push_back(T_GfromC.translation());
    }
  }
  const auto room =
      std::make_shared<const rendering::TexturedRoom>(rendering::make_room(options, path));
  ASSERT_EQ(rendered.size(), poses.size());
  for (const std::size_t i : {0, 1, 6, 7}) {
    const rendering::ImageRenderer renderer(cameras[i % 2], room);
    Image expected;
    renderer.render(poses[i], {}, expected);
    const Image image = pixels_of(rendered[i]);
    EXPECT_LT(different_pixels(image, expected), 100) << i;  // rounding of the poses, at edges
    EXPECT_GT(mean_of(image), 60.);
  }
}

TEST(ImageSimulator, StampsAreInTheClocksOfTheCamerasAndStayInOrder) {
  const std::string file = ::testing::TempDir() + "/viwo_image_simulator_clocks.yaml";
  std::ofstream out(file);
  for (int i = 0; i < 2; ++i) {
    out << "cam" << i << ":\n  camera_model: pinhole\n  intrinsics: [100, 100, 39.5, 29.5]\n"
        << "  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n"
        << "  resolution: [80, 60]\n  timeshift_cam_imu: " << (i == 0 ? "-0.13" : "0.0125")
        << "\n  T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]\n";
  }
  out.close();
  const auto all = images(section("n_cameras: 2, sigma_grey: 0", file), states(6));
  ASSERT_EQ(all.size(), 10U);
  std::vector<ImageSample> of_camera[2];
  for (const ImageSample& image : all) of_camera[image.camera].push_back(image);
  for (int k = 0; k < 5; ++k) {
    const std::int64_t t_ns = 2'100'000'000 + k * std::int64_t{100'000'000};
    const auto i = static_cast<std::size_t>(k);
    EXPECT_EQ(of_camera[0][i].t_ns, t_ns + 130'000'000);
    EXPECT_EQ(of_camera[1][i].t_ns, t_ns - 12'500'000);
    // Both cameras are in one place, hence see the same at the same true time.
    EXPECT_EQ(pixels_of(of_camera[0][i]).pixels, pixels_of(of_camera[1][i]).pixels);
  }
}

TEST(ImageSimulator, IsExactWhenThatIsAskedForWhateverItsParametersSay) {
  const auto sensor = make_sensor(
      section("sigma_grey: 5, camera_clock_error_s: [0.01], sigma_true_camera_focal_px: 5"), 1,
      true);
  EXPECT_TRUE(sensor->can_be_exact());
  const auto exact = only<ImageSample>(play_on(sensor, states(3)));
  const auto quiet = images(section("sigma_grey: 0"), states(3));
  ASSERT_EQ(exact.size(), quiet.size());
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_EQ(exact[i].t_ns, quiet[i].t_ns);
    EXPECT_EQ(pixels_of(exact[i]).pixels, pixels_of(quiet[i]).pixels);
  }
}

TEST(ImageSimulator, NoiseIsThatOfTheImageWhateverElseIsSimulatedOrRead) {
  const auto clean = images(section("sigma_grey: 0"), states(4));
  const auto noisy = images(section("sigma_grey: 5"), states(4));
  const auto both = images(section("sigma_grey: 5, n_cameras: 2, drop_start_s: [0.05], "
                                   "drop_duration_s: 0.1"),
                           states(4));
  const auto other = images(section("sigma_grey: 5"), states(4), 2);
  ASSERT_EQ(both.size(), 4U);
  const Image reference = pixels_of(clean[2]), last = pixels_of(noisy[2]);
  EXPECT_EQ(last.pixels, pixels_of(noisy[2]).pixels);
  EXPECT_NE(last.pixels, pixels_of(other[2]).pixels);
  const auto residual = [](const Image& a, const Image& b) {
    double sum = 0.;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
      sum += std::pow(static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i]), 2);
    }
    return std::sqrt(sum / static_cast<double>(a.pixels.size()));
  };
  EXPECT_NEAR(residual(reference, last), 5., 0.1);
  EXPECT_NEAR(residual(last, pixels_of(other[2])), 5. * std::sqrt(2.), 0.15);
  const auto alone =
      images(section("sigma_grey: 5, drop_start_s: [0.05], drop_duration_s: 0.1"), states(4));
  ASSERT_EQ(alone.size(), 2U);
  EXPECT_EQ(pixels_of(alone[1]).pixels, last.pixels);
}

TEST(ImageSimulator, ReadingFromSeveralThreadsGivesTheSameBits) {
  const auto all = images(section("n_cameras: 2"), states(3));
  std::vector<Image> alone, together(8);
  for (std::size_t i = 0; i < 8; ++i) alone.push_back(pixels_of(all[i % 4]));
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 8; ++i) {
    threads.emplace_back([&, i] { all[i % 4].source->read(together[i]); });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(alone[i].pixels, together[i].pixels) << i;
}

TEST(ImageSimulator, DarknessAndMissingImagesComeWhenTheyWereAskedFor) {
  const auto all = images(section("dark_start_s: [0.3, 0.85], dark_duration_s: 0.2, "
                                  "drop_start_s: [0.6], drop_duration_s: 0.2"),
                          states(11));
  std::map<std::int64_t, double> brightness;  // by tenths of a second from the first state
  for (const ImageSample& image : all) {
    brightness[(image.t_ns - 2'000'000'000) / 100'000'000] = mean_of(pixels_of(image));
  }
  for (const std::int64_t tenth : {1, 2, 5, 8}) {
    ASSERT_TRUE(brightness.contains(tenth)) << tenth;
    EXPECT_GT(brightness[tenth], 80.) << tenth;
  }
  for (const std::int64_t tenth : {3, 4, 9, 10}) {
    ASSERT_TRUE(brightness.contains(tenth)) << tenth;
    EXPECT_LT(brightness[tenth], 4.) << tenth;
  }
  EXPECT_EQ(brightness.size(), 8U);  // without 6 and 7
}

TEST(ImageSimulator, TheBrightnessSwings) {
  const auto all = images(
      section("exposure_swing: 0.5, exposure_period_s: 0.4, sigma_grey: 0, skip_first: false"),
      states(4));
  const double middle = mean_of(pixels_of(all[0]));
  EXPECT_GT(mean_of(pixels_of(all[1])), 1.3 * middle);
  EXPECT_NEAR(mean_of(pixels_of(all[2])), middle, 0.1 * middle);
  EXPECT_NEAR(mean_of(pixels_of(all[3])), 0.5 * middle, 0.05 * middle);
}

TEST(ImageSimulator, TheRoomFollowsFromTheWorldSeedAndNotFromThatOfTheRun) {
  const auto reference = pixels_of(images(section("sigma_grey: 0"), states(2), 1)[0]);
  EXPECT_EQ(pixels_of(images(section("sigma_grey: 0"), states(2), 99)[0]).pixels, reference.pixels);
  EXPECT_NE(pixels_of(images(section("sigma_grey: 0, world_seed: 2"), states(2), 1)[0]).pixels,
            reference.pixels);
}

TEST(ImageSimulator, SaysWhatItRefusesAndWhy) {
  const auto message = [](const std::string& rest) {
    const std::string text = error_of(section(rest));
    return text.substr(std::min(text.find("sensor."), text.size()));
  };
  EXPECT_EQ(message("room_size_m: [5]"),
            "sensor.room_size_m: needs two numbers, along x and y, not 1");
  EXPECT_EQ(message("n_cameras: 3"), "sensor.n_cameras: there are only 2 in " + kCameraFile);
  EXPECT_EQ(message("box_reach_m: 0.2"), "sensor.box_reach_m: is less than box_clearance_m");
  EXPECT_NE(error_of("{type: image_simulator, cameras: " + kCameraFile + ", texture_size_px: 100}")
                .find("sensor.texture_size_px: 100 is not a power of two: 512, 1024, 2048, ..."),
            std::string::npos);
  EXPECT_EQ(refusal(section(""), {ImuSample{}}),
            "the input gives no true states, which sensors simulator and asl_state do");
  EXPECT_NE(refusal(section("room_size_m: [2, 4], room_centre_m: [0, 0]"), states(12))
                .find("the cameras leave the room or come closer than 0.1 m to it: along x they "
                      "move from 0.1"),
            std::string::npos);
  EXPECT_NE(refusal(section("floor_m: 0.3"), states(12)).find("along z they move"),
            std::string::npos);
  EXPECT_TRUE(images(section(""), states(1)).empty());
}

}  // namespace
}  // namespace viwo
