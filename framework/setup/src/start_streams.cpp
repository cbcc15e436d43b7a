#include "viwo/setup/start_streams.hpp"

#include <algorithm>

namespace viwo {

const SharedStream* tracks_of(std::span<const SharedStream> streams) {
  const auto is_tracks = [](const SharedStream& stream) {
    return stream.spec.type->has_name_of(sample_type<FeatureSample>());
  };
  const auto tracks = std::find_if(streams.begin(), streams.end(), is_tracks);
  return tracks == streams.end() ? nullptr : &*tracks;
}

std::vector<ExtraStream> start_streams(const FilterSetup& setup,
                                       std::span<const SharedStream> streams) {
  std::vector<ExtraStream> extra;
  if (setup.start.mode == StartMode::kReference) return extra;
  for (const WheelSet& set : setup.wheels) {
    StreamSpec spec;
    spec.type = &sample_type<EncoderSample>();
    spec.sensor = set.prior.sensor;
    spec.given = Given::kSinceOldestClone;
    spec.optional = setup.start.mode == StartMode::kStandstill;
    extra.push_back({spec, "estimator.start"});
  }
  if (const SharedStream* tracks = tracks_of(streams)) {
    StreamSpec spec;
    spec.type = &sample_type<FeatureSample>();
    spec.sensor = tracks->spec.sensor;
    spec.optional = true;  // the updates say whether they can do without
    extra.push_back({spec, "estimator.start"});
  }
  return extra;
}

}  // namespace viwo
