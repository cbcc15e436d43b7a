// A sequence in the dataset's files whose motion is known: for tests.
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <string>

#include "viwo/api/measurement.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo::kaist {

/// An image of one colour as a sensor with the pattern RGGB sees it.
inline Image bayer_image(int width_px, int height_px, int red, int green, int blue) {
  Image image{width_px, height_px, {}};
  for (int v = 0; v < height_px; ++v) {
    for (int u = 0; u < width_px; ++u) {
      const int value = v % 2 == 0 ? (u % 2 == 0 ? red : green) : (u % 2 == 0 ? green : blue);
      image.pixels.push_back(static_cast<std::uint8_t>(value));
    }
  }
  return image;
}

/// A car on a level circle at constant speed; its IMU is (-0.07, 0, 1.7) m from the middle of the
/// rear axle, its axes are those of the car.
struct TestSequence {
  std::int64_t begin_ns = 1'544'581'170'000'000'000;
  double duration_s = 10.;
  double rate_hz = 100.;  ///< of encoders, IMU and poses
  double speed_m_per_s = 2.;
  double yaw_rate_rad_per_s = 0.2;
  double radius_left_m = 0.3117395;
  double radius_right_m = 0.311403;
  double baseline_m = 1.52439;
  int n_images = 10;  ///< of each camera, every 0.1 s
  int width_px = 8;
  int height_px = 6;

  std::int64_t stamp_ns(int i) const {
    return begin_ns + std::llround(1e9 * static_cast<double>(i) / rate_hz);
  }
  std::int64_t image_stamp_ns(int i) const { return begin_ns + 100'000'000LL * i + 5'000'000; }

  /// Colour of image i of both cameras.
  static int red(int i) { return 20 + 20 * i; }
  static int green(int i) { return 240 - 17 * i; }
  static int blue(int i) { return 10 + 7 * i; }

  /// Counts of a wheel after `t_s`.
  std::int64_t count(double t_s, double side, double radius_m) const {
    const double wheel_m_per_s = speed_m_per_s + side * 0.5 * baseline_m * yaw_rate_rad_per_s;
    return std::llround(wheel_m_per_s * t_s / radius_m * 4096. / (2. * M_PI));
  }

  void write_encoders(const std::filesystem::path& folder) const {
    std::ofstream out(folder / "sensor_data/encoder.csv");
    for (int i = 0; i <= static_cast<int>(duration_s * rate_hz); ++i) {
      const double t_s = static_cast<double>(i) / rate_hz;
      out << stamp_ns(i) << ',' << 5000 + count(t_s, -1., radius_left_m) << ','
          << 7000 + count(t_s, 1., radius_right_m) << '\n';
    }
  }

  void write_imu(const std::filesystem::path& folder) const {
    std::ofstream out(folder / "sensor_data/xsens_imu.csv");
    const double to_centre = yaw_rate_rad_per_s * speed_m_per_s;
    const double along = 0.07 * yaw_rate_rad_per_s * yaw_rate_rad_per_s;
    for (int i = 0; i <= static_cast<int>(duration_s * rate_hz); ++i) {
      // What is not read is no number, or would spoil the result.
      out << stamp_ns(i) << ",0.1,0.2,0.3,0.9,91,92,93,0,0," << yaw_rate_rad_per_s << ',' << along
          << ',' << to_centre << ",9.81,81,82,83\n";
    }
  }

  void write_poses(const std::filesystem::path& folder) const {
    std::ofstream out(folder / "global_pose.csv");
    const double radius_m = speed_m_per_s / yaw_rate_rad_per_s;
    for (int i = 0; i <= static_cast<int>(duration_s * rate_hz); ++i) {
      const double yaw = 0.7 + yaw_rate_rad_per_s * static_cast<double>(i) / rate_hz;
      const double c = std::cos(yaw), s = std::sin(yaw);
      out << stamp_ns(i) << std::fixed << std::setprecision(6) << ',' << c << ',' << -s << ",0,"
          << 327365.25 + radius_m * s << ',' << s << ',' << c << ",0," << 4151234.5 - radius_m * c
          << ",0,0,1,22.125\n";
    }
  }

  void write_images(const std::filesystem::path& folder) const {
    std::ofstream stamps(folder / "sensor_data/stereo_stamp.csv");
    for (int i = 0; i < n_images; ++i) {
      stamps << image_stamp_ns(i) << '\n';
      const Image image = bayer_image(width_px, height_px, red(i), green(i), blue(i));
      const std::string name = std::to_string(image_stamp_ns(i)) + ".png";
      write_png(folder / "image/stereo_left" / name, image);
      write_png(folder / "image/stereo_right" / name, image);
    }
  }

  void write(const std::filesystem::path& folder) const {
    for (const char* sub :
         {"sensor_data", "calibration", "image/stereo_left", "image/stereo_right"}) {
      std::filesystem::create_directories(folder / sub);
    }
    write_encoders(folder);
    write_imu(folder);
    write_poses(folder);
    write_images(folder);
    std::ofstream(folder / "calibration/EncoderParameter.txt")
        << "Encoder calibrated parameter\nEncoder resolution: 4096\n"
        << "Encoder left wheel diameter: " << 2. * radius_left_m
        << "\nEncoder right wheel diameter: " << 2. * radius_right_m
        << "\nEncoder wheel base: " << baseline_m << '\n';
  }
};

}  // namespace viwo::kaist
