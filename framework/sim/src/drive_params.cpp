#include "viwo/sim/drive_params.hpp"

namespace viwo::sim {
namespace {

constexpr double kMargin = 0.5;  // s

}  // namespace

BodyTrajectory drive_from(const ParamSet& params, double end_s, double margin_s,
                          const SidewaysVelocity& sideways) {
  const auto pivot = params.numbers("pivot_m");
  if (pivot.size() != 2) throw ParamError("pivot_m", "needs two numbers");
  const PlanarMotion motion(params.text("motion"), {params.number("speed_m_per_s"),
                                                    params.number("yaw_rate_rad_per_s"),
                                                    params.number("ramp_s"),
                                                    {pivot[0], pivot[1]}});
  const bool uneven = params.text("ground") == "uneven";
  const Ground ground = uneven ? Ground::uneven(params.number("ground_amplitude_m"),
                                                params.number("ground_wavelength_m"))
                               : Ground();
  const double margin = kMargin + margin_s;
  return BodyTrajectory::drive(motion, ground, -margin, end_s + margin, 0.05, sideways);
}

}  // namespace viwo::sim
