// Sensor ros_text_pose: reference poses from printed PoseStamped messages (model.md).
#include <array>

#include "viwo/api/plugin.hpp"
#include "viwo/log/ros_text.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{
    ParamSpec{.name = "path", .type = ParamType::kPath, .help = "the recording, plain or gzipped"},
    log::kClockParam, log::kReceptionUtcOffsetParam, log::kMaxGapParam,
    log::kMaxRejectedFractionParam};

class RosTextPose final : public log::RecordingSensor<PoseSample> {
 public:
  RosTextPose(const ParamSet& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_ros_poses(params.text("path"), log::clock_from(params),
                                            log::limits_from(params))) {}
};

VIWO_REGISTER(Sensor, RosTextPose, "ros_text_pose", "1.0.0",
              "reference poses from ROS PoseStamped messages printed as text", "Apache-2.0",
              kParams);

}  // namespace
}  // namespace viwo
