// Sensor asl_imu: inertial measurements from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::LimitParams {
  std::filesystem::path path;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path), {.required = true, .help = "the IMU table, or the folder of its data.csv"});
    log::LimitParams::bind(b);
  }
};

class AslImu final : public log::RecordingSensor<ImuSample> {
 public:
  AslImu(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_imu(params.path, params.limits())) {}
};

VIWO_REGISTER(Sensor, AslImu, "asl_imu", "1.0.0",
              "inertial measurements from a log folder (imu0/data.csv)", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
