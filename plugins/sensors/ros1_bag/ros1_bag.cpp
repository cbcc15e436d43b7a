// Sensor ros1_bag: IMU, images, wheels and poses of a ROS 1 bag (model.md).
#include <string>
#include <vector>

#include "bag_sensor.hpp"
#include "ros1_file.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

struct Params : bag::BagOptions {
  std::filesystem::path path;
  std::vector<std::string> paths;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path), {.required = true, .help = "a bag, or a folder of bags"});
    b(VIWO_PARAM(paths),
      {.help = "of a folder, the bags to play one after the other; empty: all of them"});
    bag::BagOptions::bind(b);
  }
};

class Ros1Bag final : public bag::BagSensor {
 public:
  Ros1Bag(const Params& params, const HostServices& /*services*/)
      : BagSensor(open(params), params.checked()) {}

 private:
  static std::shared_ptr<const bag::Bag> open(const Params& params) {
    return bag::open_ros1(params.path, params.paths);
  }
};

VIWO_REGISTER(Sensor, Ros1Bag, "ros1_bag", "1.0.0", "IMU, images, wheels and poses of a ROS 1 bag",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
