// Elimination against the dense solution.
#include <array>
#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "arrow_system.hpp"

namespace viwo::smoother {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Both at once: an arrow, and the same without any structure; own unknowns first.
struct Pair {
  static constexpr int kOwn = 12, kShared = 3;
  ArrowSystem arrow{kShared};
  MatrixXd Lambda = MatrixXd::Zero(kOwn + kShared, kOwn + kShared);
  VectorXd eta = VectorXd::Zero(kOwn + kShared);

  /// The rows `J dx = r` with the columns of `columns`.
  void add(const std::vector<int>& columns, const MatrixXd& J, const VectorXd& r) {
    MatrixXd lower = MatrixXd(J.transpose() * J).triangularView<Eigen::Lower>();
    arrow.add(columns, lower, J.transpose() * r);
    MatrixXd wide = MatrixXd::Zero(J.rows(), kOwn + kShared);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i] == kHeld) continue;
      const int at = columns[i] < 0 ? kOwn + ~columns[i] : columns[i];
      wide.col(at) += J.col(static_cast<Eigen::Index>(i));
    }
    Lambda += wide.transpose() * wide;
    eta += wide.transpose() * r;
  }
};

TEST(ArrowSystem, SolvesAsTheDenseOne) {
  std::mt19937 random(3);
  std::normal_distribution<double> gaussian;
  const auto draw = [&](int rows, int cols) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, cols, [&] { return gaussian(random); }));
  };
  Pair both;
  for (int k = 0; k < Pair::kOwn; ++k) {
    // Neighbours, shared ones before and behind them, one that is held, one twice.
    const int next = (k + 1) % Pair::kOwn;
    both.add({shared(2), k, next, shared(0), k, kHeld, shared(1), shared(2)}, draw(4, 8),
             draw(4, 1));
  }
  ASSERT_TRUE(both.arrow.eliminate());
  const VectorXd dx = both.Lambda.ldlt().solve(both.eta);
  const VectorXd dx_shared = both.arrow.Lambda().ldlt().solve(both.arrow.eta());
  EXPECT_LT((dx_shared - dx.tail<Pair::kShared>()).norm(), 1e-9 * dx.norm());
  EXPECT_LT((both.arrow.own(dx_shared) - dx.head<Pair::kOwn>()).norm(), 1e-9 * dx.norm());
  const MatrixXd P = both.Lambda.inverse().bottomRightCorner<Pair::kShared, Pair::kShared>();
  EXPECT_LT((both.arrow.Lambda().inverse() - P).norm(), 1e-9 * P.norm());
}

TEST(ArrowSystem, SaysWhatIsNotDetermined) {
  Pair both;
  both.add({0, 1, shared(0)}, MatrixXd::Ones(1, 3), VectorXd::Ones(1));
  EXPECT_FALSE(both.arrow.eliminate());
}

}  // namespace
}  // namespace viwo::smoother
