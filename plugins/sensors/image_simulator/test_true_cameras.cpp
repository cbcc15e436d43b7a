// Cameras that are not as their file says.
#include <map>

#include "image_simulator_fixture.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

/// A Kalibr file of one radtan camera with the true values that a sensor told.
std::string write_chain(const std::vector<CalibrationSample>& truth) {
  std::map<std::string, double> value;
  for (const CalibrationSample& sample : truth) value[sample.name] = sample.value;
  const Eigen::Matrix3d R = exp_so3({value.at("cam0.theta_ItoC_x"), value.at("cam0.theta_ItoC_y"),
                                     value.at("cam0.theta_ItoC_z")});
  std::string file = ::testing::TempDir() + "/viwo_image_simulator_truth.yaml";
  std::ofstream out(file);
  out.precision(17);
  out << "cam0:\n  camera_model: pinhole\n  intrinsics: [" << value.at("cam0.fx") << ", "
      << value.at("cam0.fy") << ", " << value.at("cam0.cx") << ", " << value.at("cam0.cy")
      << "]\n  distortion_model: radtan\n  distortion_coeffs: [" << value.at("cam0.d1") << ", "
      << value.at("cam0.d2") << ", " << value.at("cam0.d3") << ", " << value.at("cam0.d4")
      << "]\n  resolution: [80, 60]\n  timeshift_cam_imu: " << value.at("cam0.t_CtoI")
      << "\n  T_cam_imu: [";
  for (int i = 0; i < 3; ++i) {
    out << "[" << R(i, 0) << ", " << R(i, 1) << ", " << R(i, 2) << ", "
        << value.at(std::string("cam0.p_IinC_") + "xyz"[i]) << "], ";
  }
  out << "[0, 0, 0, 1]]\n";
  return file;
}

TEST(ImageSimulator, ImagesAreThoseOfTheTrueCameraWhichItTells) {
  const std::string nominal = ::testing::TempDir() + "/viwo_image_simulator_nominal.yaml";
  std::ofstream(nominal)
      << "cam0:\n  camera_model: pinhole\n  intrinsics: [60, 61, 39.5, 29.5]\n"
         "  distortion_model: radtan\n  distortion_coeffs: [0.01, 0, 0, 0]\n"
         "  resolution: [80, 60]\n  timeshift_cam_imu: 0.002\n"
         "  T_cam_imu: [[0, -1, 0, 0.1], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]\n";
  // The room follows from the motion of the file's camera, which differs.
  const std::string room = "sigma_grey: 0, boxes: 0, room_size_m: [8, 7], room_centre_m: [0, 0]";
  const auto config_of = [&room](const std::string& file, const std::string& rest) {
    return "{type: image_simulator, texture_size_px: 256, cameras: " + file + ", " + room + rest +
           "}";
  };
  const auto all =
      play_on(make_sensor(config_of(
                  nominal,
                  ", camera_clock_error_s: [0.0105], sigma_true_camera_orientation_rad: 0.02, "
                  "sigma_true_camera_position_m: 0.05, sigma_true_camera_focal_px: 2, "
                  "sigma_true_camera_distortion: 0.01")),
              states(4));
  const auto wrong = only<ImageSample>(all);
  const auto truth = only<CalibrationSample>(all);
  ASSERT_EQ(truth.size(), 15U);
  EXPECT_EQ(truth[14].value, 0.0125);
  EXPECT_EQ(truth[0].t_ns, 2'000'000'000);
  const auto expected = images(config_of(write_chain(truth), ""), states(4));
  const auto as_the_file_says = images(config_of(nominal, ""), states(4));
  ASSERT_EQ(wrong.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(wrong[i].t_ns, expected[i].t_ns);
    const Image image = pixels_of(wrong[i]);
    EXPECT_LT(different_pixels(image, pixels_of(expected[i])), 10) << i;  // rounding, at edges
    EXPECT_GT(different_pixels(image, pixels_of(as_the_file_says[i])), 2000) << i;
  }
}

}  // namespace
}  // namespace viwo
