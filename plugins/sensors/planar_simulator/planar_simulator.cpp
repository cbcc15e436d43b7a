// Sensor planar_simulator: encoders and reference poses of a base on a plane (model.md).
#include <cmath>
#include <vector>

#include "viwo/api/plugin.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/sensor_params.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/sim/drive_params.hpp"
#include "viwo/sim/encoder_params.hpp"
#include "viwo/sim/planar_motion.hpp"

namespace viwo {
namespace {

struct Params : sim::MotionParams, sim::EncoderParams, log::JointParams {
  NestedKinematics robot;
  double rate_hz = 100.;
  double reference_rate_hz = 100.;
  std::int64_t start_ns = 0;
  double time_offset_s = 0.;
  bool noise = true;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(robot),
      {.required = true, .help = "the base: its nominal intrinsics and its noise"});
    sim::MotionParams::bind(b);
    b(VIWO_PARAM(rate_hz),
      {.unit = "Hz", .above = 0., .max = 10000., .help = "rate of the encoder samples"});
    b(VIWO_PARAM(reference_rate_hz),
      {.unit = "Hz", .above = 0., .max = 10000., .help = "rate of the true poses"});
    b(VIWO_PARAM(start_ns),
      {.unit = "ns", .min = 0., .max = 4e18, .help = "stamp at which the motion starts"});
    b(VIWO_PARAM(time_offset_s),
      {.unit = "s",
       .min = -10.,
       .max = 10.,
       .help = "what to add to a stamp of the encoders to get the time of the reference"});
    b(VIWO_PARAM(noise),
      {.help = "noise of encoders and wheel slip as the robot's description says"});
    sim::EncoderParams::bind(b);
    log::JointParams::bind(b);
  }
};

std::vector<EncoderSample> encoders(const Params& params, const sim::PlanarMotion& motion,
                                    const HostServices& services) {
  const KinematicModel& robot = *params.robot.model;
  ModelDescription description;
  robot.describe(description);
  sim::EncoderSimulation options = sim::encoder_simulation_from(
      params, description, params.duration_s, params.start_ns, params.noise);
  options.rate_hz = params.rate_hz;
  options.time_offset_s = params.time_offset_s;
  if (services.exact) options.make_exact();
  const double scale = services.exact ? 0. : params.true_intrinsics_scale;
  const Intrinsics truth = sim::perturbed_intrinsics(description, scale, services.seed);
  try {
    return sim::simulate_encoders(robot, truth, motion, options, params.noise_seed(services.seed));
  } catch (const InputError& error) {
    throw ParamError("motion", error.what());
  }
}

std::vector<PoseSample> poses(const Params& params, const sim::PlanarMotion& motion) {
  sim::PoseIntegrator integrator(motion);
  std::vector<PoseSample> out;
  const double rate_hz = params.reference_rate_hz;
  const std::int64_t end_ns = to_ns(params.duration_s);
  for (std::int64_t k = 0, t_ns = 0; t_ns <= end_ns; t_ns = sim::sample_time_ns(++k, rate_hz)) {
    const Eigen::Vector3d& g = integrator.advance_to(static_cast<double>(t_ns) * 1e-9);
    out.push_back({params.start_ns + t_ns,
                   {g[1], g[2], 0.},
                   {0., 0., std::sin(0.5 * g[0]), std::cos(0.5 * g[0])}});
  }
  return out;
}

log::Recording<Measurement> simulate(const Params& params, const HostServices& services) {
  const sim::PlanarMotion motion = sim::motion_from(
      params.motion, params.motion_file,
      {params.speed_m_per_s, params.yaw_rate_rad_per_s, params.ramp_s, params.pivot_m});
  log::Recording<Measurement> out;
  auto from_wheels = encoders(params, motion, services);
  log::mount_joints(params, from_wheels, out.rejections);
  const auto from_reference = poses(params, motion);
  out.samples.assign(from_wheels.begin(), from_wheels.end());
  out.samples.insert(out.samples.end(), from_reference.begin(), from_reference.end());
  log::sort_by_time(out);
  return out;
}

class PlanarSimulator final : public log::RecordingSensor<Measurement> {
 public:
  PlanarSimulator(const Params& params, const HostServices& services)
      : RecordingSensor(simulate(params, services), sample_types<EncoderSample, PoseSample>()) {}
  bool can_be_exact() const override { return true; }
};

VIWO_REGISTER(Sensor, PlanarSimulator, "planar_simulator", "1.0.0",
              "encoders and true poses of any base that moves on a plane", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
