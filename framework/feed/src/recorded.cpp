#include "viwo/feed/recorded.hpp"

namespace viwo {

void Recorded::add(const std::string& sensor, SampleView sample) {
  for (Track& track : tracks_) {
    if (track.sensor != sensor || !(track.samples->type() == sample.type())) continue;
    track.samples->push(sample.data());
    return;
  }
  tracks_.push_back({sensor, sample.type().make_buffer()});
  tracks_.back().samples->push(sample.data());
}

const SampleBuffer* Recorded::find(std::string_view sensor, const SampleType& type) const {
  for (const Track& track : tracks_) {
    if (!sensor.empty() && track.sensor != sensor) continue;
    if (track.samples->type() == type) return track.samples.get();
  }
  return nullptr;
}

}  // namespace viwo
