// Sensor ros_text_encoders: wheel encoders from printed JointState messages (model.md).
#include <array>

#include "viwo/api/plugin.hpp"
#include "viwo/log/ros_text.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{
    ParamSpec{.name = "path", .type = ParamType::kPath, .help = "the recording, plain or gzipped"},
    ParamSpec{.name = "drive",
              .type = ParamType::kStrings,
              .help = "joints that drive, in the order of the wheels"},
    ParamSpec{.name = "steer",
              .type = ParamType::kStrings,
              .fallback = "[]",
              .help = "joints that steer, in the order of the wheels"},
    ParamSpec{.name = "drive_input",
              .type = ParamType::kString,
              .fallback = "position",
              .choices = "position|velocity",
              .help = "drive rates from differences of positions, or from velocities"},
    log::kClockParam,
    log::kReceptionUtcOffsetParam,
    log::kStrideParam,
    log::kMaxGapParam,
    log::kMaxRejectedFractionParam};

log::RosEncoderOptions options_from(const ParamSet& params) {
  const auto drive = params.texts("drive");
  const auto steer = params.texts("steer");
  return {log::encoder_options_from(params, "position"),
          log::clock_from(params),
          {drive.begin(), drive.end()},
          {steer.begin(), steer.end()}};
}

class RosTextEncoders final : public log::RecordingSensor<EncoderSample> {
 public:
  RosTextEncoders(const ParamSet& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_ros_encoders(params.text("path"), options_from(params))) {}
};

VIWO_REGISTER(Sensor, RosTextEncoders, "ros_text_encoders", "1.0.0",
              "wheel encoders from ROS JointState messages printed as text", "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
