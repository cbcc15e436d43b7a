// Images that are nothing but the points in them, and what finds these.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "live_device.hpp"
#include "sensors_in_memory.hpp"
#include "viwo/run/run.hpp"

namespace viwo::testing {

/// A picture without pixels: what is behind it are the points of an image.
struct Points final : ImageSource {
  explicit Points(FeatureSample sample) : points(std::move(sample)) {}
  void read(Image& /*out*/) const override {}
  FeatureSample points;
};

/// Finds in a picture the points that are behind it.
class Tracker : public Sensor {
 public:
  SampleTypes yields() const override { return sample_types<FeatureSample>(); }
  bool takes_input() const override { return true; }
  void connect(Sensor& input) override { input_ = &input; }
  Status next(Measurement& out) override {
    Measurement in;
    while (input_->next(in) == Status::kOk) {
      const auto* image = in.get_if<ImageSample>();
      if (image == nullptr) continue;
      out = static_cast<const Points&>(*image->source).points;
      return Status::kOk;
    }
    return Status::kEnd;
  }

 private:
  Sensor* input_ = nullptr;
};

/// What a filter takes of a recorded run as one sensor would give it, with pictures in the place of
/// tracks.
inline std::vector<Measurement> with_pictures(const RunData& data) {
  std::vector<Measurement> all = in_time_order(data.recorded);
  for (Measurement& measurement : all) {
    const auto* image = measurement.get_if<FeatureSample>();
    if (image == nullptr) continue;
    measurement = ImageSample{image->t_ns, image->camera, std::make_shared<Points>(*image)};
  }
  return all;
}

/// The same of one that gives pictures, and of the sensor 'tracks' that works on them.
inline Routes routes_of_pictures(const RunSetup& setup) {
  return routes_for(setup, {{"device", sample_types<ImuSample, EncoderSample, ImageSample>()},
                            {"tracks", sample_types<FeatureSample>()}});
}

}  // namespace viwo::testing
