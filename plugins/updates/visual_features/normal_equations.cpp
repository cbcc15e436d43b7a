#include "normal_equations.hpp"

#include <algorithm>
#include <cmath>

#include "cholesky3.hpp"

namespace viwo::visual {
namespace {

/// Bytes of W at once; Eigen takes work space of up to 128 KiB from the stack.
constexpr int kWaitingBytes = 64 * 1024;
constexpr int kMaxWaiting = 96;

}  // namespace

void NormalEquations::start(int max_clones, int n_cameras) {
  const int max_columns = kPoseSize * max_clones + kCalibrationSize * n_cameras;
  const int usual_columns = max_columns - n_cameras;  // cameras share a clock
  const int fitting = kWaitingBytes / (static_cast<int>(sizeof(double)) * usual_columns);
  max_waiting_ = kPointSize * std::clamp(fitting / kPointSize, 1, kMaxWaiting / kPointSize);
  W_.setZero(max_columns, max_waiting_);
  y_.setZero(max_waiting_);
  n_waiting_ = 0;
  calibration_.start(max_clones, n_cameras);
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

void NormalEquations::begin(const Window& window, InformationFactor& factor) {
  factor.columns = window.columns();
  const int size = window.size();
  factor.Lambda.topLeftCorner(size, size).setZero();
  factor.eta.head(size).setZero();
  n_waiting_ = 0;
  calibration_.begin(window);
}

void NormalEquations::add(const Feature& feature, const Window& window, InformationFactor& factor) {
  if (n_waiting_ + kPointSize > max_waiting_) subtract_waiting(window.size(), factor);
  auto W = W_.block<Eigen::Dynamic, kPointSize>(0, n_waiting_, window.size(), kPointSize);
  W.setZero();
  for (const LinearSight& row : feature.linear()) {  // (VF-7)
    const int c = row.column;
    factor.Lambda.block<kPoseSize, kPoseSize>(c, c).noalias() += row.H_x.transpose() * row.H_x;
    factor.eta.segment<kPoseSize>(c).noalias() += row.H_x.transpose() * row.residual;
    W.middleRows<kPoseSize>(c).noalias() += row.H_x.transpose() * row.H_f;
  }
  if (window.calibration_columns() > 0) calibration_.add(feature, window, W);
  // W = A_xf L^-T, column after column.
  W.col(0) /= L_ff_(0, 0);
  W.col(1) = (W.col(1) - L_ff_(1, 0) * W.col(0)) / L_ff_(1, 1);
  W.col(2) = (W.col(2) - L_ff_(2, 0) * W.col(0) - L_ff_(2, 1) * W.col(1)) / L_ff_(2, 2);
  y_.segment<kPointSize>(n_waiting_) = y_f_;
  n_waiting_ += kPointSize;
}

void NormalEquations::subtract_waiting(int size, InformationFactor& factor) {
  if (n_waiting_ == 0) return;
  const auto W = W_.topLeftCorner(size, n_waiting_);
  // (VF-8)
  factor.Lambda.topLeftCorner(size, size).selfadjointView<Eigen::Lower>().rankUpdate(W, -1.);
  factor.eta.head(size).noalias() -= W * y_.head(n_waiting_);
  n_waiting_ = 0;
}

void NormalEquations::finish(const Window& window, InformationFactor& factor) {
  subtract_waiting(window.size(), factor);
  if (window.calibration_columns() > 0) calibration_.finish(window, factor);
}

}  // namespace viwo::visual
