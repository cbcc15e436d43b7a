// Writes ROS 2 bags in MCAP, without ROS 2.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bag_writer.hpp"
#include "mcap_writer.hpp"

namespace viwo::bag {

class CdrMessage;

/// Stamps from 0 to 2147483647.999999999 s.
class Ros2Writer final : public BagWriter {
 public:
  explicit Ros2Writer(const std::string& file,
                      mcap::Compression compression = mcap::Compression::kZstd,
                      std::size_t chunk_bytes = mcap::Writer::kChunkBytes);

  void write_imu(const std::string& topic, const Stamps& stamps,
                 const std::array<double, 3>& gyro_rad_per_s,
                 const std::array<double, 3>& accel_m_per_s2) override;
  void write_joints(const std::string& topic, const Stamps& stamps,
                    const std::vector<std::string>& names, const std::vector<double>& positions,
                    const std::vector<double>& velocities) override;
  void write_pose(const std::string& topic, const Stamps& stamps, const std::array<double, 3>& p,
                  const std::array<double, 4>& q_xyzw) override;
  void write_fix(const std::string& topic, const Stamps& stamps, const RawFix& fix) override;
  void write_image(const std::string& topic, const Stamps& stamps, const RawImage& image) override;
  void close() override { out_.close(); }

  /// metadata.yaml beside the file, which makes its folder a bag of rosbag2. After close().
  void write_metadata() const;

 private:
  struct Topic {
    std::string name, type;
    std::uint16_t channel;
  };

  void write(const std::string& topic, const std::string& type, const Stamps& stamps,
             CdrMessage& message);
  void check(const Stamps& stamps) const;

  std::filesystem::path file_;
  mcap::Writer out_;
  std::vector<Topic> topics_;
};

}  // namespace viwo::bag
