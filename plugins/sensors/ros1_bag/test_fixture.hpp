// Small ROS 1 bags, written by ROS's own messages and library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "ros1_writer.hpp"
#include "support.hpp"

namespace viwo {

namespace fs = std::filesystem;
using bag::Ros1Writer;
using ::testing::HasSubstr;

inline constexpr std::int64_t kStart = 1'700'000'000'123'456'789;  // a double would round it
inline constexpr std::int64_t kMs = 1'000'000;

class Ros1Bag : public testing::InFolder {
 protected:
  std::string file(const std::string& name = "a.bag") const { return (folder_ / name).string(); }

  std::string section(const std::string& rest, const std::string& name = "a.bag") const {
    return "{type: ros1_bag, path: " + file(name) + ", " + rest + "}";
  }

  /// Changes the bytes at the n-th place where `text` stands in the file.
  void patch(const std::string& text, int n, std::ptrdiff_t offset, const std::string& bytes,
             const std::string& name = "a.bag") const {
    std::string content = read(name);
    std::size_t at = content.find(text);
    for (; n > 1 && at != std::string::npos; --n) at = content.find(text, at + 1);
    ASSERT_NE(at, std::string::npos) << text;
    content.replace(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(at) + offset),
                    bytes.size(), bytes);
    std::ofstream(file(name), std::ios::binary) << content;
  }

  std::string read(const std::string& name = "a.bag") const { return testing::text_of(file(name)); }

  /// n samples of IMU at 5 ms and wheels at 10 ms, images of two cameras at 50 ms, poses at 20 ms.
  void write_drive(int n = 40, const std::string& compression = "none",
                   const std::string& name = "a.bag") const {
    const std::vector<std::string> joints{"steer_1", "drive_1", "arm", "drive_2"};
    Ros1Writer out(file(name), compression, 4096);
    for (int k = 0; k < n; ++k) {
      const std::int64_t t = kStart + 5 * k * kMs;
      const double x = 0.1 * k + 1. / 3.;
      out.write_imu("/imu0", {t, t + kMs}, {x, -x, 0.2}, {1., x, 9.81});
      if (k % 2 == 0) {
        out.write_joints("/joint_states", {t, t + kMs}, joints, {x, 0., 7., 0.},
                         {0., 3. + x, 7., 4. + x});
      }
      if (k % 4 == 0) out.write_pose("/truth", {t, t + kMs}, {x, 1., 2.}, {0., 0., 0.6, 0.8});
      if (k % 10 != 0) continue;
      out.write_image("/cam0/image_raw", {t, t + kMs}, grey(k));
      out.write_image("/cam1/image_raw", {t, t + kMs}, grey(k + 100));
    }
    out.close();
  }

  /// 3 x 2 pixels in rows of 4 bytes.
  static bag::RawImage grey(int k) {
    const auto v = static_cast<std::uint8_t>(k);
    return {3, 2, "mono8", false, 4, {v, 1, 2, 99, 3, 4, 5, 99}};
  }

  static Image read_image(const ImageSample& sample) {
    Image out;
    sample.source->read(out);
    return out;
  }

  static constexpr const char* kAll =
      "imu_topic: /imu0, image_topics: [/cam0/image_raw, /cam1/image_raw], joint_topic: "
      "/joint_states, drive_joints: [drive_1, drive_2], steer_joints: [steer_1], pose_topic: "
      "/truth";
};

}  // namespace viwo
