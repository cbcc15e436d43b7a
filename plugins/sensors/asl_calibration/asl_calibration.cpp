// Sensor asl_calibration: true calibration parameters from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_table.hpp"

namespace viwo {
namespace {

using AslCalibration =
    log::AslTable<CalibrationSample, log::read_asl_calibration, log::GaplessTableParams>;

VIWO_REGISTER(Sensor, AslCalibration, "asl_calibration", "1.0.0",
              "true calibration parameters from a log folder (calibration_groundtruth0/data.csv)",
              "Apache-2.0", log::GaplessTableParams);

}  // namespace
}  // namespace viwo
