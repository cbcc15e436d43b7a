// The true mount and clock of simulated wheels: what is configured, moved by a draw that nobody
// knows.
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "viwo/api/params.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/random.hpp"
#include "viwo/sim/rig_simulator.hpp"

namespace viwo::sim {

struct TrueMountParams {
  Eigen::Vector3d true_sigma_p_IinO_m{0., 0., 0.};
  Eigen::Vector3d true_sigma_R_ItoO_rad{0., 0., 0.};
  double true_sigma_t_OtoI_s = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(true_sigma_p_IinO_m),
      {.unit = "m", .help = "the true mount is p_IinO_m + a draw of these sigmas"});
    b(VIWO_PARAM(true_sigma_R_ItoO_rad), {.unit = "rad", .help = "and turned by a draw of these"});
    b(VIWO_PARAM(true_sigma_t_OtoI_s),
      {.unit = "s", .min = 0., .help = "the true clock is t_OtoI_s + a draw of this sigma"});
  }

  /// From what is configured to what is true.
  void draw(std::uint64_t seed, Mounting& mounting, double& t_OtoI_s) const {
    RandomStream random(seed, Stream::kTrueMount);
    const auto draw_of = [&](const Eigen::Vector3d& sigma) {
      Eigen::Vector3d out;
      for (int i = 0; i < 3; ++i) out[i] = sigma[i] * random.gaussian();
      return out;
    };
    mounting.p_IinO += draw_of(true_sigma_p_IinO_m);
    mounting.R_ItoO = exp_so3(draw_of(true_sigma_R_ItoO_rad)) * mounting.R_ItoO;
    t_OtoI_s += true_sigma_t_OtoI_s * random.gaussian();
  }
};

}  // namespace viwo::sim
