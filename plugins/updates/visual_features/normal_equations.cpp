#include "normal_equations.hpp"

#include <algorithm>
#include <cmath>

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
  TrackSums sums = TrackSums::Zero();
  for (const LinearSight& row : feature.linear()) {
    const Eigen::Matrix3d A = row.H_f.transpose() * row.H_f;
    const Eigen::Vector3d b = row.H_f.transpose() * row.residual;
    sums.block<3, 3>(0, 0) += A;
    sums.block<3, 3>(3, 0) += row.t_s * A;
    sums.block<3, 3>(3, 3) += row.t_s * row.t_s * A;
    sums.block<1, 3>(6, 0) += b.transpose();
    sums.block<1, 3>(6, 3) += row.t_s * b.transpose();
    sums(6, 6) += row.residual.squaredNorm();
  }
  const Eigen::Matrix3d D = feature.met().by_point();
  sums.block<3, 3>(3, 0) = (D.transpose() * sums.block<3, 3>(3, 0)).eval();
  sums.block<3, 3>(3, 3) = (D.transpose() * sums.block<3, 3>(3, 3) * D).eval();
  sums.block<1, 3>(6, 3) = (sums.block<1, 3>(6, 3) * D).eval();
  return fit_.solve(sums, feature.information_of_rho()) && fit_.L.allFinite() &&
         std::isfinite(fit_.chi2);  // (VF-11)
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
  const TrackSums& L = fit_.L;
  W.col(0) /= L(0, 0);
  W.col(1) = (W.col(1) - L(1, 0) * W.col(0)) / L(1, 1);
  W.col(2) = (W.col(2) - L(2, 0) * W.col(0) - L(2, 1) * W.col(1)) / L(2, 2);
  y_.segment<kPointSize>(n_waiting_) = fit_.y_f();
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
