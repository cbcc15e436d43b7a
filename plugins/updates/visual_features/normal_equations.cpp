#include "normal_equations.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

namespace viwo::visual {
namespace {

/// A pivot below this part of the trace: the point is not determined within double precision.
constexpr double kSmallestPivot = 1e-12;
/// Bytes of W at once; Eigen takes work space of up to 128 KiB from the stack.
constexpr int kWaitingBytes = 64 * 1024;
constexpr int kMaxWaiting = 96;

/// Cholesky factor of a 3 x 3 matrix; false when a pivot is too small.
bool cholesky(const Eigen::Matrix3d& A, Eigen::Matrix3d& L) {
  const double limit = kSmallestPivot * A.trace();
  L.setZero();
  for (int j = 0; j < 3; ++j) {
    double pivot = A(j, j);
    for (int k = 0; k < j; ++k) pivot -= L(j, k) * L(j, k);
    if (!(pivot > limit)) return false;
    L(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < 3; ++i) {
      double sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = sum / L(j, j);
    }
  }
  return true;
}

}  // namespace

void NormalEquations::start(int max_columns, int max_calibration, int max_sights) {
  const int fitting = kWaitingBytes / (static_cast<int>(sizeof(double)) * max_columns);
  max_waiting_ = kPointSize * std::clamp(fitting / kPointSize, 1, kMaxWaiting / kPointSize);
  W_.setZero(max_columns, max_waiting_);
  y_.setZero(max_waiting_);
  n_waiting_ = 0;
  const int rows = 2 * max_sights;
  S_.setZero(rows, rows);
  rhs_.setZero(rows, 4);
  PHt_.setZero(max_columns, 2);
  E_.setZero(rows, max_calibration);
  T_.setZero(rows, max_calibration);
}

bool NormalEquations::prepare(const Feature& feature) {
  Eigen::Matrix3d A_ff = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b_f = Eigen::Vector3d::Zero();
  double rr = 0.;
  for (const LinearSight& row : feature.linear()) {
    A_ff.noalias() += row.H_f.transpose() * row.H_f;
    b_f.noalias() += row.H_f.transpose() * row.residual;
    rr += row.residual.squaredNorm();
  }
  if (!cholesky(A_ff, L_ff_)) return false;
  y_f_ = L_ff_.triangularView<Eigen::Lower>().solve(b_f);
  chi2_bound_ = std::max(0., rr - y_f_.squaredNorm());  // (VF-11)
  return std::isfinite(rr) && y_f_.allFinite();
}

void NormalEquations::calibration_rows(const LinearSight& row, const WindowCamera& camera, int at,
                                       int columns) {
  auto E = E_.block(at, 0, 2, columns);
  E.setZero();
  if (camera.extrinsics >= 0) E.middleCols<kPoseSize>(camera.extrinsics) = row.H_extrinsics;
  if (camera.intrinsics >= 0) E.middleCols<8>(camera.intrinsics) = row.H_intrinsics;
}

double NormalEquations::chi2(const Feature& feature, Window& window) {
  const Eigen::MatrixXd& P = window.covariance();
  const auto& sights = feature.linear();
  const int n = static_cast<int>(sights.size());
  const int n_clone_columns = sights.back().column + kPoseSize;
  const int first_calibration = window.clone_columns();
  const int n_calibration = window.calibration_columns();
  auto S = S_.topLeftCorner(2 * n, 2 * n);
  for (int i = 0; i < n; ++i) {
    const LinearSight& a = sights[static_cast<std::size_t>(i)];
    // (VF-12): a sight has columns of one clone only, and clones come in the order of columns.
    const int m = n_clone_columns - a.column;
    auto PHt = PHt_.topRows(m);
    PHt.noalias() = P.block<Eigen::Dynamic, kPoseSize>(a.column, a.column, m, kPoseSize)
                        .lazyProduct(a.H_x.transpose());
    for (int j = i; j < n; ++j) {
      const LinearSight& b = sights[static_cast<std::size_t>(j)];
      S.block<2, 2>(2 * j, 2 * i).noalias() =
          b.H_x.lazyProduct(PHt.middleRows<kPoseSize>(b.column - a.column));
    }
    S(2 * i, 2 * i) += 1.;
    S(2 * i + 1, 2 * i + 1) += 1.;
    rhs_.block<2, 1>(2 * i, 0) = a.residual;
    rhs_.block<2, 3>(2 * i, 1) = a.H_f;
    if (n_calibration > 0) {
      calibration_rows(a, window.camera(a.camera), 2 * i, n_calibration);
      T_.block(2 * i, 0, 2, n_calibration).noalias() =
          a.H_x.lazyProduct(P.block(a.column, first_calibration, kPoseSize, n_calibration));
    }
  }
  if (n_calibration > 0) {
    // (VF-13): H P H^T = H_x P_xx H_x^T + T E^T + E T^T, T = H_x P_xk + E P_kk / 2.
    const auto E = E_.topLeftCorner(2 * n, n_calibration);
    auto T = T_.topLeftCorner(2 * n, n_calibration);
    T.noalias() += 0.5 * (E.lazyProduct(P.block(first_calibration, first_calibration, n_calibration,
                                                n_calibration)));
    S.triangularView<Eigen::Lower>() += T.lazyProduct(E.transpose());
    S.triangularView<Eigen::Lower>() += E.lazyProduct(T.transpose());
  }
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(S);
  if (llt.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  auto rhs = rhs_.topRows(2 * n);
  llt.matrixL().solveInPlace(rhs);
  // (VF-9), minimised as (VF-10)
  const Eigen::Matrix4d G = rhs.transpose().lazyProduct(rhs);
  Eigen::Matrix3d L;
  if (!cholesky(G.bottomRightCorner<3, 3>(), L)) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d y =
      L.triangularView<Eigen::Lower>().solve(Eigen::Vector3d(G.bottomLeftCorner<3, 1>()));
  return std::max(0., G(0, 0) - y.squaredNorm());
}

void NormalEquations::begin(const Window& window, InformationFactor& factor) {
  factor.columns = window.columns();
  const int size = window.size();
  factor.Lambda.topLeftCorner(size, size).setZero();
  factor.eta.head(size).setZero();
  n_waiting_ = 0;
}

void NormalEquations::add(const Feature& feature, const Window& window, InformationFactor& factor) {
  if (n_waiting_ + kPointSize > max_waiting_) finish(factor);
  auto W = W_.block<Eigen::Dynamic, kPointSize>(0, n_waiting_, window.size(), kPointSize);
  W.setZero();
  for (const LinearSight& row : feature.linear()) {  // (VF-7)
    const int c = row.column;
    factor.Lambda.block<kPoseSize, kPoseSize>(c, c).noalias() += row.H_x.transpose() * row.H_x;
    factor.eta.segment<kPoseSize>(c).noalias() += row.H_x.transpose() * row.residual;
    W.middleRows<kPoseSize>(c).noalias() += row.H_x.transpose() * row.H_f;
  }
  if (window.calibration_columns() > 0) add_calibration(feature, window, factor, n_waiting_);
  // W = A_xf L^-T, column after column.
  W.col(0) /= L_ff_(0, 0);
  W.col(1) = (W.col(1) - L_ff_(1, 0) * W.col(0)) / L_ff_(1, 1);
  W.col(2) = (W.col(2) - L_ff_(2, 0) * W.col(0) - L_ff_(2, 1) * W.col(1)) / L_ff_(2, 2);
  y_.segment<kPointSize>(n_waiting_) = y_f_;
  n_waiting_ += kPointSize;
}

void NormalEquations::add_calibration(const Feature& feature, const Window& window,
                                      InformationFactor& factor, int waiting_column) {
  const int first = window.clone_columns();
  const int columns = window.calibration_columns();
  for (const LinearSight& row : feature.linear()) {
    calibration_rows(row, window.camera(row.camera), 0, columns);
    const auto E = E_.topLeftCorner(2, columns);
    factor.Lambda.block(first, row.column, columns, kPoseSize).noalias() +=
        E.transpose().lazyProduct(row.H_x);
    factor.Lambda.block(first, first, columns, columns).noalias() += E.transpose().lazyProduct(E);
    factor.eta.segment(first, columns).noalias() += E.transpose().lazyProduct(row.residual);
    W_.block(first, waiting_column, columns, kPointSize).noalias() +=
        E.transpose().lazyProduct(row.H_f);
  }
}

void NormalEquations::finish(InformationFactor& factor) {
  if (n_waiting_ == 0) return;
  const int size = factor.columns.size();
  const auto W = W_.topLeftCorner(size, n_waiting_);
  // (VF-8)
  factor.Lambda.topLeftCorner(size, size).selfadjointView<Eigen::Lower>().rankUpdate(W, -1.);
  factor.eta.head(size).noalias() -= W * y_.head(n_waiting_);
  n_waiting_ = 0;
}

}  // namespace viwo::visual
