#include "held_gauge.hpp"

#include <vector>

#include <Eigen/LU>

#include "viwo/math/so3.hpp"

namespace viwo {

bool move_to_held_gauge(const WheelModel& model, const Intrinsics& held, WheelsView& truth) {
  std::vector<int> gauge;
  for (int i = 0; i < model.n_intrinsics(); ++i) {
    if (model.description().intrinsics[static_cast<std::size_t>(i)].gauge_fixed) gauge.push_back(i);
  }
  if (gauge.size() != 3) return false;
  // g = [yaw, x, y] of the new frame in the old one such that the held entries agree.
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  const auto residual = [&](const Eigen::Vector3d& at, Intrinsics& moved, Eigen::Vector3d& r) {
    moved = truth.x_WI;
    if (model.model().move_frame(at, moved) != Status::kOk) return false;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const int i = gauge[static_cast<std::size_t>(k)];
      r[k] = moved[i] - held[i];
    }
    return true;
  };
  Intrinsics moved;
  Eigen::Vector3d r, r_plus, r_minus;
  for (int iteration = 0; iteration < 20; ++iteration) {
    if (!residual(g, moved, r)) return false;
    if (r.norm() < 1e-13) break;
    Eigen::Matrix3d J;
    constexpr double kStep = 1e-6;
    for (Eigen::Index k = 0; k < 3; ++k) {
      Intrinsics unused;
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      if (!residual(g + step, unused, r_plus) || !residual(g - step, unused, r_minus)) return false;
      J.col(k) = (r_plus - r_minus) / (2. * kStep);
    }
    g -= J.fullPivLu().solve(r);
  }
  if (!residual(g, moved, r) || !(r.norm() < 1e-9)) return false;
  const Eigen::Matrix3d back = exp_so3({0., 0., -g[0]});
  truth.x_WI = moved;
  truth.R_ItoO = back * truth.R_ItoO;
  truth.p_IinO = back * (truth.p_IinO - Eigen::Vector3d(g[1], g[2], 0.));
  return true;
}

}  // namespace viwo
