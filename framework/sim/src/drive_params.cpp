#include "viwo/sim/drive_params.hpp"

namespace viwo::sim {
namespace {

constexpr double kMargin = 0.5;  // s

}  // namespace

BodyTrajectory drive_from(const DriveParams& params, double end_s, double margin_s,
                          const SidewaysVelocity& sideways) {
  const PlanarMotion motion(params.motion, {params.speed_m_per_s, params.yaw_rate_rad_per_s,
                                            params.ramp_s, params.pivot_m});
  const bool uneven = params.ground == "uneven";
  const Ground ground =
      uneven ? Ground::uneven(params.ground_amplitude_m, params.ground_wavelength_m) : Ground();
  const double margin = kMargin + margin_s;
  return BodyTrajectory::drive(motion, ground, -margin, end_s + margin, 0.05, sideways);
}

}  // namespace viwo::sim
