// Sensor ros2_bag: IMU, images, wheels and poses of a ROS 2 bag (model.md).

#include "bag_sensor.hpp"
#include "ros2_file.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

struct Params : bag::BagOptions {
  std::filesystem::path path;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path),
      {.required = true, .help = "the folder of a bag, with metadata.yaml, or its .mcap or .db3"});
    bag::BagOptions::bind(b);
  }
};

class Ros2Bag final : public bag::BagSensor {
 public:
  Ros2Bag(const Params& params, const HostServices& /*services*/)
      : BagSensor(bag::open_ros2(params.path), params.checked()) {}
};

VIWO_REGISTER(Sensor, Ros2Bag, "ros2_bag", "1.0.0",
              "IMU, images, wheels and poses of a ROS 2 bag (MCAP or SQLite)", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
