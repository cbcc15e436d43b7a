// Sensor asl_features: feature tracks from a log folder (model.md).
#include <array>

#include "viwo/api/plugin.hpp"
#include "viwo/log/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{ParamSpec{.name = "path",
                                       .type = ParamType::kPath,
                                       .help = "the feature table, or the folder of its data.csv"},
                             log::kMaxGapParam, log::kMaxRejectedFractionParam};

class AslFeatures final : public log::RecordingSensor<FeatureSample> {
 public:
  AslFeatures(const ParamSet& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_features(params.text("path"), log::limits_from(params))) {}
};

VIWO_REGISTER(Sensor, AslFeatures, "asl_features", "1.0.0",
              "feature tracks from a log folder (features0/data.csv)", "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
