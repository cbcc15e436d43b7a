// Sensor asl_features: feature tracks from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_table.hpp"

namespace viwo {
namespace {

using AslFeatures = log::AslTable<FeatureSample, log::read_asl_features>;

VIWO_REGISTER(Sensor, AslFeatures, "asl_features", "1.0.0",
              "feature tracks from a log folder (features0/data.csv)", "Apache-2.0",
              log::TableParams);

}  // namespace
}  // namespace viwo
