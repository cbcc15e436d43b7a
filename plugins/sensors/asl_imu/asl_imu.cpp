// Sensor asl_imu: inertial measurements from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_table.hpp"

namespace viwo {
namespace {

using AslImu = log::AslTable<ImuSample, log::read_asl_imu>;

VIWO_REGISTER(Sensor, AslImu, "asl_imu", "1.0.0",
              "inertial measurements from a log folder (imu0/data.csv)", "Apache-2.0",
              log::TableParams);

}  // namespace
}  // namespace viwo
