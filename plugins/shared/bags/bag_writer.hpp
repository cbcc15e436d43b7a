// What writes a bag, of either ROS. C++17, and nothing of viwo: the messages of ROS 1 do not
// compile as C++20.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace viwo::bag {

/// Of a message: in its header, and of its recording. From 0 s on: up to 4294967295.999999999 s in
/// ROS 1, half of that in ROS 2.
struct Stamps {
  std::int64_t header_ns = 0;
  std::int64_t received_ns = 0;
};

/// Fields of a sensor_msgs/Image.
struct RawImage {
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  std::string encoding;
  bool big_endian = false;
  std::uint32_t row_bytes = 0;
  std::vector<std::uint8_t> pixels;
};

/// Fields of a sensor_msgs/NavSatFix.
struct RawFix {
  int status = 0;  ///< -1: no fix
  double latitude_deg = 0.;
  double longitude_deg = 0.;
  double altitude_m = 0.;
  std::array<double, 9> covariance_m2{};
  int covariance_type = 0;  ///< 0 unknown, 1 approximated, 2 diagonal known, 3 known
};

/// Everything that fails is a std::runtime_error "file  cannot be written: why". Messages are
/// written in the order of their reception.
class BagWriter {
 public:
  virtual ~BagWriter() = default;

  virtual void write_imu(const std::string& topic, const Stamps& stamps,
                         const std::array<double, 3>& gyro_rad_per_s,
                         const std::array<double, 3>& accel_m_per_s2) = 0;
  virtual void write_joints(const std::string& topic, const Stamps& stamps,
                            const std::vector<std::string>& names,
                            const std::vector<double>& positions,
                            const std::vector<double>& velocities) = 0;
  virtual void write_pose(const std::string& topic, const Stamps& stamps,
                          const std::array<double, 3>& p, const std::array<double, 4>& q_xyzw) = 0;
  virtual void write_fix(const std::string& topic, const Stamps& stamps, const RawFix& fix) = 0;
  virtual void write_image(const std::string& topic, const Stamps& stamps,
                           const RawImage& image) = 0;
  /// Must be called: the last bytes may fail, too.
  virtual void close() = 0;
};

}  // namespace viwo::bag
