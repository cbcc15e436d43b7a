// Sensor asl_gnss: fixes of a satellite receiver from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_table.hpp"

namespace viwo {
namespace {

using AslGnss = log::AslTable<GnssSample, log::read_asl_gnss, log::GaplessTableParams>;

VIWO_REGISTER(Sensor, AslGnss, "asl_gnss", "1.0.0",
              "fixes of a satellite receiver from a log folder (gnss0/data.csv)", "Apache-2.0",
              log::GaplessTableParams);

}  // namespace
}  // namespace viwo
