// Sensor asl_pose: reference poses from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_table.hpp"

namespace viwo {
namespace {

using AslPose = log::AslTable<PoseSample, log::read_asl_poses>;

VIWO_REGISTER(Sensor, AslPose, "asl_pose", "1.0.0",
              "reference poses from a log folder (state_groundtruth_estimate0/data.csv)",
              "Apache-2.0", log::TableParams);

}  // namespace
}  // namespace viwo
