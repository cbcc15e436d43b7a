#include "ros2_writer.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include <yaml-cpp/yaml.h>

#include "cdr_message.hpp"
#include "ros2_definitions.hpp"
#include "viwo/files/files.hpp"

namespace viwo::bag {

Ros2Writer::Ros2Writer(const std::string& file, mcap::Compression compression,
                       std::size_t chunk_bytes)
    : file_(file), out_(file, compression, chunk_bytes) {}

void Ros2Writer::check(const Stamps& stamps) const {
  constexpr std::int64_t kEnd = (std::int64_t{1} << 31) * 1'000'000'000;
  for (const std::int64_t t_ns : {stamps.header_ns, stamps.received_ns}) {
    if (t_ns >= 0 && t_ns < kEnd) continue;
    throw std::runtime_error(file_.string() + "  cannot be written: ROS 2 has no time for the " +
                             "stamp " + std::to_string(t_ns) + " ns");
  }
}

void Ros2Writer::write(const std::string& topic, const std::string& type, const Stamps& stamps,
                       CdrMessage& message) {
  auto known = std::find_if(topics_.begin(), topics_.end(),
                            [&topic](const Topic& one) { return one.name == topic; });
  if (known == topics_.end()) {
    topics_.push_back({topic, type, out_.add_channel(topic, type, ros2_definition(type))});
    known = std::prev(topics_.end());
  }
  out_.write(known->channel, stamps.received_ns, stamps.header_ns, message.bytes());
}

void Ros2Writer::write_imu(const std::string& topic, const Stamps& stamps,
                           const std::array<double, 3>& gyro_rad_per_s,
                           const std::array<double, 3>& accel_m_per_s2) {
  check(stamps);
  std::array<double, 9> no_orientation{}, unknown{};
  no_orientation[0] = -1.;
  CdrMessage message;
  message.header(stamps.header_ns, "imu") << std::array{0., 0., 0., 1.} << no_orientation
                                          << gyro_rad_per_s << unknown << accel_m_per_s2 << unknown;
  write(topic, "sensor_msgs/msg/Imu", stamps, message);
}

void Ros2Writer::write_joints(const std::string& topic, const Stamps& stamps,
                              const std::vector<std::string>& names,
                              const std::vector<double>& positions,
                              const std::vector<double>& velocities) {
  check(stamps);
  CdrMessage message;
  message.header(stamps.header_ns, "") << names << positions << velocities << std::vector<double>{};
  write(topic, "sensor_msgs/msg/JointState", stamps, message);
}

void Ros2Writer::write_pose(const std::string& topic, const Stamps& stamps,
                            const std::array<double, 3>& p, const std::array<double, 4>& q_xyzw) {
  check(stamps);
  CdrMessage message;
  message.header(stamps.header_ns, "world") << p << q_xyzw;
  write(topic, "geometry_msgs/msg/PoseStamped", stamps, message);
}

void Ros2Writer::write_fix(const std::string& topic, const Stamps& stamps, const RawFix& fix) {
  check(stamps);
  constexpr std::uint16_t kGps = 1;
  CdrMessage message;
  message.header(stamps.header_ns, "gps")
      << static_cast<std::int8_t>(fix.status) << kGps << fix.latitude_deg << fix.longitude_deg
      << fix.altitude_m << fix.covariance_m2 << static_cast<std::uint8_t>(fix.covariance_type);
  write(topic, "sensor_msgs/msg/NavSatFix", stamps, message);
}

void Ros2Writer::write_image(const std::string& topic, const Stamps& stamps,
                             const RawImage& image) {
  check(stamps);
  CdrMessage message;
  message.header(stamps.header_ns, topic)
      << image.height_px << image.width_px << image.encoding
      << static_cast<std::uint8_t>(image.big_endian) << image.row_bytes << image.pixels;
  write(topic, "sensor_msgs/msg/Image", stamps, message);
}

void Ros2Writer::write_metadata() const {
  const auto times = [this](YAML::Emitter& out) {
    out << YAML::Key << "duration" << YAML::BeginMap << YAML::Key << "nanoseconds"
        << out_.end_ns() - out_.begin_ns() << YAML::EndMap;
    out << YAML::Key << "starting_time" << YAML::BeginMap << YAML::Key << "nanoseconds_since_epoch"
        << out_.begin_ns() << YAML::EndMap;
  };
  std::uint64_t n = 0;
  for (const auto& [channel, count] : out_.counts()) n += count;
  const std::string name = file_.filename().string();
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "rosbag2_bagfile_information" << YAML::BeginMap;
  out << YAML::Key << "version" << 5 << YAML::Key << "storage_identifier"
      << "mcap";
  times(out);
  out << YAML::Key << "message_count" << n;
  out << YAML::Key << "topics_with_message_count" << YAML::BeginSeq;
  for (const Topic& topic : topics_) {
    out << YAML::BeginMap << YAML::Key << "topic_metadata" << YAML::BeginMap;
    out << YAML::Key << "name" << topic.name << YAML::Key << "type" << topic.type;
    out << YAML::Key << "serialization_format"
        << "cdr";
    out << YAML::Key << "offered_qos_profiles" << YAML::DoubleQuoted << "" << YAML::EndMap;
    out << YAML::Key << "message_count" << out_.counts().at(topic.channel) << YAML::EndMap;
  }
  out << YAML::EndSeq;
  for (const char* key : {"compression_format", "compression_mode"}) {
    out << YAML::Key << key << YAML::DoubleQuoted << "";
  }
  out << YAML::Key << "relative_file_paths" << YAML::BeginSeq << name << YAML::EndSeq;
  out << YAML::Key << "files" << YAML::BeginSeq << YAML::BeginMap << YAML::Key << "path" << name;
  times(out);
  out << YAML::Key << "message_count" << n << YAML::EndMap << YAML::EndSeq;
  out << YAML::EndMap << YAML::EndMap;
  files::write_text(file_.parent_path() / "metadata.yaml", std::string(out.c_str()) + "\n");
}

}  // namespace viwo::bag
