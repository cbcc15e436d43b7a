#include "viwo/observability/observability_matrix.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

constexpr int kBufferedRows = 256;
/// Eigenvalues of normal equations below this part of the largest one are rounding.
constexpr double kRounding = 1e-13;

int first_calibration_column(const Filter& filter) {
  return kImuSize + kPoseSize * (filter.options().clones + 1);
}

}  // namespace

ObservabilityMatrix::ObservabilityMatrix(const Filter& filter, const FeatureOptions& feature)
    : feature_(feature),
      start_(filter.imu()),
      column_of_(static_cast<std::size_t>(filter.size()), -1),
      clone_Phi_(static_cast<std::size_t>(filter.options().clones) + 1) {
  const auto& P = filter.covariance();
  int next = kImuSize;
  for (int i = 0; i < kImuSize; ++i) column_of_[static_cast<std::size_t>(i)] = i;
  for (int i = first_calibration_column(filter); i < filter.size(); ++i) {
    if (!(P(i, i) > 0.)) continue;
    calibration_.push_back(i);
    column_of_[static_cast<std::size_t>(i)] = next++;
  }
  prior_sigma_ = Eigen::VectorXd::Ones(next + (feature_.enabled ? 3 : 0));
  prior_sigma_.head<kImuSize>() = P.diagonal().head<kImuSize>().cwiseSqrt();
  for (std::size_t k = 0; k < calibration_.size(); ++k) {
    prior_sigma_[kImuSize + static_cast<int>(k)] = std::sqrt(P(calibration_[k], calibration_[k]));
  }
  is_in_room_.resize(column_of_.size(), false);
  const auto blocks = filter.blocks().views();
  for (const BlockView& block : blocks.subspan(filter.blocks().specs().size())) {
    for (int i = 0; i < block.size(); ++i) {
      is_in_room_[static_cast<std::size_t>(block.column() + i)] = true;
    }
  }
  p_FinG_ = filter.imu().p_IinG + filter.imu().R_GtoI.transpose() * feature_.p_FinI_m;
  rows_.setZero(size() + kBufferedRows, size());
  n_rows_ = 0;
}

void ObservabilityMatrix::on_clone(const Filter& filter, const ImuMatrix& Phi) {
  Phi_ = (Phi * Phi_).eval();
  const CloneState& clone = filter.clones().back();
  clone_Phi_[static_cast<std::size_t>(clone.slot)] = Phi_.topRows<kPoseSize>();
  if (feature_.enabled) add_bearing(clone);
}

void ObservabilityMatrix::add_bearing(const CloneState& clone) {
  const Eigen::Vector3d p_FinI = clone.R_GtoI_fej * (p_FinG_ - clone.p_IinG_fej);
  const double distance = p_FinI.norm();
  Eigen::Matrix3d along;  // a right-handed frame whose first axis is the bearing
  along.col(0) = p_FinI / distance;
  along.col(1) = along.col(0).unitOrthogonal();
  along.col(2) = along.col(0).cross(along.col(1));
  const Eigen::Matrix<double, 2, 3> across =
      along.rightCols<2>().transpose() / (distance * feature_.sigma_bearing_rad);
  Eigen::Matrix<double, 3, kPoseSize> by_pose;  // (OB-4)
  by_pose << skew(p_FinI), -clone.R_GtoI_fej;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, size());
  rows.leftCols<kImuSize>() = across * by_pose * clone_Phi_[static_cast<std::size_t>(clone.slot)];
  rows.rightCols<3>() = across * clone.R_GtoI_fej;
  add_rows(rows);
}

/// (OB-2).
void ObservabilityMatrix::set_carry(const FactorColumns& columns) {
  carry_.setZero(columns.size(), size());
  int row = 0;
  for (const ColumnRange& block : columns.blocks()) {
    for (int i = 0; i < block.count; ++i, ++row) {
      const int column = block.first + i;
      const int of_clones = column - kImuSize;
      const int slot = of_clones / kPoseSize;
      if (of_clones >= 0 && slot < static_cast<int>(clone_Phi_.size())) {
        carry_.row(row).head<kImuSize>() =
            clone_Phi_[static_cast<std::size_t>(slot)].row(of_clones % kPoseSize);
      } else if (column < kImuSize) {
        carry_.row(row).head<kImuSize>() = Phi_.row(column);
      } else if (const int own = column_of_[static_cast<std::size_t>(column)]; own >= 0) {
        carry_(row, own) = 1.;
      }
    }
  }
}

void ObservabilityMatrix::on_factor(const Filter& /*filter*/, const UpdateEntry& /*update*/,
                                    const ResidualFactor& factor) {
  const Eigen::MatrixXd R = factor.R;
  const Eigen::LLT<Eigen::MatrixXd> llt(R);
  if (llt.info() != Eigen::Success || !factor.H.allFinite()) return;
  const Eigen::MatrixXd H = factor.H;
  add_factor(factor.columns, llt.matrixL().solve(H));
}

void ObservabilityMatrix::on_factor(const Filter& /*filter*/, const UpdateEntry& /*update*/,
                                    const InformationFactor& factor) {
  const int n = factor.columns.size();
  if (n == 0) return;
  // (OB-3). Square roots are taken in units in which the columns are comparable.
  Eigen::VectorXd unit = Eigen::VectorXd::Ones(n);
  for (int i = 0; i < n; ++i) {
    const double diagonal = factor.Lambda(i, i);
    if (diagonal > 0.) unit[i] = 1. / std::sqrt(diagonal);
  }
  const Eigen::MatrixXd Lambda = factor.Lambda.topLeftCorner(n, n).selfadjointView<Eigen::Lower>();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit.asDiagonal() * Lambda *
                                                             unit.asDiagonal());
  int dropped = 0;
  while (dropped < n && !(eigen.eigenvalues()[dropped] > kRounding * eigen.eigenvalues()[n - 1])) {
    ++dropped;
  }
  if (dropped == n) return;
  const int kept = n - dropped;
  add_factor(factor.columns, eigen.eigenvalues().tail(kept).cwiseSqrt().asDiagonal() *
                                 eigen.eigenvectors().rightCols(kept).transpose() *
                                 unit.cwiseInverse().asDiagonal());
}

void ObservabilityMatrix::add_factor(const FactorColumns& columns, const Eigen::MatrixXd& rows) {
  set_carry(columns);
  std::vector<int> unknown;
  int k = 0;
  for (const ColumnRange& block : columns.blocks()) {
    for (int i = 0; i < block.count; ++i, ++k) {
      if (is_in_room_[static_cast<std::size_t>(block.first + i)]) unknown.push_back(k);
    }
  }
  if (unknown.empty()) return add_rows(rows * carry_);
  // What comes and goes is not in the analysed state: the rows that its values do not enter.
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows(Eigen::all, unknown));
  const Eigen::MatrixXd turned = qr.householderQ().adjoint() * (rows * carry_);
  add_rows(turned.bottomRows(rows.rows() - qr.rank()));
}

void ObservabilityMatrix::add_rows(const Eigen::MatrixXd& rows) {
  for (int i = 0; i < rows.rows(); ++i) {
    if (n_rows_ == rows_.rows()) compress();
    rows_.row(n_rows_++) = rows.row(i);
  }
}

void ObservabilityMatrix::compress() {
  const int n = size();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rows_.topRows(n_rows_));
  const int kept = std::min(n_rows_, n);
  const Eigen::MatrixXd R = qr.matrixQR().topRows(kept).triangularView<Eigen::Upper>();
  rows_.setZero();
  rows_.topRows(kept) = R;
  n_rows_ = n;
}

Eigen::MatrixXd ObservabilityMatrix::triangle() {
  compress();
  return rows_.topRows(size());
}

}  // namespace viwo
