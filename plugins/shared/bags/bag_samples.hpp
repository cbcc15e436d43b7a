// From the topics of a bag to the samples of a sensor.
#pragma once

#include <memory>
#include <vector>

#include "bag.hpp"
#include "bag_options.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/api/sensor.hpp"

namespace viwo::bag {

/// Each kind in time order.
struct BagSamples {
  std::vector<PoseSample> poses;
  std::vector<ImuSample> imu;
  std::vector<EncoderSample> wheels;
  std::vector<GnssSample> fixes;
  std::vector<ImageSample> images;  ///< whose sources keep the bag
  std::vector<RejectionCount> rejections;
};

/// Reads all that is wanted, of images only what stands before the pixels. ParamError for a topic
/// or a joint that the bag does not have, InputError for what is wrong with the bag.
BagSamples read_samples(const std::shared_ptr<const Bag>& bag, const BagOptions& options);

}  // namespace viwo::bag
