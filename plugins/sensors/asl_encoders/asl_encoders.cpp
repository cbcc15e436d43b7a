// Sensor asl_encoders: wheel encoders from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::StrideParams, log::JointParams, log::LimitParams {
  std::filesystem::path path;
  enum class Drive { kRate, kAngle };
  Drive drive_input = Drive::kRate;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path),
      {.required = true, .help = "the encoder table, or the folder of its data.csv"});
    b(VIWO_PARAM(drive_input), {{"rate", Drive::kRate}, {"angle", Drive::kAngle}},
      {.help = "drive columns are rates [rad/s] or angles [rad]; other units: drive_scale"});
    log::StrideParams::bind(b);
    log::JointParams::bind(b);
    log::LimitParams::bind(b);
  }

  log::EncoderRecordingOptions options() const {
    const bool is_angle = drive_input == Drive::kAngle;
    check_stride(is_angle, "angle");
    return {limits(), is_angle, stride, joints()};
  }
};

class AslEncoders final : public log::RecordingSensor<EncoderSample> {
 public:
  AslEncoders(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_encoders(params.path, params.options())) {}
};

VIWO_REGISTER(Sensor, AslEncoders, "asl_encoders", "1.0.0",
              "wheel encoders from a log folder (wheels0/data.csv)", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
