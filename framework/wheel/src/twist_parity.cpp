// What the parity residual of a sample tells about the intrinsics: the second half of TwistSolver.
#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "pieces.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {
TwistSolver::Parity TwistSolver::parity() {
  Parity parity;
  if (options_.noise_weighted && weighted_.rank == 3) {
    parity.fit_ = weighted_;
    parity.chi2_ = weighted_chi2_;
  } else {
    parity.fit_.resize(model_->n_rows());
    parity.chi2_ = fit_weighted(kWeightedRankTolerance, parity.fit_);
  }
  parity.dof_ = model_->n_rows() - n_left_out_ - parity.fit_.rank;
  return parity;
}

void TwistSolver::add_parity(const Parity& parity, double weight, ParityInformation& out) {
  const Fit& fit = parity.fit_;
  differentiate_fitted(moves(fit.xi, fit.M_inv.topRows<3>()) ? fit.xi : Twist::Zero(), fit.e);
  with_block_size(model_->description().noise_block, [&](auto size) {
    constexpr int kSize = decltype(size)::value;
    weigh_jacobian<kSize>();
    add_information<kSize>(fit, weight, out.Lambda, out.eta);
  });
  out.chi2 += weight * parity.chi2();
  out.dof += weight * parity.dof();
}

/// (W-17): three twists that are as large as the noise is.
void TwistSolver::add_parity_of_noise(const Parity& parity, ParityInformation& out) {
  const Fit& fit = parity.fit_;
  const Eigen::Matrix3d P = fit.M_inv.topRows<3>();
  if (!moves(fit.xi, P)) return;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(P);
  Intrinsics no_eta = Intrinsics::Zero(out.eta.size());
  for (int i = 0; i < 3; ++i) {
    const double sigma = std::sqrt(std::max(0., eigen.eigenvalues()[i]));
    differentiate_fitted(sigma * eigen.eigenvectors().col(i), no_residual_);
    with_block_size(model_->description().noise_block, [&](auto size) {
      constexpr int kSize = decltype(size)::value;
      weigh_jacobian<kSize>();
      add_information<kSize>(fit, 1., out.of_noise, no_eta);
    });
  }
}

/// W J: of each column the rows of the noise blocks that it touches.
template <int kSize>
void TwistSolver::weigh_jacobian() {
  const int size = block_size<kSize>();
  const int n = model_->n_intrinsics();
  for (int k = 0; k < n; ++k) {
    const RowRange rows = intrinsic_rows_[static_cast<std::size_t>(k)];
    const double* J = by_x_.J.col(k).data();
    for (int i0 = rows.first; i0 < rows.first + rows.count; i0 += size) {
      for (int i = i0; i < i0 + size; ++i) {
        double WJ = 0.;
        for (int l = 0; l < size; ++l) WJ += W_(l, i) * J[i0 + l];
        WJ_(i, k) = WJ;
      }
    }
  }
}

/// (W-10) as Lambda += J^T G with G = W J - W A (A^T W A)^-1 V, V = A^T W J; eta += J^T W e.
template <int kSize>
void TwistSolver::add_information(const Fit& fit, double weight, IntrinsicMatrix& Lambda,
                                  Intrinsics& eta) const {
  const int size = block_size<kSize>();
  const int m = model_->n_rows();
  const int n = model_->n_intrinsics();
  Eigen::Matrix<double, 4, kMaxRows> U;  // (A^T W A)^-1 A^T W
  for (int i = 0; i < m; ++i) U.col(i) = fit.M_inv * fit.WA.col(i).head<3>();
  in_pieces(n, [&](int first, auto width) {
    constexpr int kWidth = decltype(width)::value;
    using Piece = Eigen::Matrix<double, kWidth, 1>;
    Piece v0 = Piece::Zero(), v1 = Piece::Zero(), v2 = Piece::Zero(), We = Piece::Zero();
    for (int i = 0; i < m; ++i) {
      const Piece WJ = weight * WJ_.row(i).segment<kWidth>(first);
      v0 += rows_.A(i, 0) * WJ;
      v1 += rows_.A(i, 1) * WJ;
      v2 += rows_.A(i, 2) * WJ;
      We += fit.e[i] * WJ;
    }
    eta.segment<kWidth>(first) += We;
    std::array<Piece, kMaxRows> G;  // its rows, of these columns
    for (int i = 0; i < m; ++i) {
      G[static_cast<std::size_t>(i)] = weight * WJ_.row(i).segment<kWidth>(first).transpose() -
                                       (U(0, i) * v0 + U(1, i) * v1 + U(2, i) * v2);
    }
    for (int k = 0; k < n; ++k) {
      const RowRange rows = intrinsic_rows_[static_cast<std::size_t>(k)];
      const double* J = by_x_.J.col(k).data();
      Piece sum = Lambda.col(k).segment<kWidth>(first);
      for (int i0 = rows.first; i0 < rows.first + rows.count; i0 += size) {
        for (int i = i0; i < i0 + size; ++i) sum += J[i] * G[static_cast<std::size_t>(i)];
      }
      Lambda.col(k).segment<kWidth>(first) = sum;
    }
  });
}

}  // namespace viwo
