// The image simulator as the host loads it, on states of a test.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "message_of.hpp"
#include "support.hpp"

namespace viwo {

inline const std::string kCameraFile =
    std::string(VIWO_TEST_SOURCE_DIR) + "/configs/cameras/t265_like.yaml";

/// Small textures: quick to make.
inline std::string section(const std::string& rest, const std::string& cameras = kCameraFile) {
  return "{type: image_simulator, cameras: " + cameras + ", texture_size_px: 256, boxes: 10" +
         (rest.empty() ? "" : ", " + rest) + "}";
}

/// Gives what it was made with.
class GivenStates final : public Sensor {
 public:
  explicit GivenStates(std::vector<Measurement> all) : all_(all.begin(), all.end()) {}
  SampleTypes yields() const override { return sample_types<StateSample, ImuSample>(); }
  Status next(Measurement& out) override {
    if (all_.empty()) return Status::kEnd;
    out = all_.front();
    all_.pop_front();
    return Status::kOk;
  }

 private:
  std::deque<Measurement> all_;
};

/// True states of a robot that turns while it drives, n of them 0.1 s apart.
inline std::vector<Measurement> states(int n) {
  std::vector<Measurement> out;
  for (int i = 0; i < n; ++i) {
    StateSample state;
    state.t_ns = 2'000'000'000 + i * std::int64_t{100'000'000};
    state.p_IinG_m = {0.1 * i, 0.03 * i, 0.15};
    const Eigen::Quaterniond q = Eigen::AngleAxisd(0.05 * i, Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(0.02 * i, Eigen::Vector3d::UnitX());
    state.q_ItoG_xyzw = {q.x(), q.y(), q.z(), q.w()};
    out.emplace_back(ImuSample{state.t_ns, {}, {}});
    out.emplace_back(state);
  }
  return out;
}

inline std::vector<Measurement> play_on(const std::shared_ptr<Sensor>& sensor,
                                        std::vector<Measurement> input) {
  EXPECT_TRUE(sensor->takes_input());
  GivenStates given(std::move(input));
  sensor->connect(given);
  return play(*sensor);
}

inline std::vector<ImageSample> images(const std::string& yaml, std::vector<Measurement> input,
                                       std::uint64_t seed = 1) {
  return only<ImageSample>(play_on(make_sensor(yaml, seed), std::move(input)));
}

inline std::string refusal(const std::string& yaml, const std::vector<Measurement>& input) {
  return testing::error_of([&] { images(yaml, input); });
}

inline Image pixels_of(const ImageSample& sample) {
  Image out;
  sample.source->read(out);
  return out;
}

inline double mean_of(const Image& image) {
  double sum = 0.;
  for (const std::uint8_t value : image.pixels) sum += static_cast<double>(value);
  return sum / static_cast<double>(image.pixels.size());
}

/// Pixels that differ by more than one grey level.
inline int different_pixels(const Image& a, const Image& b) {
  int out = a.pixels.size() == b.pixels.size() ? 0 : 1'000'000;
  for (std::size_t k = 0; k < a.pixels.size() && out < 1'000'000; ++k) {
    out += std::abs(static_cast<int>(a.pixels[k]) - b.pixels[k]) > 1 ? 1 : 0;
  }
  return out;
}

}  // namespace viwo
