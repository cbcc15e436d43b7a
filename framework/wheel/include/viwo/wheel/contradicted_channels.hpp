// Channels that the others contradict (W-12) over a recording: now and then it is slip, for long it
// is a fault.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

struct ContradictedChannel {
  std::string name;          ///< "drive_2", "steer_1"
  double share = 0.;         ///< of the samples
  double longest_s = 0.;     ///< without a break
  std::int64_t from_ns = 0;  ///< begin of that
};

/// Those that are contradicted for half a second or in a fifth of the samples, which are in the
/// order of time, at the intrinsics x_WI of covariance P. `left`: the samples in which no channel
/// is.
std::vector<ContradictedChannel> contradicted_channels(std::span<const EncoderSample> samples,
                                                       std::shared_ptr<const WheelModel> model,
                                                       const Intrinsics& x_WI,
                                                       const IntrinsicMatrix& P,
                                                       std::vector<EncoderSample>* left = nullptr);

/// As a sentence, with times since `begin_ns`.
std::string text_of(const ContradictedChannel& channel, std::int64_t begin_ns);

}  // namespace viwo
