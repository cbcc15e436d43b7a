#include "viwo/wheel/held_gauge.hpp"

#include <iterator>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "viwo/math/se2.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

std::vector<int> held_by_gauge(const WheelModel& model) {
  std::vector<int> held;
  for (int i = 0; i < model.n_intrinsics(); ++i) {
    if (model.description().intrinsics[static_cast<std::size_t>(i)].gauge_fixed) held.push_back(i);
  }
  return held;
}

/// How intrinsics and mount change with the frame; directions in which it cannot be moved are left
/// out.
Eigen::MatrixXd by_frame(const WheelModel& model, const Intrinsics& x_WI,
                         const Eigen::Ref<const Eigen::MatrixXd>& mount) {
  Eigen::MatrixXd N(x_WI.size() + mount.rows(), 0);
  for (int k = 0; k < 3; ++k) {
    const std::optional<Intrinsics> of_wheels = intrinsics_by_frame(model, x_WI, k);
    if (!of_wheels) continue;
    N.conservativeResize(Eigen::NoChange, N.cols() + 1);
    N.rightCols<1>() << *of_wheels, mount.col(k);
  }
  return N;
}

}  // namespace

std::optional<Intrinsics> intrinsics_by_frame(const WheelModel& model, const Intrinsics& x_WI,
                                              int k) {
  constexpr double kStep = 1e-5;
  const Eigen::Vector3d g = kStep * Eigen::Vector3d::Unit(k);
  Intrinsics ahead = x_WI, behind = x_WI;
  if (model.model().move_frame(g, ahead) != Status::kOk ||
      model.model().move_frame(-g, behind) != Status::kOk) {
    return std::nullopt;
  }
  return (ahead - behind) / (2. * kStep);
}

bool move_to_held_gauge(const WheelModel& model, const Intrinsics& held, WheelsView& truth) {
  const std::vector<int> gauge = held_by_gauge(model);
  if (gauge.empty()) return false;
  // g = [yaw, x, y] of the new frame in the old one such that the held entries agree.
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  Intrinsics moved = truth.x_WI;
  const auto off = [&] { return (moved(gauge) - held(gauge)).eval(); };
  for (int iteration = 0; iteration < 20 && !(off().norm() < 1e-13); ++iteration) {
    // In the place of a mount: the directions in which the frame can be moved.
    const Eigen::MatrixXd N = by_frame(model, moved, Eigen::Matrix3d::Identity());
    if (N.cols() != std::ssize(gauge)) return false;
    const Eigen::Vector3d step = -N.bottomRows<3>() * N(gauge, Eigen::all).fullPivLu().solve(off());
    g = compose(g, step);
    moved = truth.x_WI;
    if (model.model().move_frame(g, moved) != Status::kOk) return false;
  }
  if (!(off().norm() < 1e-9)) return false;
  for (const int i : gauge) moved[i] = held[i];  // not off by rounding
  const Eigen::Matrix3d back = exp_so3({0., 0., -g[0]});
  truth.x_WI = moved;
  truth.R_ItoO = back * truth.R_ItoO;
  truth.p_IinO = back * (truth.p_IinO - Eigen::Vector3d(g[1], g[2], 0.));
  return true;
}

MountKnowledge known_of_body(const Eigen::Vector3d& E, const Eigen::Vector3d& sigma) {
  MountKnowledge out{Eigen::MatrixXd::Zero(3, 3), sigma};
  out.by_frame(2, 0) = 1.;
  out.by_frame.topRightCorner<2, 2>() = Eigen::Rotation2Dd(E[2]).toRotationMatrix();
  return out;
}

MountKnowledge known_of_imu(const Eigen::Vector3d& p_IinO,
                            const Eigen::Matrix<double, 6, 1>& sigma) {
  // (F-43)
  MountKnowledge out{Eigen::MatrixXd::Zero(6, 3), sigma};
  out.by_frame(2, 0) = 1.;
  out.by_frame.middleRows<2>(3) << p_IinO.y(), -1., 0., -p_IinO.x(), 0., -1.;
  return out;
}

Eigen::MatrixXd prior_in_held_frame(const WheelModel& model, const Intrinsics& x_WI,
                                    const Intrinsics& sigma, const MountKnowledge& mount) {
  const std::vector<int> held = held_by_gauge(model);
  Eigen::MatrixXd mount_by_frame = mount.by_frame;
  for (Eigen::Index i = 0; i < mount.sigma.size(); ++i) {
    if (mount.sigma[i] == 0.) mount_by_frame.row(i).setZero();
  }
  const Eigen::MatrixXd N = by_frame(model, x_WI, mount_by_frame);
  Eigen::VectorXd drawn(N.rows());
  drawn << sigma, mount.sigma;
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

Eigen::MatrixXd correlation_matrix(const Eigen::MatrixXd& P) {
  const Eigen::VectorXd sigma = P.diagonal().cwiseSqrt();
  const Eigen::VectorXd per = (sigma.array() > 0.).select(sigma.cwiseInverse(), 0.);
  Eigen::MatrixXd C = per.asDiagonal() * P * per.asDiagonal();
  C.diagonal().setOnes();
  return C;
}

}  // namespace viwo
