// Sensor planar_simulator: encoders and reference poses of a base on a plane (model.md).
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "viwo/api/plugin.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/sim/drive_params.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/sim/planar_motion.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{
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
    ParamSpec{
        .name = "true_intrinsics_scale",
        .type = ParamType::kNumber,
        .fallback = "0",
        .min = 0.,
        .help = "0: the nominal intrinsics are true; s: nominal + s * prior sigma * gaussian"},
    ParamSpec{.name = "intrinsics_wander",
              .type = ParamType::kNumber,
              .fallback = "0",
              .min = 0.,
              .help = "each intrinsic wanders about its true value with a sigma of so many prior "
                      "sigmas (Gauss-Markov)"},
    ParamSpec{.name = "intrinsics_wander_time_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "2",
              .min = 0.,
              .min_exclusive = true,
              .help = "its time constant"},
    ParamSpec{.name = "slip_start_s",
              .type = ParamType::kNumbers,
              .unit = "s",
              .fallback = "[]",
              .help = "when a wheel starts to spin, reading more than it rolls"},
    ParamSpec{.name = "slip_duration_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0.5",
              .min = 0.,
              .help = "for how long each time"},
    ParamSpec{.name = "slip_wheel",
              .type = ParamType::kInt,
              .fallback = "1",
              .min = 1.,
              .help = "drive channel that slips, from 1"},
    ParamSpec{.name = "slip_ratio",
              .type = ParamType::kNumber,
              .fallback = "0.3",
              .help = "0.3: the drive reads 30 % more than the wheel rolls"},
    ParamSpec{.name = "outlier_probability",
              .type = ParamType::kNumber,
              .fallback = "0",
              .min = 0.,
              .max = 1.,
              .help = "probability per sample that one drive channel is off"},
    ParamSpec{.name = "outlier_rad_per_s",
              .type = ParamType::kNumber,
              .unit = "rad/s",
              .fallback = "5",
              .min = 0.,
              .help = "by how much, with either sign"},
    ParamSpec{.name = "drive_resolution_rad_per_s",
              .type = ParamType::kNumber,
              .unit = "rad/s",
              .fallback = "0",
              .min = 0.,
              .help = "drive rates are rounded to its multiples; 0: not rounded"},
};

sim::EncoderSimulation simulation_from(const ParamSet& params) {
  sim::EncoderSimulation out;
  out.duration_s = params.number("duration_s");
  out.rate_hz = params.number("rate_hz");
  out.start_ns = params.integer("start_ns");
  out.time_offset_s = params.number("time_offset_s");
  out.noise = params.flag("noise");
  const auto starts = params.numbers("slip_start_s");
  out.slip.start_s.assign(starts.begin(), starts.end());
  out.slip.duration_s = params.number("slip_duration_s");
  out.slip.ratio = params.number("slip_ratio");
  out.outlier_probability = params.number("outlier_probability");
  out.outlier_rad_per_s = params.number("outlier_rad_per_s");
  out.drive_resolution_rad_per_s = params.number("drive_resolution_rad_per_s");
  out.wander = params.number("intrinsics_wander");
  out.wander_time_s = params.number("intrinsics_wander_time_s");
  return out;
}

std::vector<EncoderSample> encoders(const ParamSet& params, const sim::PlanarMotion& motion,
                                    const HostServices& services) {
  const KinematicModel& robot = params.kinematics("robot");
  ModelDescription description;
  robot.describe(description);
  sim::EncoderSimulation options = simulation_from(params);
  const std::int64_t wheel = params.integer("slip_wheel");
  if (wheel > description.n_drive) {
    throw ParamError("slip_wheel", std::to_string(wheel) + " is not one of the robot's " +
                                       std::to_string(description.n_drive) + " wheels");
  }
  options.slip.wheel = static_cast<int>(wheel) - 1;
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
