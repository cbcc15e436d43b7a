// Sensor asl_features: feature tracks from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::LimitParams {
  std::filesystem::path path;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path),
      {.required = true, .help = "the feature table, or the folder of its data.csv"});
    log::LimitParams::bind(b);
  }
};

class AslFeatures final : public log::RecordingSensor<FeatureSample> {
 public:
  AslFeatures(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_features(params.path, params.limits())) {}
};

VIWO_REGISTER(Sensor, AslFeatures, "asl_features", "1.0.0",
              "feature tracks from a log folder (features0/data.csv)", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
