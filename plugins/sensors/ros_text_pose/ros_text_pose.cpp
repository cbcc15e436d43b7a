// Sensor ros_text_pose: reference poses from printed PoseStamped messages (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/log/ros_text.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::TextClockParams, log::LimitParams {
  std::filesystem::path path;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path), {.required = true, .help = "the recording, plain or gzipped"});
    log::TextClockParams::bind(b);
    log::LimitParams::bind(b);
  }
};

class RosTextPose final : public log::RecordingSensor<PoseSample> {
 public:
  RosTextPose(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_ros_poses(params.path, params.ros_clock(), params.limits())) {}
};

VIWO_REGISTER(Sensor, RosTextPose, "ros_text_pose", "1.0.0",
              "reference poses from ROS PoseStamped messages printed as text", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
