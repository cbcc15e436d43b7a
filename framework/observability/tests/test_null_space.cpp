// Rank, null space and angles of matrices whose answer is known.
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <Eigen/LU>
#include <Eigen/QR>
#include <gtest/gtest.h>

#include "viwo/observability/null_space.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_matrix(int rows, int cols, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> gaussian;
  return MatrixXd::NullaryExpr(rows, cols, [&] { return gaussian(rng); });
}

MatrixXd random_basis(int n, int k, unsigned seed) {
  const Eigen::HouseholderQR<MatrixXd> qr(random_matrix(n, k, seed));
  return qr.householderQ() * MatrixXd::Identity(n, k);
}

/// A 30 x 8 matrix that vanishes on the columns of `null`, columns of very different lengths.
MatrixXd vanishing_on(const MatrixXd& null, const VectorXd& lengths) {
  const MatrixXd scaled = lengths.asDiagonal().inverse() * null;
  const MatrixXd basis = orthonormal(scaled);
  const MatrixXd M = random_matrix(30, 8, 3);
  return M - M * basis * basis.transpose();
}

TEST(NullSpace, IsFoundWhateverTheUnitsOfTheColumns) {
  VectorXd units(8);
  units << 1., 1e3, 1e-3, 1e2, 1e-2, 1., 10., 1e-1;
  const MatrixXd null = random_basis(8, 3, 1);
  const MatrixXd M = vanishing_on(null, VectorXd::Ones(8)) * units.cwiseInverse().asDiagonal();
  const NullSpace found = null_space(M, 1e-8);
  EXPECT_EQ(found.rank, 5);
  ASSERT_EQ(found.basis.cols(), 3);
  EXPECT_GT(found.gap, 1e10);
  EXPECT_LT((M * found.basis).norm(), 1e-9);
  EXPECT_LT((found.basis.transpose() * found.basis - MatrixXd::Identity(3, 3)).norm(), 1e-12);
  EXPECT_LT(largest_angle(orthonormal(units.asDiagonal() * null), found.basis), 1e-9);
}

TEST(NullSpace, OfAZeroColumnIsThatColumn) {
  MatrixXd M = random_matrix(10, 4, 2);
  M.col(2).setZero();
  const NullSpace found = null_space(M, 1e-8);
  ASSERT_EQ(found.basis.cols(), 1);
  EXPECT_NEAR(std::abs(found.basis(2, 0)), 1., 1e-12);
}

TEST(NullSpace, TellsHowClearTheCutIs) {
  const MatrixXd null = random_basis(8, 1, 4);
  MatrixXd M = vanishing_on(null, VectorXd::Ones(8));
  const double clear = null_space(M, 1e-5).gap;
  M += 1e-6 * random_matrix(30, 8, 5);
  const NullSpace noisy = null_space(M, 1e-5);
  EXPECT_EQ(noisy.rank, 7);
  EXPECT_GT(clear, 1e12);
  EXPECT_LT(noisy.gap, 1e7);
  EXPECT_GT(noisy.gap, 1e4);
  EXPECT_EQ(null_space(M, 1e-8).rank, 8);
}

// What is seen little, beside the tolerance, is seen, where what is not seen is rounding.
TEST(NullSpace, IsCutAtTheGapBesideTheTolerance) {
  const auto rank = [](const VectorXd& values) {
    const MatrixXd U = random_basis(12, static_cast<int>(values.size()), 7);
    const MatrixXd V =
        random_basis(static_cast<int>(values.size()), static_cast<int>(values.size()), 8);
    MatrixXd M = U * values.asDiagonal() * V.transpose();
    return null_space(M, 5e-5).rank;
  };
  EXPECT_EQ(rank(VectorXd{{1., 0.5, 5e-3, 3e-5, 1e-13}}), 4);
  EXPECT_EQ(rank(VectorXd{{1., 0.5, 5e-1, 1e-3, 1e-5}}), 4) << "no clearer cut: the tolerance";
  EXPECT_EQ(rank(VectorXd{{1., 0.5, 5e-3, 1e-8, 1e-13}}), 3) << "too far from it";
}

TEST(NullSpace, RefusesWhatIsNoMatrix) {
  EXPECT_THROW(null_space(MatrixXd(3, 0), 1e-8), std::invalid_argument);
  MatrixXd M = random_matrix(3, 3, 6);
  M(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(null_space(M, 1e-8), std::invalid_argument);
}

TEST(PrincipalAngles, OfTwoPlanesAreThoseTheyWereTurnedBy) {
  const MatrixXd frame = random_basis(6, 6, 7);
  MatrixXd a(6, 2), b(6, 3);
  const double small = 1e-7, large = 0.4;
  a << frame.col(0), frame.col(1);
  b << std::cos(small) * frame.col(0) + std::sin(small) * frame.col(2),
      std::cos(large) * frame.col(1) + std::sin(large) * frame.col(3), frame.col(4);
  EXPECT_NEAR(largest_angle(a, b), large, 1e-12);
  EXPECT_NEAR(largest_angle(a.leftCols(1), b), small, 1e-13);
  EXPECT_EQ(intersection(a, b, 1e-6).cols(), 1);
  EXPECT_NEAR(std::abs(intersection(a, b, 1e-6).col(0).dot(frame.col(0))), 1., 1e-12);
  EXPECT_EQ(intersection(a, b, 1e-8).cols(), 0);
  EXPECT_EQ(intersection(a, b, 0.5).cols(), 2);
}

TEST(Readable, FindsTheSparseDirectionsOfASubspace) {
  MatrixXd sparse = MatrixXd::Zero(6, 2);
  sparse(1, 0) = 1.;
  sparse(3, 0) = -0.5;
  sparse(4, 1) = 1.;
  const MatrixXd mixed = sparse * random_matrix(2, 2, 8);
  const MatrixXd found = readable(mixed);
  ASSERT_EQ(found.cols(), 2);
  int zeros = 0;
  for (int i = 0; i < found.size(); ++i) zeros += std::abs(found(i)) < 1e-12;
  EXPECT_EQ(zeros, 9);
  EXPECT_EQ(found.cwiseAbs().maxCoeff(), 1.);
  EXPECT_LT(largest_angle(orthonormal(found), orthonormal(sparse)), 1e-12);
}

}  // namespace
}  // namespace viwo
