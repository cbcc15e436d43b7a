// Sensor ros2_bag: IMU, images, wheels and poses of a ROS 2 bag (model.md).
#include <array>

#include "bag_sensor.hpp"
#include "ros2_file.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

constexpr std::array kFileParams{
    ParamSpec{.name = "path",
              .type = ParamType::kPath,
              .help = "the folder of a bag, with metadata.yaml, or its .db3"}};
constexpr auto kParams = log::joined(kFileParams, bag::kBagParams);

class Ros2Bag final : public bag::BagSensor {
 public:
  Ros2Bag(const ParamSet& params, const HostServices& /*services*/)
      : BagSensor(bag::open_ros2(params.text("path")), bag::options_from(params)) {}
};

VIWO_REGISTER(Sensor, Ros2Bag, "ros2_bag", "1.0.0",
              "IMU, images, wheels and poses of a ROS 2 bag (SQLite)", "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
