#include "update_faults.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <Eigen/Eigenvalues>

#include "findings.hpp"
#include "viwo/estimator/factor_fit.hpp"

namespace viwo::conformance {
namespace {

/// A NaN that no computation gives.
constexpr std::uint64_t kUntouched = 0x7ff8'5a5a'5a5a'5a5a;

template <class Matrix>
void mark(Matrix& matrix) {
  matrix.resize(Matrix::MaxRowsAtCompileTime, Matrix::MaxColsAtCompileTime);
  matrix.setConstant(std::bit_cast<double>(kUntouched));
  matrix.resize(0, Matrix::ColsAtCompileTime == 1 ? 1 : 0);
}

/// Whether the storage behind the last entry is written to; entries are packed.
template <class Matrix>
bool is_overrun(const Matrix& matrix) {
  const double* const rest = matrix.data() + matrix.size();
  return std::any_of(rest, matrix.data() + Matrix::MaxSizeAtCompileTime, [](double entry) {
    return std::bit_cast<std::uint64_t>(entry) != kUntouched;
  });
}

}  // namespace

void clear_and_mark(FactorSink& sink, int max_residual_factors) {
  sink.clear();
  for (int i = 0; i < max_residual_factors; ++i) {
    ResidualFactor& factor = sink.add_residual();
    mark(factor.H);
    mark(factor.residual);
    mark(factor.R);
  }
  sink.clear();
}

std::string overrun_of(const ResidualFactor& factor) {
  const std::string sizes = " - set_rows(" + std::to_string(factor.residual.size()) + "), for " +
                            std::to_string(factor.columns.size()) +
                            " columns, has made room for no more";
  if (is_overrun(factor.residual)) return "residual is written to behind its last row" + sizes;
  if (is_overrun(factor.R)) return "R is written to behind its last entry" + sizes;
  if (is_overrun(factor.H)) return "H is written to behind its last column" + sizes;
  return "";
}

std::string fault_of(const ResidualFactor& factor, int state_size, bool numbers_matter) {
  if (std::string misfit = misfit_of(factor, state_size); !misfit.empty()) return misfit;
  if (factor.columns.size() == 0) return "has no columns";
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
  if (std::string misfit = misfit_of(factor, state_size); !misfit.empty()) return misfit;
  if (factor.columns.size() == 0) return "has no columns";
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
