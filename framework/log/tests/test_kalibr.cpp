// Kalibr's camera chains and IMU files.
#include <cmath>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "log_files.hpp"
#include "viwo/log/kalibr.hpp"

namespace viwo::log {
namespace {

constexpr const char* kCamera =
    "  camera_model: pinhole\n"
    "  distortion_coeffs: [0.1, 0.2, 0.3, 0.4]\n"
    "  distortion_model: radtan\n"
    "  intrinsics: [400, 401.5, 320, 240]\n"
    "  resolution: [640, 480]\n";
/// A quarter turn about z: x of the IMU is y of the camera.
constexpr const char* kQuarter =
    "    - [0, -1, 0, 0.1]\n    - [1, 0, 0, 0.2]\n    - [0, 0, 1, 0.3]\n    - [0, 0, 0, 1]\n";

class Kalibr : public InFolder {
 protected:
  std::string refusal(const std::string& text) const {
    return stripped(text, [](const auto& file) { read_kalibr_cameras(file); });
  }
  std::string imu_refusal(const std::string& text) const {
    return stripped(text, [](const auto& file) { read_kalibr_imu(file); });
  }

 private:
  /// The message with "F" for the file.
  template <class Read>
  std::string stripped(const std::string& text, Read&& read) const {
    const auto file = write("k.yaml", text);
    std::string what = error_of([&] { read(file); });
    for (std::size_t at = 0; (at = what.find(file.string(), at)) != std::string::npos;) {
      what.replace(at, file.string().size(), "F");
    }
    return what;
  }
};

std::string camera(const std::string& place) { return "cam0:\n" + place + kCamera; }

TEST_F(Kalibr, ReadsACameraAndItsPlaceEitherWay) {
  const auto direct =
      read_kalibr_cameras(write("a.yaml", camera(std::string("  T_cam_imu:\n") + kQuarter)));
  ASSERT_EQ(direct.size(), 1U);
  EXPECT_EQ(direct[0].distortion, CameraDistortion::kRadtan);
  EXPECT_EQ(direct[0].width_px, 640);
  EXPECT_EQ(direct[0].height_px, 480);
  Eigen::Matrix<double, 8, 1> numbers;
  numbers << 400., 401.5, 320., 240., 0.1, 0.2, 0.3, 0.4;
  EXPECT_EQ(direct[0].intrinsics, numbers);
  EXPECT_EQ(direct[0].R_ItoC * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
  EXPECT_EQ(direct[0].p_IinC, Eigen::Vector3d(0.1, 0.2, 0.3));
  // T_imu_cam takes the camera's axes to the IMU's, and holds the camera's place in the IMU.
  const auto inverse =
      read_kalibr_cameras(write("b.yaml", camera(std::string("  T_imu_cam:\n") + kQuarter)));
  EXPECT_EQ(inverse[0].R_ItoC * Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX());
  const Eigen::Vector3d camera_seen_by_itself =
      inverse[0].R_ItoC * Eigen::Vector3d(0.1, 0.2, 0.3) + inverse[0].p_IinC;
  EXPECT_LT(camera_seen_by_itself.norm(), 1e-15);
}

TEST_F(Kalibr, ReadsTheClockOfTheCamera) {
  const std::string place = std::string("  T_cam_imu:\n") + kQuarter;
  const auto shifted =
      read_kalibr_cameras(write("a.yaml", camera(place + "  timeshift_cam_imu: -0.0125\n")));
  EXPECT_EQ(shifted[0].t_CtoI_s, -0.0125);
  EXPECT_EQ(read_kalibr_cameras(write("b.yaml", camera(place)))[0].t_CtoI_s, 0.);
  EXPECT_EQ(refusal(camera(place + "  timeshift_cam_imu: soon\n")),
            "F:7:22  cam0.timeshift_cam_imu: 'soon' is not a number");
  EXPECT_EQ(refusal(camera(place + "  timeshift_cam_imu: 1e18\n")),
            "F:7:22  cam0.timeshift_cam_imu: '1e18' is beyond 1e9");
}

TEST_F(Kalibr, ReadsTheRowsOfARollingShutter) {
  const std::string place = std::string("  T_cam_imu:\n") + kQuarter;
  const auto with = [&](const std::string& delay) {
    return camera(place + "  line_delay_nanoseconds: " + delay + "\n");
  };
  const CameraView rolling = read_kalibr_cameras(write("a.yaml", with("25000")))[0];
  EXPECT_DOUBLE_EQ(rolling.line_delay_s, 25e-6);
  EXPECT_DOUBLE_EQ(rolling.middle_s(), 239.5 * 25e-6);
  EXPECT_NEAR(rolling.after_middle_s(0.), -rolling.middle_s(), 1e-18);
  EXPECT_NEAR(rolling.after_middle_s(479.), rolling.middle_s(), 1e-18);
  EXPECT_EQ(read_kalibr_cameras(write("b.yaml", camera(place)))[0].line_delay_s, 0.);
  EXPECT_EQ(refusal(with("-1")), "F:7:27  cam0.line_delay_nanoseconds: -1 is negative");
  EXPECT_EQ(refusal(with("25e6")),
            "F:7:27  cam0.line_delay_nanoseconds: 2.5e+07 from row to row would be 12 s for an "
            "image");
}

TEST_F(Kalibr, FollowsTheChainFromTheCameraBefore) {
  const auto cameras = read_kalibr_cameras(
      write("a.yaml", camera(std::string("  T_cam_imu:\n") + kQuarter) + "cam1:\n  T_cn_cnm1:\n" +
                          kQuarter + kCamera + "cam2:\n  T_cn_cnm1:\n" + kQuarter + kCamera));
  ASSERT_EQ(cameras.size(), 3U);
  // Two quarter turns, then three; the places follow from p_C1 = R p_C0 + p with pencil and paper.
  EXPECT_EQ(cameras[1].R_ItoC * Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitX());
  EXPECT_LT((cameras[1].p_IinC - Eigen::Vector3d(-0.1, 0.3, 0.6)).norm(), 1e-15);
  EXPECT_EQ(cameras[2].R_ItoC * Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitY());
  EXPECT_LT((cameras[2].p_IinC - Eigen::Vector3d(-0.2, 0.1, 0.9)).norm(), 1e-15);
}

TEST_F(Kalibr, TakesOpenCvsFirstLineAndMakesRoundedRotationsExact) {
  const double c = 0.8661, s = 0.5;  // 30 degrees, badly rounded
  const std::string rows = "    - [" + std::to_string(c) + ", -0.5, 0, 0]\n    - [0.5, " +
                           std::to_string(c) + ", 0, 0]\n    - [0, 0, 1, 0]\n    - [0, 0, 0, 1]\n";
  const auto cameras =
      read_kalibr_cameras(write("a.yaml", "%YAML:1.0\n---\n" + camera("  T_cam_imu:\n" + rows)));
  const Eigen::Matrix3d R = cameras.at(0).R_ItoC;
  EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-15);
  // The nearest rotation turns by the angle of (c, s).
  EXPECT_NEAR(std::atan2(R(1, 0), R(0, 0)), std::atan2(s, c), 1e-15);
}

TEST_F(Kalibr, TakesACameraWithoutDistortion) {
  std::string text = camera(std::string("  T_cam_imu:\n") + kQuarter);
  text.replace(text.find("radtan"), 6, "none");
  EXPECT_THAT(refusal(text),
              ::testing::HasSubstr("distortion_coeffs: distortion_model: none has none"));
  text.replace(text.find("[0.1, 0.2, 0.3, 0.4]\n"), 20, "[]");
  const auto cameras = read_kalibr_cameras(write("none.yaml", text));
  EXPECT_EQ(cameras[0].distortion, CameraDistortion::kRadtan);
  EXPECT_EQ(cameras[0].intrinsics.tail<4>(), Eigen::Vector4d::Zero());
}

TEST_F(Kalibr, RefusesUnknownModelsWithWhatThereIs) {
  std::string text = camera(std::string("  T_cam_imu:\n") + kQuarter);
  text.replace(text.find("radtan"), 6, "equidistnt");
  text.replace(text.find("pinhole"), 7, "omni");
  EXPECT_EQ(refusal(text),
            "F:7:17  cam0.camera_model: 'omni' is not supported - known: pinhole\n"
            "F:9:21  cam0.distortion_model: 'equidistnt' is not supported - did you mean "
            "'equidistant'?");
}

TEST_F(Kalibr, RefusesMoreCamerasThanThereCanBe) {
  std::string text = camera(std::string("  T_cam_imu:\n") + kQuarter);
  for (int i = 1; i < 10'000; ++i) text += "cam" + std::to_string(i) + ": {}\n";
  EXPECT_THAT(refusal(text), ::testing::HasSubstr("cam64: more than 64 cameras"));
}

TEST_F(Kalibr, RefusesWhatIsNoRotation) {
  const auto with_first_row = [](const std::string& row) {
    return camera("  T_cam_imu:\n    - " + row +
                  "\n    - [0, 1, 0, 0]\n    - [0, 0, 1, 0]\n    - [0, 0, 0, 1]\n");
  };
  EXPECT_EQ(refusal(with_first_row("[1, 0.5, 0, 0]")),
            "F:3:5  cam0.T_cam_imu: not a rotation: R R^T differs from the identity by 0.5");
  EXPECT_EQ(refusal(with_first_row("[-1, 0, 0, 0]")),
            "F:3:5  cam0.T_cam_imu: not a rotation but a reflection: the determinant of R is -1");
  EXPECT_EQ(refusal(with_first_row("[1, 0, 0]")),
            "F:3:7  cam0.T_cam_imu: expected 4 numbers in a row, got 3");
  EXPECT_EQ(refusal(with_first_row("[1, 0, 0, x]")), "F:3:17  cam0.T_cam_imu: 'x' is not a number");
  EXPECT_EQ(refusal(with_first_row("[1, 0, 0, .inf]")),
            "F:3:17  cam0.T_cam_imu: '.inf' is not a number");
  EXPECT_EQ(refusal(camera("  T_cam_imu: [1, 2]\n")),
            "F:2:14  cam0.T_cam_imu: expected a matrix of 4 rows, got 2");
  std::string transposed = camera(std::string("  T_cam_imu:\n") + kQuarter);
  transposed.replace(transposed.find("[0, 0, 0, 1]"), 12, "[1, 2, 3, 1]");
  EXPECT_EQ(refusal(transposed), "F:6:7  cam0.T_cam_imu: the last row must be [0, 0, 0, 1]");
}

TEST_F(Kalibr, RefusesMissingPlaces) {
  EXPECT_EQ(refusal(camera("")),
            "F:2:3  cam0.T_cam_imu: missing; T_imu_cam would do, too (Kalibr writes it in the "
            "camera chain of its camera-IMU calibration)");
  EXPECT_EQ(refusal(camera(std::string("  T_cam_imu:\n") + kQuarter + "  T_imu_cam:\n" + kQuarter)),
            "F:8:5  cam0.T_imu_cam: T_cam_imu is given, too: keep one of them");
  // The first camera's message says it all; the second one hangs on it.
  EXPECT_EQ(refusal(camera("") + "cam1:\n  T_cn_cnm1:\n" + kQuarter + kCamera),
            refusal(camera("")));
}

TEST_F(Kalibr, RefusesMissingAndWrongKeysAllAtOnce) {
  EXPECT_EQ(refusal(std::string("cam0:\n  T_cam_imu:\n") + kQuarter +
                    "  camera_modle: pinhole\n"
                    "  distortion_model: radtan\n"
                    "  distortion_coeffs: [1, 2, 3]\n"
                    "  intrinsics: [0, 400, 320, 240]\n"
                    "  resolution: [640, 480.5]\n"),
            "F:2:3  cam0: missing key 'camera_model' - is 'camera_modle' a misspelling of it?\n"
            "F:9:22  cam0.distortion_coeffs: expected 4 numbers (radtan: k1, k2, p1, p2; "
            "equidistant: k1 .. k4), got 3\n"
            "F:10:15  cam0.intrinsics: the focal lengths fx and fy must be positive\n"
            "F:11:15  cam0.resolution: 480.5 is no number of pixels (1 to 32768)");
}

TEST_F(Kalibr, RefusesFilesWithoutCamerasOrWithGapsInTheirNumbers) {
  EXPECT_EQ(refusal("can0: {}\n"), "F:1:1  no camera 'cam0' - did you mean 'can0'?");
  EXPECT_EQ(refusal("imu0: {}\n"), "F:1:1  no camera 'cam0' - known: imu0");
  EXPECT_EQ(refusal(camera(std::string("  T_cam_imu:\n") + kQuarter) + "cam2: {}\n"),
            "F:12:1  cam2: there is no cam1 before it; cameras are counted from cam0 without gaps");
  EXPECT_EQ(refusal(""), "F:1  the file is empty");
  EXPECT_EQ(refusal("cam0: [\n").substr(0, 22), "F:2:1  not valid YAML:");
  const auto absent = folder_ / "absent.yaml";
  EXPECT_EQ(error_of([&] { read_kalibr_cameras(absent); }),
            absent.string() + "  cannot be read: No such file or directory");
}

TEST_F(Kalibr, ReadsNoMoreOfAFileThanAnyHas) {
  const std::string too_large = "  is larger than 1 MiB, as no YAML that viwo reads is";
  std::string comments;
  for (int i = 0; i < 1'000'000; ++i) comments += "# 1\n";
  EXPECT_EQ(refusal(comments), "F" + too_large);
  const auto packed = write_gz("k.yaml.gz", comments);
  EXPECT_EQ(error_of([&] { read_kalibr_cameras(packed); }), packed.string() + too_large);
}

TEST_F(Kalibr, ReadsImuNoisesWithAndWithoutALevel) {
  const std::string keys[] = {"accelerometer_noise_density: 0.002", "gyroscope_noise_density: 1e-4",
                              "accelerometer_random_walk: 0.003", "gyroscope_random_walk: 0"};
  std::string flat, nested = "%YAML:1.0\nimu0:\n";
  for (const std::string& key : keys) {
    flat += key + "\n";
    nested += "  " + key + "\n";
  }
  for (const std::string& text : {flat, nested}) {
    const ImuNoise noise = read_kalibr_imu(write("i.yaml", text));
    EXPECT_EQ(noise.accel_m_per_s2_sqrt_hz, 0.002);
    EXPECT_EQ(noise.gyro_rad_per_s_sqrt_hz, 1e-4);
    EXPECT_EQ(noise.accel_walk_m_per_s3_sqrt_hz, 0.003);
    EXPECT_EQ(noise.gyro_walk_rad_per_s2_sqrt_hz, 0.);
  }
  EXPECT_EQ(imu_refusal("imu0:\n  gyroscope_noise_density: 0\n  accelerometer_noise_densty: 1\n"
                        "  gyroscope_random_walk: -1\n  accelerometer_random_walk: fast\n"),
            "F:2:3  imu0: missing key 'accelerometer_noise_density' - is "
            "'accelerometer_noise_densty' a misspelling of it?\n"
            "F:2:28  imu0.gyroscope_noise_density: 0 is not positive\n"
            "F:4:26  imu0.gyroscope_random_walk: -1 is negative\n"
            "F:5:30  imu0.accelerometer_random_walk: 'fast' is not a number");
}

TEST_F(Kalibr, ReadsTheFilesOfARealT265) {
  const auto folder = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/t265";
  if (!std::filesystem::exists(folder / "kalibr_imucam_chain.yaml")) {
    GTEST_SKIP() << "no Kalibr files in " << folder;
  }
  const auto cameras = read_kalibr_cameras(folder / "kalibr_imucam_chain.yaml");
  ASSERT_EQ(cameras.size(), 2U);
  for (const CameraView& view : cameras) {
    EXPECT_EQ(view.distortion, CameraDistortion::kEquidistant);
    EXPECT_EQ(view.width_px, 848);
    EXPECT_EQ(view.height_px, 800);
    EXPECT_LT((view.R_ItoC * view.R_ItoC.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  }
  EXPECT_EQ(cameras[0].intrinsics[0], 282.019963259348);
  EXPECT_EQ(cameras[1].intrinsics[7], 0.010954064142332987);
  EXPECT_EQ(cameras[1].p_IinC[2], -0.015518593201262289);
  // Camera 1 in camera 0: the baseline of that device, along x.
  const Eigen::Matrix3d R_C1toC0 = cameras[0].R_ItoC * cameras[1].R_ItoC.transpose();
  const Eigen::Vector3d p_C1inC0 = cameras[0].p_IinC - R_C1toC0 * cameras[1].p_IinC;
  EXPECT_NEAR(p_C1inC0.x(), 0.0627, 2e-4);
  EXPECT_LT(p_C1inC0.tail<2>().norm(), 1e-3);
  // Kalibr's own chain says the same.
  EXPECT_NEAR(R_C1toC0(0, 1), -0.002142375274127713, 1e-8);
  const ImuNoise noise = read_kalibr_imu(folder / "kalibr_imu_chain.yaml");
  EXPECT_EQ(noise.gyro_rad_per_s_sqrt_hz, 0.00054166825);
  EXPECT_EQ(noise.accel_m_per_s2_sqrt_hz, 0.00732082098);
  EXPECT_EQ(noise.gyro_walk_rad_per_s2_sqrt_hz, 1.1687657234840692e-05);
  EXPECT_EQ(noise.accel_walk_m_per_s3_sqrt_hz, 0.0006696534319519138);
}

}  // namespace
}  // namespace viwo::log
