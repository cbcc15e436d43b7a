// A sensor that plays a bag.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "bag.hpp"
#include "bag_options.hpp"
#include "bag_samples.hpp"
#include "viwo/api/sensor.hpp"

namespace viwo::bag {

class BagSensor : public Sensor {
 public:
  SampleTypes yields() const final { return yields_; }
  /// The earliest; of one time in the order poses, IMU, wheels, fixes, images.
  Status next(Measurement& out) final;
  void rejections(std::vector<RejectionCount>& out) const final;

 protected:
  BagSensor(const std::shared_ptr<const Bag>& bag, const BagOptions& options)
      : yields_(kinds_of(options)), samples_(read_samples(bag, options)) {}

 private:
  SampleTypes yields_;
  BagSamples samples_;
  std::size_t next_pose_ = 0;
  std::size_t next_imu_ = 0;
  std::size_t next_wheel_ = 0;
  std::size_t next_fix_ = 0;
  std::size_t next_image_ = 0;
};

}  // namespace viwo::bag
