#include "viwo/estimator/factor_fit.hpp"

#include <span>

namespace viwo {
namespace {

std::string size_of(const auto& matrix) {
  return std::to_string(matrix.rows()) + " x " + std::to_string(matrix.cols());
}

}  // namespace

std::string misfit_of(const FactorColumns& columns, int state_size) {
  const std::span<const ColumnRange> blocks = columns.blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const ColumnRange& block = blocks[i];
    const auto text = [&] {
      return "columns " + std::to_string(block.first) + " to " +
             std::to_string(block.first + block.count - 1);
    };
    if (block.first > state_size - block.count) {
      return text() + " are not in the state of " + std::to_string(state_size);
    }
    for (const ColumnRange& other : blocks.first(i)) {
      if (block.first < other.first + other.count && other.first < block.first + block.count) {
        return text() + " overlap another block";
      }
    }
  }
  return "";
}

std::string misfit_of(const ResidualFactor& factor, int state_size) {
  if (std::string misfit = misfit_of(factor.columns, state_size); !misfit.empty()) return misfit;
  const Eigen::Index rows = factor.residual.size();
  if (factor.H.rows() == rows && factor.H.cols() == factor.columns.size() &&
      factor.R.rows() == rows && factor.R.cols() == rows) {
    return "";
  }
  return "H is " + size_of(factor.H) + " and R " + size_of(factor.R) + " for " +
         std::to_string(rows) + " residuals and " + std::to_string(factor.columns.size()) +
         " columns - call set_rows() after the columns";
}

std::string misfit_of(const InformationFactor& factor, int state_size) {
  if (std::string misfit = misfit_of(factor.columns, state_size); !misfit.empty()) return misfit;
  const int size = factor.columns.size();
  if (factor.Lambda.rows() >= size && factor.Lambda.cols() >= size && factor.eta.size() >= size) {
    return "";
  }
  return "Lambda is " + size_of(factor.Lambda) + " and eta " + std::to_string(factor.eta.size()) +
         " for " + std::to_string(size) + " columns";
}

}  // namespace viwo
