// Sensor planar_simulator: encoders and reference poses of a base on a plane (model.md).
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "viwo/api/plugin.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/sensor_params.hpp"
#include "viwo/sim/drive_params.hpp"
#include "viwo/sim/encoder_params.hpp"
#include "viwo/sim/planar_motion.hpp"

namespace viwo {
namespace {

constexpr std::array kBaseParams{
    ParamSpec{.name = "robot",
              .type = ParamType::kKinematics,
              .help = "the base: its nominal intrinsics and its noise"},
    ParamSpec{.name = "motion",
              .type = ParamType::kString,
              .fallback = "icr_sweep",
              .choices = sim::kMotionChoices,
              .help = "how the base moves"},
    ParamSpec{.name = "duration_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "60",
              .min = 0.,
              .max = 86400.,
              .min_exclusive = true,
              .help = "how long"},
    ParamSpec{.name = "speed_m_per_s",
              .type = ParamType::kNumber,
              .unit = "m/s",
              .fallback = "0.5",
              .help = "speed of the motion"},
    ParamSpec{.name = "yaw_rate_rad_per_s",
              .type = ParamType::kNumber,
              .unit = "rad/s",
              .fallback = "0.6",
              .help = "constant or peak yaw rate of the motions that turn"},
    ParamSpec{.name = "pivot_m",
              .type = ParamType::kNumbers,
              .unit = "m",
              .fallback = "[0, 0]",
              .help = "point of the base that motion pivot turns about"},
    ParamSpec{.name = "ramp_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "1",
              .min = 0.,
              .help = "smooth start from rest; 0: at speed from the beginning"},
    ParamSpec{.name = "rate_hz",
              .type = ParamType::kNumber,
              .unit = "Hz",
              .fallback = "100",
              .min = 0.,
              .max = 10000.,
              .min_exclusive = true,
              .help = "rate of the encoder samples"},
    ParamSpec{.name = "reference_rate_hz",
              .type = ParamType::kNumber,
              .unit = "Hz",
              .fallback = "100",
              .min = 0.,
              .max = 10000.,
              .min_exclusive = true,
              .help = "rate of the true poses"},
    ParamSpec{.name = "start_ns",
              .type = ParamType::kInt,
              .unit = "ns",
              .fallback = "0",
              .min = 0.,
              .max = 4e18,
              .help = "stamp at which the motion starts"},
    ParamSpec{.name = "time_offset_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0",
              .min = -10.,
              .max = 10.,
              .help = "what to add to a stamp of the encoders to get the time of the reference"},
    ParamSpec{.name = "noise",
              .type = ParamType::kBool,
              .fallback = "true",
              .help = "noise of encoders and wheel slip as the robot's description says"},
};

constexpr auto kParams = log::joined(kBaseParams, sim::kEncoderParams);

std::vector<EncoderSample> encoders(const ParamSet& params, const sim::PlanarMotion& motion,
                                    const HostServices& services) {
  const KinematicModel& robot = params.kinematics("robot");
  ModelDescription description;
  robot.describe(description);
  sim::EncoderSimulation options = sim::encoder_simulation_from(params, description);
  options.rate_hz = params.number("rate_hz");
  options.time_offset_s = params.number("time_offset_s");
  if (services.exact) options.make_exact();
  const double scale = services.exact ? 0. : params.number("true_intrinsics_scale");
  const Intrinsics truth = sim::perturbed_intrinsics(description, scale, services.seed);
  try {
    return sim::simulate_encoders(robot, truth, motion, options, services.seed);
  } catch (const InputError& error) {
    throw ParamError("motion", error.what());
  }
}

std::vector<PoseSample> poses(const ParamSet& params, const sim::PlanarMotion& motion) {
  sim::PoseIntegrator integrator(motion);
  std::vector<PoseSample> out;
  const double rate_hz = params.number("reference_rate_hz");
  const std::int64_t end_ns = std::llround(params.number("duration_s") * 1e9);
  for (std::int64_t k = 0, t_ns = 0; t_ns <= end_ns; t_ns = sim::sample_time_ns(++k, rate_hz)) {
    const Eigen::Vector3d& g = integrator.advance_to(static_cast<double>(t_ns) * 1e-9);
    out.push_back({params.integer("start_ns") + t_ns,
                   {g[1], g[2], 0.},
                   {0., 0., std::sin(0.5 * g[0]), std::cos(0.5 * g[0])}});
  }
  return out;
}

log::Recording<Measurement> simulate(const ParamSet& params, const HostServices& services) {
  const auto pivot = params.numbers("pivot_m");
  if (pivot.size() != 2) throw ParamError("pivot_m", "needs two numbers");
  const sim::PlanarMotion motion(params.text("motion"), {params.number("speed_m_per_s"),
                                                         params.number("yaw_rate_rad_per_s"),
                                                         params.number("ramp_s"),
                                                         {pivot[0], pivot[1]}});
  log::Recording<Measurement> out;
  const auto from_wheels = encoders(params, motion, services);
  const auto from_reference = poses(params, motion);
  out.samples.assign(from_wheels.begin(), from_wheels.end());
  out.samples.insert(out.samples.end(), from_reference.begin(), from_reference.end());
  std::stable_sort(
      out.samples.begin(), out.samples.end(),
      [](const Measurement& a, const Measurement& b) { return stamp_ns(a) < stamp_ns(b); });
  return out;
}

class PlanarSimulator final : public log::RecordingSensor<Measurement> {
 public:
  PlanarSimulator(const ParamSet& params, const HostServices& services)
      : RecordingSensor(simulate(params, services), sample_types<EncoderSample, PoseSample>()) {}
  bool can_be_exact() const override { return true; }
};

VIWO_REGISTER(Sensor, PlanarSimulator, "planar_simulator", "1.0.0",
              "encoders and true poses of any base that moves on a plane", "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
