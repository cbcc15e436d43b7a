// Sensor asl_pose: reference poses from a log folder (model.md).

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::LimitParams {
  std::filesystem::path path;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path),
      {.required = true, .help = "the ground truth table, or the folder of its data.csv"});
    log::LimitParams::bind(b);
  }
};

class AslPose final : public log::RecordingSensor<PoseSample> {
 public:
  AslPose(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(log::read_asl_poses(params.path, params.limits())) {}
};

VIWO_REGISTER(Sensor, AslPose, "asl_pose", "1.0.0",
              "reference poses from a log folder (state_groundtruth_estimate0/data.csv)",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
