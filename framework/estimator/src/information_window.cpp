#include "viwo/estimator/information_window.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>

namespace viwo {
namespace {

using Eigen::Index;

constexpr int kRows = kMaxFactorRows;
constexpr int kColumns = kMaxFactorColumns;
using RowsByRows =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kRows, kRows>;
using RowsByColumns =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kRows, kColumns>;
using ColumnsByRows =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kColumns, kRows>;

}  // namespace

InformationWindow::InformationWindow(int first_column, const Eigen::VectorXd& sigma,
                                     std::size_t bins)
    : first_column_(first_column) {
  for (Index i = 0; i < sigma.size(); ++i) {
    const bool held = !(sigma[i] > 0.);
    parameter_of_.push_back(held ? -1 : static_cast<int>(columns_.size()));
    if (!held) columns_.push_back(first_column + static_cast<int>(i));
  }
  if (columns_.size() > kMaxParameters || bins == 0) {
    throw std::invalid_argument("too many parameters, or no bin");
  }
  sigma_.resize(static_cast<Index>(columns_.size()));
  for (Index i = 0; i < sigma_.size(); ++i) {
    sigma_[i] = sigma[columns_[static_cast<std::size_t>(i)] - first_column];
  }
  measured_.setZero(sigma_.size(), sigma_.size());
  bins_.assign(bins, measured_);
  if (!columns_.empty()) solver_.compute(measured_);  // of which none may be asked
}

bool InformationWindow::measure(const ResidualFactor& factor, const Eigen::MatrixXd& P) {
  const Index rows = factor.residual.size();
  if (!factor.H.allFinite() || !factor.R.allFinite()) return false;
  // H in two parts: these parameters in units of their sigmas, and everything else.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kRows, kMaxParameters> H_c;
  H_c.setZero(rows, sigma_.size());
  RowsByColumns H_o = factor.H;
  bool any = false;
  Index col = 0;
  for (const ColumnRange& block : factor.columns.blocks()) {
    for (int i = 0; i < block.count; ++i, ++col) {
      const int parameter = parameter_of(block.first + i);
      if (parameter < 0) continue;
      any = true;
      H_c.col(parameter) = sigma_[parameter] * factor.H.col(col);
      H_o.col(col).setZero();
    }
  }
  if (!any) return false;
  RowsByRows S = factor.R;
  Index row_start = 0;
  for (const ColumnRange& left : factor.columns.blocks()) {
    const auto H_left = H_o.middleCols(row_start, left.count);
    row_start += left.count;
    if (H_left.isZero(0.)) continue;
    Index col_start = 0;
    for (const ColumnRange& right : factor.columns.blocks()) {
      const auto H_right = H_o.middleCols(col_start, right.count);
      col_start += right.count;
      if (H_right.isZero(0.)) continue;
      const ColumnsByRows PHt = P.block(left.first, right.first, left.count, right.count)
                                    .lazyProduct(H_right.transpose());
      S += H_left.lazyProduct(PHt);
    }
  }
  const Eigen::LLT<RowsByRows> llt(S);
  if (llt.info() != Eigen::Success) return false;
  llt.matrixL().solveInPlace(H_c);
  measured_ = H_c.transpose().lazyProduct(H_c);
  return measured_.allFinite();
}

bool InformationWindow::measure(const InformationFactor& factor) {
  measured_.setZero();
  bool any = false;
  int row = 0;
  for (const ColumnRange& rows : factor.columns.blocks()) {
    for (int i = 0; i < rows.count; ++i, ++row) {
      const int left = parameter_of(rows.first + i);
      if (left < 0) continue;
      any = true;
      int col = 0;
      for (const ColumnRange& cols : factor.columns.blocks()) {
        for (int k = 0; k < cols.count; ++k, ++col) {
          const int right = parameter_of(cols.first + k);
          if (right < 0) continue;
          measured_(left, right) =
              sigma_[left] * sigma_[right] * factor.Lambda(std::max(row, col), std::min(row, col));
        }
      }
    }
  }
  return any && measured_.allFinite();
}

void InformationWindow::next_bin() {
  bin_ = (bin_ + 1) % bins_.size();
  bins_[bin_].setZero();
}

void InformationWindow::decompose(const Vector& believed) {
  Matrix sum = bins_.front();
  for (std::size_t i = 1; i < bins_.size(); ++i) sum += bins_[i];
  const Vector scale = believed.cwiseSqrt();
  sum = scale.asDiagonal() * sum * scale.asDiagonal();
  solver_.compute(sum);
}

double InformationWindow::sigma_ratio(Index parameter) const {
  double variance = 0.;
  for (Index k = 0; k < information().size(); ++k) {
    const double along = directions()(parameter, k);
    variance += along * along / (1. + std::max(information()[k], 0.));
  }
  return std::sqrt(variance);
}

}  // namespace viwo
