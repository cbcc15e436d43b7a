// Sensor ros1_bag: IMU, images, wheels and poses of a ROS 1 bag (model.md).
#include <array>
#include <string>
#include <vector>

#include "bag_sensor.hpp"
#include "ros1_file.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

constexpr std::array kFileParams{
    ParamSpec{.name = "path", .type = ParamType::kPath, .help = "a bag, or a folder of bags"},
    ParamSpec{.name = "paths",
              .type = ParamType::kStrings,
              .fallback = "[]",
              .help = "of a folder, the bags to play one after the other; empty: all of them"}};
constexpr auto kParams = log::joined(kFileParams, bag::kBagParams);

class Ros1Bag final : public bag::BagSensor {
 public:
  Ros1Bag(const ParamSet& params, const HostServices& /*services*/)
      : BagSensor(open(params), bag::options_from(params)) {}

 private:
  static std::shared_ptr<const bag::Bag> open(const ParamSet& params) {
    const auto names = params.texts("paths");
    return bag::open_ros1(params.text("path"), {names.begin(), names.end()});
  }
};

VIWO_REGISTER(Sensor, Ros1Bag, "ros1_bag", "1.0.0", "IMU, images, wheels and poses of a ROS 1 bag",
              "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
