// Drives of a stereo pair through the rendered room, and the sensor as the host loads it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "message_of.hpp"
#include "rejections.hpp"
#include "support.hpp"
#include "test_scene.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo::klt {

inline constexpr std::int64_t kPeriodNs = 100'000'000;
inline constexpr std::int64_t kStartNs = 5'000'000'000;
inline constexpr std::int64_t kShiftNs = 4'000'000;  ///< timeshift_cam_imu of cam0

/// What a log or a simulator would give.
class FakeInput final : public Sensor {
 public:
  explicit FakeInput(std::vector<Measurement> measurements)
      : measurements_(std::move(measurements)) {}
  SampleTypes yields() const override { return sample_types<ImageSample, ImuSample>(); }
  Status next(Measurement& out) override {
    if (next_ == measurements_.size()) return Status::kEnd;
    out = measurements_[next_++];
    return Status::kOk;
  }
  std::size_t taken() const { return next_; }

 private:
  std::vector<Measurement> measurements_;
  std::size_t next_ = 0;
};

class BrokenImage final : public ImageSource {
 public:
  void read(Image&) const override { throw InputError("b.png: the image is cut short"); }
};

inline CameraPose pose_at(double t) {
  CameraPose pose;
  pose.R_CtoW = exp_so3(Eigen::Vector3d(0.02 * std::sin(3. * t), 0.25 * std::sin(1.6 * t), 0.));
  pose.p_CinW = Eigen::Vector3d(0.5 * std::sin(t), 0.3, 0.6 * std::sin(0.7 * t));
  return pose;
}

inline std::int64_t stamp_of(int image) { return kStartNs + image * kPeriodNs; }

/// The room, and what a pair of cameras sees of it.
struct Rig {
  std::vector<CameraView> cameras = fisheye_pair(0.5);
  Room room;
  Renderer left{cameras[0], room};
  Renderer right{cameras[1], room};

  CameraPose pose(int image, int camera) const {
    const CameraPose left_pose = pose_at(1e-9 * static_cast<double>(image * kPeriodNs));
    return camera == 0 ? left_pose : pose_of(cameras[1], left_pose);
  }
  Image render(int image, int camera, const std::optional<Mover>& mover = {}) const {
    return (camera == 0 ? left : right)
        .render(pose(image, camera), 1.5, static_cast<std::uint64_t>(2 * image + camera), mover);
  }
};

inline const Rig& rig() {
  static const Rig the_rig;
  return the_rig;
}

inline ImageSample sample_of(Image image, int camera, std::int64_t t_ns) {
  return {t_ns, camera, std::make_shared<ImageInMemory>(std::move(image))};
}

/// `n` images of the first `n_cameras` cameras.
inline std::vector<Measurement> drive(int n, int n_cameras) {
  std::vector<Measurement> out;
  for (int i = 0; i < n; ++i) {
    for (int camera = 0; camera < n_cameras; ++camera) {
      out.emplace_back(sample_of(rig().render(i, camera), camera, stamp_of(i)));
    }
  }
  return out;
}

inline std::filesystem::path temporary(const std::string& name) {
  return std::filesystem::temp_directory_path() /
         ("viwo_klt_" + std::to_string(getpid()) + "_" + name);
}

/// A Kalibr file of the rig; cameras 2 and 3 are another such pair.
inline std::string chain_file(int n_cameras = 2, double second_shift_s = 0.0045) {
  std::ostringstream text;
  for (int i = 0; i < n_cameras; ++i) {
    const CameraView& camera = rig().cameras[static_cast<std::size_t>(i % 2)];
    const auto list = [&](int from) {
      std::ostringstream out;
      out.precision(17);
      for (int k = from; k < from + 4; ++k) out << (k > from ? ", " : "") << camera.intrinsics[k];
      return out.str();
    };
    text << "cam" << i << ":\n  camera_model: pinhole\n  intrinsics: [" << list(0)
         << "]\n  distortion_model: equidistant\n  distortion_coeffs: [" << list(4)
         << "]\n  resolution: [" << camera.width_px << ", " << camera.height_px
         << "]\n  T_cam_imu:\n    - [1.0, 0.0, 0.0, " << camera.p_IinC.x()
         << "]\n    - [0.0, 1.0, 0.0, 0.0]\n    - [0.0, 0.0, 1.0, 0.0]\n"
         << "    - [0.0, 0.0, 0.0, 1.0]\n  timeshift_cam_imu: "
         << (i == 0 ? 1e-9 * static_cast<double>(kShiftNs) : second_shift_s) << "\n";
  }
  const std::filesystem::path file = temporary("chain.yaml");
  std::ofstream(file) << text.str();
  return file.string();
}

inline std::string section(const std::string& parameters = {}, int n_cameras = 2) {
  return "type: klt_tracker\ncameras: " + chain_file(n_cameras) + "\n" + parameters;
}

struct Played {
  std::vector<FeatureSample> samples;
  std::map<std::string, RejectionCount> rejections;

  std::vector<FeatureSample> of(int camera) const {
    std::vector<FeatureSample> out;
    std::copy_if(samples.begin(), samples.end(), std::back_inserter(out),
                 [&](const FeatureSample& sample) { return sample.camera == camera; });
    return out;
  }
};

inline Played track(std::vector<Measurement> measurements, const std::string& yaml,
                    bool is_set_back = false) {
  FakeInput input(std::move(measurements));
  const auto sensor = make_sensor(yaml);
  EXPECT_TRUE(sensor->takes_input());
  sensor->connect(input);
  Played played;
  played.samples = only<FeatureSample>(play(*sensor, is_set_back));
  for (const RejectionCount& rejection : testing::all_rejections(*sensor)) {
    played.rejections[rejection.reason] = rejection;
  }
  return played;
}

inline std::string failure_of(std::vector<Measurement> measurements, const std::string& yaml) {
  return testing::error_of([&] { track(std::move(measurements), yaml); });
}

inline std::set<std::int64_t> ids_of(const FeatureSample& sample) {
  std::set<std::int64_t> ids;
  for (const FeaturePoint& point : sample.points) ids.insert(point.id);
  EXPECT_EQ(ids.size(), sample.points.size());
  return ids;
}

inline std::size_t common(const FeatureSample& a, const FeatureSample& b) {
  const auto ids = ids_of(a);
  return static_cast<std::size_t>(
      std::count_if(b.points.begin(), b.points.end(),
                    [&](const FeaturePoint& point) { return ids.contains(point.id); }));
}

}  // namespace viwo::klt
