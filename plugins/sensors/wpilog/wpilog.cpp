// Sensor wpilog: wheels, gyro and poses of a WPILOG file (model.md).
#include "samples.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

using wpilog::Params;

SampleTypes kinds_of(const Params& params) {
  SampleTypes out;
  if (params.has_poses()) out.push_back(&sample_type<PoseSample>());
  if (params.has_heading()) out.push_back(&sample_type<HeadingSample>());
  if (params.has_imu()) out.push_back(&sample_type<ImuSample>());
  if (params.has_wheels()) out.push_back(&sample_type<EncoderSample>());
  return out;
}

class WpiLog final : public log::RecordingSensor<Measurement> {
 public:
  WpiLog(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(wpilog::read_samples(params), kinds_of(params)) {}
};

VIWO_REGISTER(Sensor, WpiLog, "wpilog", "1.0.0",
              "wheels, gyro and poses of a log of WPILib (FRC robots)", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
