// Sensor ros_text_encoders: wheel encoders from printed JointState messages (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/log/ros_text.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::TextClockParams, log::StrideParams, log::JointParams, log::LimitParams {
  std::filesystem::path path;
  std::vector<std::string> drive;
  std::vector<std::string> steer;
  enum class Drive { kPosition, kVelocity };
  Drive drive_input = Drive::kPosition;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path), {.required = true, .help = "the recording, plain or gzipped"});
    b(VIWO_PARAM(drive),
      {.required = true, .help = "joints that drive, in the order of the wheels"});
    b(VIWO_PARAM(steer), {.help = "joints that steer, in the order of the wheels"});
    b(VIWO_PARAM(drive_input), {{"position", Drive::kPosition}, {"velocity", Drive::kVelocity}},
      {.help = "drive rates from differences of positions, or from velocities"});
    log::TextClockParams::bind(b);
    log::StrideParams::bind(b);
    log::JointParams::bind(b);
    log::LimitParams::bind(b);
  }

  log::RosEncoderOptions options() const {
    const bool is_angle = drive_input == Drive::kPosition;
    check_stride(is_angle, "position");
    return {{limits(), is_angle, stride, joints()}, ros_clock(), drive, steer};
  }
};

class RosTextEncoders final : public log::RecordingSensor<EncoderSample> {
 public:
  RosTextEncoders(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_ros_encoders(params.path, params.options())) {}
};

VIWO_REGISTER(Sensor, RosTextEncoders, "ros_text_encoders", "1.0.0",
              "wheel encoders from ROS JointState messages printed as text", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
