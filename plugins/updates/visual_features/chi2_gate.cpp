#include "chi2_gate.hpp"

#include <algorithm>
#include <limits>

#include <Eigen/Cholesky>

namespace viwo::visual {

void Chi2Gate::start(int max_clones, int n_cameras) {
  const int max_sights = max_clones * n_cameras;
  cameras_.resize(static_cast<std::size_t>(n_cameras));
  for (Camera& camera : cameras_) {
    camera.sights.reserve(static_cast<std::size_t>(max_clones));
    camera.E.setZero(2 * max_clones, kCalibrationRows);
  }
  P_kk_.resize(cameras_.size() * cameras_.size());
  P_xk_.resize(cameras_.size());
  for (auto& P : P_xk_) P.setZero(kPoseSize * max_clones, kCalibrationRows);
  S_.setZero(2 * max_sights, 2 * max_sights);
  T_.setZero(2 * max_clones, kCalibrationRows);
  M_.setZero(2 * max_clones, 2 * max_clones);
  rhs_.setZero(2 * max_sights, 7);
  L_inverse_.setZero(2 * max_sights, 2 * max_sights);
  M_of_noise_.setZero(2 * max_sights, 2 * max_sights);
  PHt_.setZero(kPoseSize * max_clones, 2);
}

double Chi2Gate::chi2(const Feature& feature, Window& window) {
  const auto& sights = feature.linear();
  const int n = static_cast<int>(sights.size());
  add_poses(feature, window);
  if (window.calibration_columns() > 0) {
    read_covariance(window);
    add_calibration(feature, window);
  }
  const Eigen::Matrix3d by_point = feature.met().by_point();
  for (int i = 0; i < n; ++i) {
    const LinearSight& sight = sights[static_cast<std::size_t>(i)];
    rhs_.block<2, 3>(2 * i, 0) = sight.H_f;
    rhs_.block<2, 3>(2 * i, 3).noalias() = sight.t_s * sight.H_f * by_point;
    rhs_.block<2, 1>(2 * i, 6) = sight.residual;
  }
  auto S = S_.topLeftCorner(2 * n, 2 * n);
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(S);
  if (llt.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  auto rhs = rhs_.topRows(2 * n);
  llt.matrixL().solveInPlace(rhs);
  // (VF-9), minimised as (VF-10)
  const TrackSums sums = rhs.transpose().lazyProduct(rhs);
  n_rows_ = 2 * n;
  return fit_.solve(sums, feature.information_of_rho()) ? fit_.chi2
                                                        : std::numeric_limits<double>::infinity();
}

void Chi2Gate::tell(NoiseScale& noise) {
  constexpr int kExplained = 6;  // by the point and its velocity
  const auto L = S_.topLeftCorner(n_rows_, n_rows_).triangularView<Eigen::Lower>();
  auto rhs = rhs_.topRows(n_rows_);
  // M = S^-1 - Q Q^T, what is outside of that: M r, tr M and tr M^2. Columns of Q one after the
  // other, each taken off the residual.
  L.transpose().solveInPlace(rhs);
  auto Q = rhs.leftCols<kExplained>();
  for (int k = 0; k < kExplained; ++k) {
    for (int i = 0; i < k; ++i) Q.col(k) -= fit_.L(k, i) * Q.col(i);
    Q.col(k) /= fit_.L(k, k);
    rhs.col(kExplained) -= fit_.L(kExplained, k) * Q.col(k);
  }
  auto L_inverse = L_inverse_.topLeftCorner(n_rows_, n_rows_);
  L_inverse.setIdentity();
  L.solveInPlace(L_inverse);
  auto M = M_of_noise_.topLeftCorner(n_rows_, n_rows_);
  auto lower = M.selfadjointView<Eigen::Lower>();
  M.setZero();
  lower.rankUpdate(L_inverse.transpose());
  lower.rankUpdate(Q, -1.);
  double information = M.diagonal().squaredNorm();
  for (int k = 0; k < n_rows_; ++k)
    information += 2. * M.col(k).tail(n_rows_ - k - 1).squaredNorm();
  const double variance = noise.variance();
  noise.add(variance * (1. + (rhs.col(kExplained).squaredNorm() - M.trace()) / information),
            information / static_cast<double>(n_rows_ - kExplained));
}

void Chi2Gate::add_poses(const Feature& feature, Window& window) {
  const Eigen::MatrixXd& P = window.covariance();
  const auto& sights = feature.linear();
  const int n = static_cast<int>(sights.size());
  const int n_clone_columns = sights.back().column + kPoseSize;
  for (int i = 0; i < n; ++i) {
    const LinearSight& a = sights[static_cast<std::size_t>(i)];
    // (VF-12): a sight has columns of one clone only, and clones come in the order of columns.
    const int m = n_clone_columns - a.column;
    auto PHt = PHt_.topRows(m);
    PHt.noalias() = P.block<Eigen::Dynamic, kPoseSize>(a.column, a.column, m, kPoseSize)
                        .lazyProduct(a.H_x.transpose());
    for (int j = i; j < n; ++j) {
      const LinearSight& b = sights[static_cast<std::size_t>(j)];
      S_.block<2, 2>(2 * j, 2 * i).noalias() =
          b.H_x.lazyProduct(PHt.middleRows<kPoseSize>(b.column - a.column));
    }
    S_(2 * i, 2 * i) += 1.;
    S_(2 * i + 1, 2 * i + 1) += 1.;
  }
}

void Chi2Gate::read_covariance(Window& window) {
  if (has_covariance_) return;
  has_covariance_ = true;
  const Eigen::MatrixXd& P = window.covariance();
  const int n_clone_columns = window.clone_columns();
  for (int b = 0; b < window.n_cameras(); ++b) {
    const auto& columns = window.camera(b).column;
    auto& P_xk = P_xk_[static_cast<std::size_t>(b)];
    P_xk.setZero();
    for (int k = 0; k < kCalibrationSize; ++k) {
      const int column = columns[static_cast<std::size_t>(k)];
      if (column >= 0) P_xk.col(k).head(n_clone_columns) = P.col(column).head(n_clone_columns);
    }
    for (int a = 0; a < window.n_cameras(); ++a) {
      auto& P_kk = P_kk_[pair(a, b)];
      P_kk.setZero();
      for (int i = 0; i < kCalibrationSize; ++i) {
        const int row = window.camera(a).column[static_cast<std::size_t>(i)];
        for (int k = 0; row >= 0 && k < kCalibrationSize; ++k) {
          const int column = columns[static_cast<std::size_t>(k)];
          if (column >= 0) P_kk(i, k) = P(row, column);
        }
      }
    }
  }
}

void Chi2Gate::add_calibration(const Feature& feature, const Window& window) {
  const auto& rows = feature.linear();
  for (Camera& camera : cameras_) camera.sights.clear();
  for (int i = 0; i < static_cast<int>(rows.size()); ++i) {
    const LinearSight& row = rows[static_cast<std::size_t>(i)];
    Camera& camera = cameras_[static_cast<std::size_t>(row.camera)];
    auto E = camera.E.middleRows<2>(2 * static_cast<int>(camera.sights.size()));
    if (window.camera(row.camera).calibrates()) {
      E = row.calibration.transpose();
    } else {
      E.setZero();
    }
    camera.sights.push_back(i);
  }
  for (int b = 0; b < window.n_cameras(); ++b) {
    if (!window.camera(b).calibrates() || cameras_[static_cast<std::size_t>(b)].sights.empty()) {
      continue;
    }
    for (int a = 0; a < window.n_cameras(); ++a) add_pair(feature, a, b);
  }
}

void Chi2Gate::add_pair(const Feature& feature, int a, int b) {
  const Camera& camera_a = cameras_[static_cast<std::size_t>(a)];
  const Camera& camera_b = cameras_[static_cast<std::size_t>(b)];
  const int n_a = static_cast<int>(camera_a.sights.size());
  const int n_b = static_cast<int>(camera_b.sights.size());
  if (n_a == 0) return;
  // (VF-13)
  auto T = T_.topRows(2 * n_a);
  T.noalias() = camera_a.E.topRows(2 * n_a) * (0.5 * P_kk_[pair(a, b)]);
  for (int i = 0; i < n_a; ++i) {
    const auto index = static_cast<std::size_t>(camera_a.sights[static_cast<std::size_t>(i)]);
    const LinearSight& row = feature.linear()[index];
    T.middleRows<2>(2 * i).noalias() +=
        row.H_x.lazyProduct(P_xk_[static_cast<std::size_t>(b)].middleRows<kPoseSize>(row.column));
  }
  auto M = M_.topLeftCorner(2 * n_a, 2 * n_b);
  M.noalias() = T * camera_b.E.topRows(2 * n_b).transpose();
  for (int j = 0; j < n_b; ++j) {
    const int at_b = 2 * camera_b.sights[static_cast<std::size_t>(j)];
    for (int i = 0; i < n_a; ++i) {
      const int at_a = 2 * camera_a.sights[static_cast<std::size_t>(i)];
      const auto block = M.block<2, 2>(2 * i, 2 * j);
      if (at_a >= at_b) S_.block<2, 2>(at_a, at_b) += block;
      if (at_a <= at_b) S_.block<2, 2>(at_b, at_a) += block.transpose();
    }
  }
}

}  // namespace viwo::visual
