// The encoder samples of a wheel set as the wheel updates take them.
#pragma once

#include "viwo/api/update.hpp"

namespace viwo {

/// The stream of the sensor of the wheel set that an instance is for: since the oldest clone, as
/// late samples belong to intervals that began epochs ago; an epoch waits for them.
inline StreamId declare_encoders(Declarations& host, const WheelsBlocks& blocks) {
  return host.stream({.type = &sample_type<EncoderSample>(),
                      .sensor = host.rig().wheels().sensor,
                      .given = Given::kSinceOldestClone,
                      .awaited = true,
                      .clocks = {{0., blocks.clock}}});
}

/// Whether a sample has the channels that a kinematic model needs: those of a run do, as far as the
/// first one tells.
inline bool has_channels(const ModelDescription& model, const EncoderSample& sample) {
  return sample.n_drive == model.n_drive && (model.n_steer == 0 || sample.n_steer == model.n_steer);
}

}  // namespace viwo
