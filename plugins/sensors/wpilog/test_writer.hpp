// Small WPILOG files, written from the specification.
#pragma once

#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace viwo::wpilog {

/// The least significant byte first.
inline std::string bytes_of(std::uint64_t value, std::size_t size) {
  std::string out;
  for (std::size_t i = 0; i < size; ++i, value >>= 8) out += static_cast<char>(value & 0xff);
  return out;
}
inline std::string number(double value) { return bytes_of(std::bit_cast<std::uint64_t>(value), 8); }
inline std::string numbers(const std::vector<double>& values) {
  std::string out;
  for (const double value : values) out += number(value);
  return out;
}
inline std::string text(const std::string& text) { return bytes_of(text.size(), 4) + text; }

class Writer {
 public:
  explicit Writer(const std::string& extra = "") {
    bytes = "WPILOG" + bytes_of(0x0100, 2) + text(extra);
  }

  /// Fields of the least lengths, or all of the greatest.
  void record(std::uint32_t id, std::int64_t t_us, const std::string& payload, bool wide = false) {
    const auto length = [wide](std::uint64_t value, std::size_t most) {
      std::size_t n = 1;
      while (n < most && (wide || value >> (8 * n) != 0)) ++n;
      return n;
    };
    const auto stamp = static_cast<std::uint64_t>(t_us);
    const std::size_t a = length(id, 4), b = length(payload.size(), 4), c = length(stamp, 8);
    bytes += static_cast<char>((a - 1) | (b - 1) << 2 | (c - 1) << 4);
    bytes += bytes_of(id, a) + bytes_of(payload.size(), b) + bytes_of(stamp, c) + payload;
  }
  void start(std::uint32_t id, const std::string& name, const std::string& type) {
    record(0, 0, std::string(1, '\0') + bytes_of(id, 4) + text(name) + text(type) + text(""));
  }
  void finish(std::uint32_t id) { record(0, 0, std::string(1, '\1') + bytes_of(id, 4)); }
  void set_metadata(std::uint32_t id, const std::string& json) {
    record(0, 0, std::string(1, '\2') + bytes_of(id, 4) + text(json));
  }

  /// A record of an entry, which is started where it is new.
  void add(const std::string& name, const std::string& type, std::int64_t t_us,
           const std::string& payload) {
    const auto [known, is_new] = ids_.try_emplace(name, 1 + ids_.size());
    if (is_new) start(known->second, name, type);
    record(known->second, t_us, payload);
  }
  void schema(const std::string& name, const std::string& text) {
    add("/.schema/struct:" + name, "structschema", 0, text);
  }
  /// Those of WPILib.
  void geometry() {
    schema("Rotation2d", "double value");
    schema("Translation2d", "double x;double y");
    schema("Pose2d", "Translation2d translation;Rotation2d rotation");
    schema("Quaternion", "double w;double x;double y;double z");
    schema("Rotation3d", "Quaternion q");
    schema("Translation3d", "double x;double y;double z");
    schema("Pose3d", "Translation3d translation;Rotation3d rotation");
    schema("SwerveModuleState", "double speed;Rotation2d angle");
    schema("SwerveModulePosition", "double distance;Rotation2d angle");
  }

  std::string bytes;

 private:
  std::map<std::string, std::uint32_t> ids_;
};

}  // namespace viwo::wpilog
