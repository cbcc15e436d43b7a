// Sensor recorded_motion_simulator: IMU, cameras and true states on a spline through recorded poses
// (model.md). The encoders of the same recording are another sensor's.
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "viwo/api/plugin.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/ros_text.hpp"
#include "viwo/log/sensor_params.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/rig_simulator.hpp"
#include "viwo/sim/true_cameras.hpp"

namespace viwo {
namespace {

struct Params : log::TextClockParams, log::LimitParams, sim::RigParams {
  std::filesystem::path path;
  bool planar = true;
  double knot_spacing_s = 0.3;
  double time_offset_s = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path),
      {.required = true,
       .help = "recorded poses of O: ROS PoseStamped messages printed as text, or gzipped"});
    b(VIWO_PARAM(planar), {.help = "use x, y and yaw only; z, pitch and roll are zero"});
    b(VIWO_PARAM(knot_spacing_s),
      {.unit = "s",
       .min = 0.02,
       .max = 10.,
       .help = "of the spline through the poses: shorter is closer to them and rougher"});
    b(VIWO_PARAM(time_offset_s),
      {.unit = "s", .min = -10., .max = 10., .help = "t_imu = stamp of a pose + time_offset_s"});
    log::TextClockParams::bind(b);
    log::LimitParams::bind(b);
    sim::RigParams::bind(b);
  }
};

/// IMU samples must not lie behind the last pose.
double duration_within(double recorded_s, double imu_rate_hz) {
  return std::floor(recorded_s * imu_rate_hz - 1e-6) / imu_rate_hz;
}

/// What a spline makes of a gap is no motion of anybody's, and its knots are without end.
void require_motion(const std::vector<PoseSample>& poses) {
  constexpr double kLongestGapS = 10., kLongestS = 7200.;
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const double gap_s = seconds_between(poses[k - 1].t_ns, poses[k].t_ns);
    if (gap_s <= kLongestGapS) continue;
    std::array<char, 100> text{};
    std::snprintf(text.data(), text.size(), "no poses for %.1f s after %s: cut the recording there",
                  gap_s, time_text(poses[k - 1].t_ns).c_str());
    throw ParamError("path", text.data());
  }
  const double duration_s = seconds_between(poses.front().t_ns, poses.back().t_ns);
  if (duration_s <= kLongestS) return;
  std::array<char, 100> text{};
  std::snprintf(text.data(), text.size(), "poses of %.0f s, at most %.0f s are simulated: cut them",
                duration_s, kLongestS);
  throw ParamError("path", text.data());
}

void report(const HostServices& services, const sim::FitResidual& residual) {
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(),
                "poses are off the spline by %.3f mm rms, %.3f mm at most, %.3f mrad rms in yaw",
                1e3 * residual.rms_m, 1e3 * residual.max_m, 1e3 * residual.rms_rad);
  services.log(LogLevel::kInfo, text.data());
}

log::Recording<Measurement> simulate(const Params& params, const HostServices& services) {
  auto recorded = log::read_ros_poses(params.path, params.ros_clock(), params.limits());
  require_motion(recorded.samples);
  const std::int64_t offset_ns = to_ns(params.time_offset_s);
  for (PoseSample& pose : recorded.samples) pose.t_ns += offset_ns;
  // The spline is poor at its ends, where it has samples on one side only.
  const double margin_s = params.knot_spacing_s;
  const std::int64_t start_ns = recorded.samples.front().t_ns + to_ns(margin_s);
  const sim::BodyTrajectory trajectory = sim::BodyTrajectory::through(
      recorded.samples, start_ns, params.planar, params.knot_spacing_s);
  report(services, sim::fit_residual(trajectory, recorded.samples, start_ns));
  const double duration_s = duration_within(trajectory.end_s() - margin_s, params.imu_rate_hz);
  if (!(duration_s > 0.)) throw ParamError("path", "the recording is too short");

  log::Recording<Measurement> out;
  out.rejections = std::move(recorded.rejections);
  out.samples = sim::simulate_rig(trajectory, sim::rig_from(params, duration_s, start_ns, services),
                                  services.seed);
  sim::sort_by_time(out.samples);
  return out;
}

class RecordedMotionSimulator final : public log::RecordingSensor<Measurement> {
 public:
  RecordedMotionSimulator(const Params& params, const HostServices& services)
      : RecordingSensor(simulate(params, services), sim::rig_kinds(params)) {}
  bool can_be_exact() const override { return true; }
};

VIWO_REGISTER(Sensor, RecordedMotionSimulator, "recorded_motion_simulator", "1.0.0",
              "IMU, cameras and true states on a trajectory through recorded poses", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
