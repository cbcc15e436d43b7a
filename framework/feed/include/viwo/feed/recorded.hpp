// What sensors gave, by sensor and kind.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/sample.hpp"

namespace viwo {

/// Samples in the order in which they came. Copies share what is in them.
class Recorded {
 public:
  struct Track {
    std::string sensor;
    std::shared_ptr<SampleBuffer> samples;
  };

  void add(const std::string& sensor, SampleView sample);
  /// Replaces what a sensor gave of a kind.
  template <Sample T>
  void set(const std::string& sensor, const std::vector<T>& samples);

  std::span<const Track> tracks() const { return tracks_; }
  /// nullptr when the sensor gave none. "": the first sensor that gave some.
  const SampleBuffer* find(std::string_view sensor, const SampleType& type) const;
  template <Sample T>
  std::span<const T> of(std::string_view sensor = {}) const {
    const auto* typed = static_cast<const TypedBuffer<T>*>(find(sensor, sample_type<T>()));
    return typed != nullptr ? typed->samples() : std::span<const T>();
  }

 private:
  std::vector<Track> tracks_;
};

template <Sample T>
void Recorded::set(const std::string& sensor, const std::vector<T>& samples) {
  std::erase_if(tracks_, [&](const Track& track) {
    return track.sensor == sensor && track.samples->type() == sample_type<T>();
  });
  for (const T& sample : samples) add(sensor, sample);
}

}  // namespace viwo
