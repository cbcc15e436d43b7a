// Sensor asl_state: reference states from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_table.hpp"

namespace viwo {
namespace {

using AslState = log::AslTable<StateSample, log::read_asl_states>;

VIWO_REGISTER(Sensor, AslState, "asl_state", "1.0.0",
              "reference states from a log folder (state_groundtruth_estimate0/data.csv)",
              "Apache-2.0", log::TableParams);

}  // namespace
}  // namespace viwo
