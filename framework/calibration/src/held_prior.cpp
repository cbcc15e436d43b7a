#include "held_prior.hpp"

#include <vector>

#include <Eigen/LU>

namespace viwo::calibration {
namespace {

/// How the intrinsics change with the frame, by yaw, x and y of O' in O, of those that can be
/// moved.
Eigen::MatrixXd by_frame(const WheelModel& model, const Intrinsics& x_WI) {
  constexpr double kStep = 1e-5;
  Eigen::MatrixXd N(x_WI.size(), 0);
  for (int j = 0; j < 3; ++j) {
    const Eigen::Vector3d g = kStep * Eigen::Vector3d::Unit(j);
    Intrinsics ahead = x_WI, behind = x_WI;
    if (model.model().move_frame(g, ahead) != Status::kOk ||
        model.model().move_frame(-g, behind) != Status::kOk) {
      continue;
    }
    N.conservativeResize(Eigen::NoChange, N.cols() + 1);
    N.rightCols<1>() = (ahead - behind) / (2. * kStep);
  }
  return N;
}

}  // namespace

Eigen::MatrixXd prior_in_held_frame(const WheelModel& model, const Intrinsics& x_WI,
                                    const Intrinsics& sigma) {
  std::vector<int> held;
  for (int i = 0; i < model.n_intrinsics(); ++i) {
    if (model.description().intrinsics[static_cast<std::size_t>(i)].gauge_fixed) held.push_back(i);
  }
  const auto n = static_cast<Eigen::Index>(x_WI.size());
  Eigen::MatrixXd to_held = Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd N = by_frame(model, x_WI);
  const Eigen::MatrixXd N_held = N(held, Eigen::all);
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(N_held);
  if (!held.empty() && N_held.rows() == N_held.cols() && lu.isInvertible()) {
    to_held(Eigen::all, held) -= N * lu.inverse();
  }
  const Eigen::MatrixXd moved = to_held * sigma.asDiagonal();
  Eigen::MatrixXd P = moved * moved.transpose();
  for (const int i : held) {
    P.row(i).setZero();
    P.col(i).setZero();
  }
  return P;
}

}  // namespace viwo::calibration
