// Sensor asl_gnss: fixes of a satellite receiver from a log folder (model.md).
#include <array>

#include "viwo/api/plugin.hpp"
#include "viwo/log/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{ParamSpec{.name = "path",
                                       .type = ParamType::kPath,
                                       .help = "the table, or the folder of its data.csv"},
                             log::kMaxRejectedFractionParam};

class AslGnss final : public log::RecordingSensor<GnssSample> {
 public:
  AslGnss(const ParamSet& params, const HostServices& /*services*/)
      : RecordingSensor(
            log::read_asl_gnss(params.text("path"), params.number("max_rejected_fraction"))) {}
};

VIWO_REGISTER(Sensor, AslGnss, "asl_gnss", "1.0.0",
              "fixes of a satellite receiver from a log folder (gnss0/data.csv)", "Apache-2.0",
              kParams);

}  // namespace
}  // namespace viwo
