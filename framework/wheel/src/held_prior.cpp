#include "viwo/wheel/held_prior.hpp"

#include <iterator>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace viwo {
namespace {

/// How [x_WI, E] change with the frame, by yaw, x and y of O' in O, of those that can be moved.
Eigen::MatrixXd by_frame(const WheelModel& model, const Intrinsics& x_WI, double psi) {
  constexpr double kStep = 1e-5;
  Eigen::Matrix3d E = Eigen::Matrix3d::Zero();
  E(2, 0) = 1.;
  E.topRightCorner<2, 2>() = Eigen::Rotation2Dd(psi).toRotationMatrix();
  Eigen::MatrixXd N(x_WI.size() + 3, 0);
  for (int j = 0; j < 3; ++j) {
    const Eigen::Vector3d g = kStep * Eigen::Vector3d::Unit(j);
    Intrinsics ahead = x_WI, behind = x_WI;
    if (model.model().move_frame(g, ahead) != Status::kOk ||
        model.model().move_frame(-g, behind) != Status::kOk) {
      continue;
    }
    N.conservativeResize(Eigen::NoChange, N.cols() + 1);
    N.rightCols<1>() << (ahead - behind) / (2. * kStep), E.col(j);
  }
  return N;
}

}  // namespace

Eigen::MatrixXd prior_in_held_frame(const WheelModel& model, const Intrinsics& x_WI,
                                    const Intrinsics& sigma, const Eigen::Vector3d& extrinsics,
                                    const Eigen::Vector3d& extrinsics_sigma) {
  std::vector<int> held;
  for (int i = 0; i < model.n_intrinsics(); ++i) {
    if (model.description().intrinsics[static_cast<std::size_t>(i)].gauge_fixed) held.push_back(i);
  }
  Eigen::MatrixXd N = by_frame(model, x_WI, extrinsics[2]);
  if (extrinsics_sigma.isZero(0.)) N.bottomRows<3>().setZero();
  Eigen::VectorXd drawn(N.rows());
  drawn << sigma, extrinsics_sigma;
  Eigen::MatrixXd to_held = Eigen::MatrixXd::Identity(N.rows(), N.rows());
  if (!held.empty() && N.cols() == std::ssize(held)) {
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(N(held, Eigen::all));
    if (lu.isInvertible()) to_held(Eigen::all, held) -= N * lu.inverse();
  }
  const Eigen::MatrixXd moved = to_held * drawn.asDiagonal();
  Eigen::MatrixXd P = moved * moved.transpose();
  for (const int i : held) {
    P.row(i).setZero();
    P.col(i).setZero();
  }
  return P;
}

}  // namespace viwo
