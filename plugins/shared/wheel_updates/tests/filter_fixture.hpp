// A small host with one wheel set for the tests of the wheel updates, and a robot that drives on a
// tilted plane.
#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "registry.hpp"
#include "viwo/api/update.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/testing/update_host.hpp"
#include "wheel_fixture.hpp"

namespace viwo::testing {

inline std::shared_ptr<Update> load_update(const std::string& yaml, bool exact = false) {
  config::Errors errors;
  const auto loaded =
      registry().make_update(config::parse(yaml, "test"), "updates", 0, errors, {}, exact);
  errors.throw_if_any();
  return loaded.object;
}

/// The true state of a base whose odometry frame moves over a tilted plane.
struct TiltedDrive {
  Eigen::Matrix3d R_GtoW = exp_so3({0.2, -0.3, 0.7});  ///< W: the plane, z up from it
  Eigen::Vector3d p_WinG{1., -2., 0.5};
  Eigen::Matrix3d R_ItoO = exp_so3({0.1, -0.2, 2.3});
  Eigen::Vector3d p_IinO{0.08, -0.05, 0.12};

  /// The clone for the planar pose g = [yaw, x, y] of O in W and the twist of O.
  CloneState clone(std::int64_t t_ns, int slot, const Eigen::Vector3d& g, const Twist& xi) const {
    const Eigen::Matrix3d R_WtoO = exp_so3({0., 0., -g[0]});
    const Eigen::Matrix3d R_GtoO = R_WtoO * R_GtoW;
    CloneState clone;
    clone.t_ns = t_ns;
    clone.slot = slot;
    clone.R_GtoI = R_ItoO.transpose() * R_GtoO;
    clone.p_IinG =
        p_WinG + R_GtoW.transpose() * Eigen::Vector3d(g[1], g[2], 0.) + R_GtoO.transpose() * p_IinO;
    const Eigen::Vector3d omega(0., 0., xi[2]);
    clone.w_IinI = R_ItoO.transpose() * omega;
    clone.v_IinG = R_GtoO.transpose() * (Eigen::Vector3d(xi[0], xi[1], 0.) + omega.cross(p_IinO));
    clone.R_GtoI_fej = clone.R_GtoI;
    clone.p_IinG_fej = clone.p_IinG;
    return clone;
  }
};

/// The wheel set of a base, estimated: what is known of it is up to the test (SmallFilter::P).
inline WheelsPrior free_wheels(const TiltedDrive& drive, const WheelModel* model = nullptr,
                               double t_OtoI_s = 0.) {
  WheelsPrior prior;
  prior.wheels.R_ItoO = drive.R_ItoO;
  prior.wheels.p_IinO = drive.p_IinO;
  prior.wheels.t_OtoI_s = t_OtoI_s;
  if (model != nullptr) {
    prior.wheels.model = &model->model();
    prior.wheels.x_WI = model->nominal();
  }
  prior.sigma_extrinsics.setOnes();
  prior.sigma_time_offset_s = 1.;
  prior.sigma_intrinsics.setOnes(prior.wheels.x_WI.size());
  return prior;
}

/// A host whose first blocks are those of a wheel set.
struct SmallFilter : UpdateHost {
  explicit SmallFilter(const WheelsPrior& prior = free_wheels({}))
      : UpdateHost(Rig({}, prior)), wheels(declare_wheels(*this)) {}

  WheelsBlocks wheels;

  WheelsView wheels_view() const { return wheels.view(view()); }
  auto R_ItoO() { return rotation(wheels.extrinsics); }
  auto p_IinO() { return numbers(wheels.extrinsics); }
  double& t_OtoI_s() { return *numbers(wheels.clock).data(); }
  auto x_WI() { return numbers(wheels.intrinsics); }
};

inline Eigen::VectorXd gaussian(int n, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss;
  Eigen::VectorXd v(n);
  for (int i = 0; i < n; ++i) v[i] = gauss(rng);
  return v;
}

}  // namespace viwo::testing
