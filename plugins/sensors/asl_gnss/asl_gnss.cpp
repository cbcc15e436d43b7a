// Sensor asl_gnss: fixes of a satellite receiver from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::MaxRejectedParams {
  std::filesystem::path path;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path), {.required = true, .help = "the table, or the folder of its data.csv"});
    log::MaxRejectedParams::bind(b);
  }
};

class AslGnss final : public log::RecordingSensor<GnssSample> {
 public:
  AslGnss(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_gnss(params.path, params.max_rejected_fraction)) {}
};

VIWO_REGISTER(Sensor, AslGnss, "asl_gnss", "1.0.0",
              "fixes of a satellite receiver from a log folder (gnss0/data.csv)", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
