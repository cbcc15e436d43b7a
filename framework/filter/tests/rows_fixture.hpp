// Rows of measurements on columns of a state, as an information factor and as a dense matrix.
#pragma once

#include <initializer_list>

#include <Eigen/Core>

#include "filter_fixture.hpp"
#include "viwo/api/update.hpp"

namespace viwo::testing {

/// Rows on some columns of a state.
struct Rows {
  FactorColumns columns;
  Eigen::MatrixXd H;  ///< of the columns
  Eigen::VectorXd r;

  Eigen::MatrixXd dense(Eigen::Index size) const {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(H.rows(), size);
    Eigen::Index start = 0;
    for (const ColumnRange& block : columns.blocks()) {
      out.middleCols(block.first, block.count) = H.middleCols(start, block.count);
      start += block.count;
    }
    return out;
  }
  /// As an update gives it: with room for all of the state, and the lower triangle only.
  InformationFactor factor(Eigen::Index size) const {
    InformationFactor out;
    out.columns = columns;
    const Eigen::Index n = columns.size();
    out.Lambda = Eigen::MatrixXd::Constant(size, size, kNaN);
    out.eta = Eigen::VectorXd::Constant(size, kNaN);
    out.Lambda.topLeftCorner(n, n).triangularView<Eigen::Lower>() = H.transpose() * H;
    out.eta.head(n) = H.transpose() * r;
    return out;
  }
};

inline Rows random_rows(Random& random, Eigen::Index rows,
                        std::initializer_list<ColumnRange> columns) {
  Rows out;
  for (const ColumnRange& range : columns) out.columns.add(range.first, range.count);
  out.H = random.matrix(rows, out.columns.size());
  out.r = random.matrix(rows, 1);
  return out;
}

}  // namespace viwo::testing
