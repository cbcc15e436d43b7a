// Writes ROS 1 bags, with the messages of ROS itself. C++17: the messages of ROS 1 do not compile
// as C++20, so nothing of viwo is included here.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bag_writer.hpp"

namespace viwo::bag {

/// Everything that fails is a std::runtime_error "file  cannot be written: why".
class Ros1Writer final : public BagWriter {
 public:
  /// `compression`: "none", "bz2" or "lz4"; chunks hold at least `chunk_bytes`.
  explicit Ros1Writer(const std::string& file, const std::string& compression = "none",
                      std::uint32_t chunk_bytes = 768 * 1024);
  ~Ros1Writer() override;
  Ros1Writer(const Ros1Writer&) = delete;
  Ros1Writer& operator=(const Ros1Writer&) = delete;

  void write_imu(const std::string& topic, const Stamps& stamps,
                 const std::array<double, 3>& gyro_rad_per_s,
                 const std::array<double, 3>& accel_m_per_s2) override;
  void write_joints(const std::string& topic, const Stamps& stamps,
                    const std::vector<std::string>& names, const std::vector<double>& positions,
                    const std::vector<double>& velocities) override;
  void write_pose(const std::string& topic, const Stamps& stamps, const std::array<double, 3>& p,
                  const std::array<double, 4>& q_xyzw) override;
  void write_pose_with_covariance(const std::string& topic, const Stamps& stamps,
                                  const std::array<double, 3>& p,
                                  const std::array<double, 4>& q_xyzw);
  void write_odometry(const std::string& topic, const Stamps& stamps,
                      const std::array<double, 3>& p, const std::array<double, 4>& q_xyzw,
                      double v_x = 0., double omega_z = 0.);
  void write_fix(const std::string& topic, const Stamps& stamps, const RawFix& fix) override;
  void write_image(const std::string& topic, const Stamps& stamps, const RawImage& image) override;
  void write_compressed_image(const std::string& topic, const Stamps& stamps,
                              const std::string& format, const std::vector<std::uint8_t>& bytes);
  void close() override;

 private:
  struct Bag;

  template <class M>
  void write(const std::string& topic, const Stamps& stamps, M& message);
  [[noreturn]] void fail(const std::string& why);

  std::string file_;
  std::unique_ptr<Bag> bag_;
};

}  // namespace viwo::bag
