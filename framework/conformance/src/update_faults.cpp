#include "update_faults.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>

#include "findings.hpp"

namespace viwo::conformance {

std::string fault_of(const FactorColumns& columns, int state_size) {
  std::vector<bool> taken(static_cast<std::size_t>(state_size), false);
  for (const ColumnRange& block : columns.blocks()) {
    const std::string text = "columns " + std::to_string(block.first) + " to " +
                             std::to_string(block.first + block.count - 1);
    if (block.first < 0 || block.count < 1 || block.first + block.count > state_size) {
      return text + " are not in the state of " + std::to_string(state_size);
    }
    for (int i = block.first; i < block.first + block.count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (taken[k]) return text + " overlap another block (column " + std::to_string(i) + ")";
      taken[k] = true;
    }
  }
  return columns.size() == 0 ? "has no columns" : "";
}

std::string fault_of(const ResidualFactor& factor, int state_size, bool numbers_matter) {
  const std::string columns = fault_of(factor.columns, state_size);
  if (!columns.empty()) return columns;
  const auto rows = factor.residual.size();
  if (factor.H.rows() != rows || factor.R.rows() != rows || factor.R.cols() != rows ||
      factor.H.cols() != factor.columns.size()) {
    return "H is " + std::to_string(factor.H.rows()) + " x " + std::to_string(factor.H.cols()) +
           " for " + std::to_string(rows) + " residuals and " +
           std::to_string(factor.columns.size()) + " columns - call set_rows() after the columns";
  }
  if (!numbers_matter) return "";
  if (!factor.H.allFinite()) return "H has entries that are not finite";
  if (!factor.residual.allFinite()) return "residual has entries that are not finite";
  if (!factor.R.allFinite()) return "R has entries that are not finite";
  const Eigen::MatrixXd R = factor.R;
  const double off = (R - R.transpose()).cwiseAbs().maxCoeff();
  if (off > 1e-9 * R.cwiseAbs().maxCoeff()) {
    return "R is not symmetric (by up to " + number(off) + ")";
  }
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(R).eigenvalues()[0];
  if (!(least > 0.)) return "R is not positive definite (eigenvalue " + number(least) + ")";
  if (!(factor.gate_probability >= 0. && factor.gate_probability < 1.)) {
    return "gate_probability is " + number(factor.gate_probability);
  }
  return "";
}

std::string fault_of(const InformationFactor& factor, int state_size, bool numbers_matter) {
  const std::string columns = fault_of(factor.columns, state_size);
  if (!columns.empty()) return columns;
  if (!numbers_matter) return "";
  const int n = factor.columns.size();
  Eigen::MatrixXd Lambda = factor.Lambda.topLeftCorner(n, n).triangularView<Eigen::Lower>();
  Lambda = Eigen::MatrixXd(Lambda.selfadjointView<Eigen::Lower>());
  if (!Lambda.allFinite()) return "Lambda has entries that are not finite";
  if (!factor.eta.head(n).allFinite()) return "eta has entries that are not finite";
  const auto values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(Lambda).eigenvalues();
  // What is left of a Schur complement has half of the digits.
  if (values[0] < -1e-8 * std::max(values[n - 1], 1e-12)) {
    return "Lambda is not positive semidefinite (eigenvalue " + number(values[0]) + ")";
  }
  return "";
}

std::string fault_of(const AddedBlock& block, const FilterView& filter, const FactorSink& sink,
                     bool numbers_matter) {
  const BlockView& view = filter.block(block.id);
  const InformationFactor* const information = sink.information();
  const auto has = [&](int column) {
    const auto blocks = information->columns.blocks();
    return std::any_of(blocks.begin(), blocks.end(), [column](const ColumnRange& range) {
      return column >= range.first && column < range.first + range.count;
    });
  };
  for (int i = 0; i < view.size(); ++i) {
    if (information == nullptr || !has(view.column() + i)) {
      return "is not in the information factor of that call - it exists by what the factor says "
             "of it";
    }
    if (numbers_matter && !std::isfinite(block.value[static_cast<std::size_t>(i)])) {
      return "has a value that is not finite";
    }
  }
  return "";
}

}  // namespace viwo::conformance
