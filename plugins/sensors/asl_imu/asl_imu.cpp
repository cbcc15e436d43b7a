// Sensor asl_imu: inertial measurements from a log folder (model.md).
#include <array>

#include "viwo/api/plugin.hpp"
#include "viwo/log/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{ParamSpec{.name = "path",
                                       .type = ParamType::kPath,
                                       .help = "the IMU table, or the folder of its data.csv"},
                             log::kMaxGapParam, log::kMaxRejectedFractionParam};

class AslImu final : public log::RecordingSensor<ImuSample> {
 public:
  AslImu(const ParamSet& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_imu(params.text("path"), log::limits_from(params))) {}
};

VIWO_REGISTER(Sensor, AslImu, "asl_imu", "1.0.0",
              "inertial measurements from a log folder (imu0/data.csv)", "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
