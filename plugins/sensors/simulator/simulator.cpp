// Sensor simulator: IMU, cameras, encoders and the truth of a base that drives on a ground
// (model.md).
#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include "pose_simulator.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/drive_params.hpp"
#include "viwo/sim/encoder_params.hpp"
#include "viwo/sim/rig_simulator.hpp"
#include "viwo/sim/true_cameras.hpp"
#include "viwo/sim/true_mount.hpp"

namespace viwo {
namespace {

/// A base that cannot move sideways slides by what the spline deviates from its motion, m/s: the
/// more the harder it accelerates.
double sliding_of(const sim::DriveParams& drive) {
  constexpr double kSliding = 1e-4, kUsual_m_per_s2 = 5., kKnots_s = 0.05;
  const double acceleration = std::abs(drive.speed_m_per_s) / std::max(drive.ramp_s, kKnots_s);
  return kSliding * std::max(1., acceleration / kUsual_m_per_s2);
}

struct Params : sim::EncoderParams,
                log::JointParams,
                sim::DriveParams,
                PoseParams,
                sim::RigParams,
                sim::TrueMountParams {
  NestedKinematics robot;
  std::string wheel_set;
  bool wheels = true;
  double wheel_rate_hz = 100.;
  double t_OtoI_s = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(robot),
      {.required = true, .help = "the base: its nominal intrinsics and its noise"});
    sim::TrueMountParams::bind(b);
    b(VIWO_PARAM(wheel_set),
      {.help = "for a second simulator, the wheel set (wheel_sets.NAME) that it stands for: "
               "its truth is told as NAME.r_1 and so on, true states are left to the first"});
    b(VIWO_PARAM(wheels), {.help = "whether there are encoder samples"});
    b(VIWO_PARAM(wheel_rate_hz),
      {.unit = "Hz", .min = 1., .max = 10000., .help = "rate of the encoder samples"});
    b(VIWO_PARAM(t_OtoI_s),
      {.unit = "s", .min = -10., .max = 10., .help = "t_imu = t_odom + t_OtoI"});
    sim::EncoderParams::bind(b);
    log::JointParams::bind(b);
    sim::DriveParams::bind(b);
    PoseParams::bind(b);
    sim::RigParams::bind(b);
  }
};

std::vector<CalibrationSample> calibration_truth(const ModelDescription& robot,
                                                 const Intrinsics& x_WI,
                                                 const sim::Mounting& mounting, double t_OtoI_s,
                                                 std::int64_t t_ns) {
  std::vector<CalibrationSample> out;
  for (Eigen::Index i = 0; i < x_WI.size(); ++i) {
    const std::string& name = robot.intrinsics[static_cast<std::size_t>(i)].name;
    out.push_back({t_ns, name, x_WI[i]});
  }
  for (const CalibrationSample& sample : sim::mounting_truth(mounting, t_ns)) {
    out.push_back(sample);
  }
  out.push_back({t_ns, "t_OtoI", t_OtoI_s});
  return out;
}

log::Recording<Measurement> simulate(const Params& params, const HostServices& services) {
  const KinematicModel& robot = *params.robot.model;
  ModelDescription description;
  robot.describe(description);
  const std::int64_t start_ns = params.start_ns;
  sim::RigSimulation rig = sim::rig_from(params, params.duration_s, start_ns, services);
  sim::EncoderSimulation wheels =
      sim::encoder_simulation_from(params, description, params.duration_s, start_ns, params.noise);
  wheels.rate_hz = params.wheel_rate_hz;
  wheels.time_offset_s = params.t_OtoI_s;
  wheels.sliding_m_per_s = sliding_of(params);
  if (services.exact) {
    wheels.make_exact();
  } else {
    params.draw(services.seed, rig.mounting, wheels.time_offset_s);
  }
  const sim::BodyTrajectory trajectory =
      sim::drive_from(params, sim::rig_end_s(rig), std::abs(wheels.time_offset_s));
  const double scale = services.exact ? 0. : params.true_intrinsics_scale;
  const Intrinsics x_WI = sim::perturbed_intrinsics(description, scale, services.seed);

  HostServices for_noise = services;
  for_noise.seed = params.noise_seed(services.seed);

  log::Recording<Measurement> out;
  const std::string& wheel_set = params.wheel_set;
  for (CalibrationSample truth :
       calibration_truth(description, x_WI, rig.mounting, wheels.time_offset_s, start_ns)) {
    if (!wheel_set.empty()) truth.name = wheel_set + "." + truth.name;
    out.samples.emplace_back(std::move(truth));
  }
  auto from_rig = sim::simulate_rig(trajectory, rig, for_noise.seed);
  if (!wheel_set.empty()) {
    std::erase_if(from_rig,
                  [](const Measurement& m) { return m.get_if<StateSample>() != nullptr; });
  }
  std::move(from_rig.begin(), from_rig.end(), std::back_inserter(out.samples));
  const auto poses = simulate_poses(trajectory, rig.mounting, params, params.duration_s, start_ns,
                                    params.noise, for_noise);
  out.samples.insert(out.samples.end(), poses.begin(), poses.end());
  if (params.wheels) {
    try {
      auto from_wheels = sim::simulate_encoders(
          robot, x_WI, [&trajectory](double t_s) { return trajectory.twist(t_s); }, params.motion,
          wheels, for_noise.seed);
      log::mount_joints(params, from_wheels, out.rejections);
      out.samples.insert(out.samples.end(), from_wheels.begin(), from_wheels.end());
    } catch (const InputError& error) {
      throw ParamError("motion", error.what());
    }
  }
  sim::sort_by_time(out.samples);
  return out;
}

SampleTypes kinds_of(const Params& params) {
  SampleTypes out = sim::rig_kinds(params);
  if (!params.wheel_set.empty()) std::erase(out, &sample_type<StateSample>());
  const SampleType* const truth = &sample_type<CalibrationSample>();
  if (std::find(out.begin(), out.end(), truth) == out.end()) out.push_back(truth);
  if (params.pose_rate_hz > 0.) out.push_back(&sample_type<PoseSample>());
  if (params.wheels) out.push_back(&sample_type<EncoderSample>());
  return out;
}

class Simulator final : public log::RecordingSensor<Measurement> {
 public:
  Simulator(const Params& params, const HostServices& services)
      : RecordingSensor(simulate(params, services), kinds_of(params)) {}
  bool can_be_exact() const override { return true; }
};

VIWO_REGISTER(Sensor, Simulator, "simulator", "1.0.0",
              "IMU, cameras, encoders and truth of any base that drives on a ground", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
