// Sensor asl_encoders: wheel encoders from a log folder (model.md).
#include <array>

#include "viwo/api/plugin.hpp"
#include "viwo/log/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{
    ParamSpec{.name = "path",
              .type = ParamType::kPath,
              .help = "the encoder table, or the folder of its data.csv"},
    ParamSpec{.name = "drive_input",
              .type = ParamType::kString,
              .fallback = "rate",
              .choices = "rate|angle",
              .help = "drive columns are rates [rad/s] or multi-turn angles [rad]"},
    log::kStrideParam, log::kMaxGapParam, log::kMaxRejectedFractionParam};

class AslEncoders final : public log::RecordingSensor<EncoderSample> {
 public:
  AslEncoders(const ParamSet& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_encoders(params.text("path"),
                                               log::encoder_options_from(params, "angle"))) {}
};

VIWO_REGISTER(Sensor, AslEncoders, "asl_encoders", "1.0.0",
              "wheel encoders from a log folder (wheels0/data.csv)", "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
