// Sensor asl_state: reference states from a log folder (model.md).
#include <array>

#include "viwo/api/plugin.hpp"
#include "viwo/log/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{
    ParamSpec{.name = "path",
              .type = ParamType::kPath,
              .help = "the ground truth table, or the folder of its data.csv"},
    log::kMaxGapParam, log::kMaxRejectedFractionParam};

class AslState final : public log::RecordingSensor<StateSample> {
 public:
  AslState(const ParamSet& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_states(params.text("path"), log::limits_from(params))) {}
};

VIWO_REGISTER(Sensor, AslState, "asl_state", "1.0.0",
              "reference states from a log folder (state_groundtruth_estimate0/data.csv)",
              "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
