// Sensor asl_calibration: true calibration parameters from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::MaxRejectedParams {
  std::filesystem::path path;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path),
      {.required = true, .help = "the calibration table, or the folder of its data.csv"});
    log::MaxRejectedParams::bind(b);
  }
};

class AslCalibration final : public log::RecordingSensor<CalibrationSample> {
 public:
  AslCalibration(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_calibration(params.path, params.max_rejected_fraction)) {}
};

VIWO_REGISTER(Sensor, AslCalibration, "asl_calibration", "1.0.0",
              "true calibration parameters from a log folder (calibration_groundtruth0/data.csv)",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
