#include "channels.hpp"

namespace viwo {
namespace {

void require_channels(const WheelModel& model, const config::Mark& mark, const std::string& sensor,
                      const EncoderSample& sample) {
  try {
    model.require_channels(sample, "sensors." + sensor);
  } catch (const InputError& error) {
    config::fail(mark, error.what());
  }
}

}  // namespace

void require_channels(const RunSetup& setup, const std::string& sensor,
                      const EncoderSample& sample) {
  if (setup.model && setup.routes.sensor_of(Consumer::kWheels) == sensor) {
    require_channels(*setup.model, setup.kinematics_mark, sensor, sample);
  }
  if (!setup.filter) return;
  for (const WheelSet& wheels : setup.filter->wheels) {
    if (wheels.prior.sensor != sensor) continue;
    require_channels(*wheels.model, setup.sensors_mark, sensor, sample);
  }
}

}  // namespace viwo
