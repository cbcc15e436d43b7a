// Both forms of the update against the textbook equations.
#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "rows_fixture.hpp"
#include "viwo/filter/covariance.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::Random;

constexpr int kDenseSize = 40;

MatrixXd random_covariance(Random& random, int size = kDenseSize) {
  const MatrixXd A = random.matrix(size, size);
  MatrixXd P = 0.1 * MatrixXd::Identity(size, size);
  P.selfadjointView<Eigen::Lower>().rankUpdate(A);
  return P.selfadjointView<Eigen::Lower>();  // symmetric to the bit, which a product need not be
}

/// K = P H^T (H P H^T + R)^-1 with dense matrices.
struct Textbook {
  MatrixXd P;
  VectorXd dx;
};
Textbook textbook(const MatrixXd& P, const MatrixXd& H, const MatrixXd& R, const VectorXd& r) {
  const MatrixXd S = H * P * H.transpose() + R;
  const MatrixXd K = P * H.transpose() * S.inverse();
  return {P - K * S * K.transpose(), K * r};
}

/// Applies a factor, which leaves the covariance of the textbook, symmetric to the bit.
struct Updated {
  VectorXd dx, of_textbook;
  double off() const { return (dx - of_textbook).norm(); }
};
template <class Factor>
Updated expect_textbook(const MatrixXd& P, const Factor& factor, const MatrixXd& H,
                        const MatrixXd& R, const VectorXd& r) {
  Covariance covariance(static_cast<int>(P.rows()));
  covariance.set_block(0, P);
  VectorXd dx(P.rows());
  EXPECT_EQ(covariance.apply(factor, dx), FactorResult::kApplied);
  const Textbook expected = textbook(P, H, R, r);
  EXPECT_LT((covariance.matrix() - expected.P).norm(), 1e-10 * P.norm());
  EXPECT_EQ(covariance.matrix(), covariance.matrix().transpose());
  return {dx, expected.dx};
}

ResidualFactor residual_factor(Random& random, MatrixXd& dense_H) {
  ResidualFactor factor;
  factor.columns.add(20, 6);
  factor.columns.add(3, 2);
  factor.columns.add(35, 3);
  factor.set_rows(4);
  factor.H = random.matrix(4, 11);
  factor.residual = random.matrix(4, 1);
  const MatrixXd A = random.matrix(4, 4);
  factor.R = A * A.transpose() + MatrixXd::Identity(4, 4);
  dense_H = MatrixXd::Zero(4, kDenseSize);
  dense_H.middleCols(20, 6) = factor.H.leftCols(6);
  dense_H.middleCols(3, 2) = factor.H.middleCols(6, 2);
  dense_H.middleCols(35, 3) = factor.H.rightCols(3);
  return factor;
}

TEST(Covariance, ResidualFactorIsTheTextbookUpdate) {
  Random random(1);
  const MatrixXd P = random_covariance(random);
  MatrixXd H;
  const ResidualFactor factor = residual_factor(random, H);
  EXPECT_LT(expect_textbook(P, factor, H, factor.R, factor.residual).off(), 1e-10);
}

TEST(Covariance, InformationFactorIsTheSameUpdateWithoutStackingRows) {
  Random random(2);
  const MatrixXd P = random_covariance(random);
  // Many rows on two blocks, with a direction that no row sees.
  MatrixXd H = MatrixXd::Zero(60, kDenseSize);
  H.middleCols(18, 12) = random.matrix(60, 12);
  H.col(29) = H.col(28);
  H.middleCols(5, 3) = random.matrix(60, 3);
  const VectorXd r = random.matrix(60, 1);
  InformationFactor factor;
  factor.columns.add(18, 12);
  factor.columns.add(5, 3);
  MatrixXd compact(60, 15);
  compact << H.middleCols(18, 12), H.middleCols(5, 3);
  factor.Lambda =
      MatrixXd::Constant(kDenseSize, kDenseSize, std::nan(""));  // what is not to be read
  factor.eta = VectorXd::Constant(kDenseSize, std::nan(""));
  factor.Lambda.topLeftCorner(15, 15).triangularView<Eigen::Lower>() =
      compact.transpose() * compact;
  factor.eta.head(15) = compact.transpose() * r;
  EXPECT_LT(expect_textbook(P, factor, H, MatrixXd::Identity(60, 60), r).off(), 1e-10);
}

/// More columns than the products of (F-8) take at a time, some of them held.
TEST(Covariance, InformationFactorOfManyColumnsIsTheSameUpdate) {
  constexpr int kSize = 140;
  Random random(11);
  MatrixXd P = random_covariance(random, kSize);
  for (const int held : {47, 100}) {
    P.row(held).setZero();
    P.col(held).setZero();
  }
  const testing::Rows rows =
      testing::random_rows(random, 150, {{90, 31}, {40, 17}, {15, 20}, {60, 30}});
  const Updated update = expect_textbook(P, rows.factor(kSize), rows.dense(kSize),
                                         MatrixXd::Identity(150, 150), rows.r);
  EXPECT_LT(update.off(), 1e-9 * update.of_textbook.norm());
}

/// Neighbours in the state that are none in the factor: what stands between them there is held.
TEST(Covariance, InformationFactorOfNeighboursApartIsTheSameUpdate) {
  Random random(12);
  MatrixXd P = random_covariance(random);
  P.middleRows(30, 2).setZero();
  P.middleCols(30, 2).setZero();
  const testing::Rows rows = testing::random_rows(random, 40, {{10, 3}, {30, 2}, {13, 4}});
  const Updated update = expect_textbook(P, rows.factor(kDenseSize), rows.dense(kDenseSize),
                                         MatrixXd::Identity(40, 40), rows.r);
  EXPECT_LT(update.off(), 1e-10);
}

TEST(Covariance, ColumnsWithoutVarianceNeverMove) {
  Random random(3);
  MatrixXd P = random_covariance(random);
  for (const int held : {5, 21, 33}) {  // 33 is in neither factor
    P.row(held).setZero();
    P.col(held).setZero();
  }
  Covariance covariance(kDenseSize);
  covariance.set_block(0, P);
  InformationFactor factor;
  factor.columns.add(18, 12);
  factor.columns.add(5, 3);
  const MatrixXd rows = random.matrix(40, 15);
  factor.Lambda = rows.transpose() * rows;
  factor.eta = random.matrix(15, 1);
  VectorXd dx(kDenseSize);
  ASSERT_EQ(covariance.apply(factor, dx), FactorResult::kApplied);
  MatrixXd H;
  ASSERT_EQ(covariance.apply(residual_factor(random, H), dx), FactorResult::kApplied);
  for (const int held : {5, 21, 33}) {
    EXPECT_EQ(dx[held], 0.);
    EXPECT_TRUE(covariance.matrix().row(held).isZero(0.));
    EXPECT_TRUE(covariance.matrix().col(held).isZero(0.));
  }
  EXPECT_NE(dx[6], 0.);
}

TEST(Covariance, GatesByTheProbabilityOfTheResidual) {
  Random random(4);
  MatrixXd H;
  ResidualFactor factor = residual_factor(random, H);
  const MatrixXd P = random_covariance(random);
  const MatrixXd S = H * P * H.transpose() + factor.R;
  // Squared normalised residual of 4 rows: the 1 % quantile of chi-square is 13.2767 (tables).
  factor.residual *= std::sqrt(13.2 / factor.residual.dot(S.inverse() * factor.residual));
  factor.gate_probability = 0.01;
  VectorXd dx(kDenseSize);
  Covariance covariance(kDenseSize);
  covariance.set_block(0, P);
  EXPECT_EQ(covariance.apply(factor, dx), FactorResult::kApplied);
  covariance.set_block(0, P);
  factor.residual *= std::sqrt(13.4 / 13.2);
  EXPECT_EQ(covariance.apply(factor, dx), FactorResult::kGated);
  EXPECT_TRUE(dx.isZero(0.));
  EXPECT_EQ(covariance.matrix(), P);
}

TEST(Covariance, RefusesWhatIsNotFiniteAndTellsWhenItIsLost) {
  Random random(5);
  Covariance covariance(kDenseSize);
  const MatrixXd P = random_covariance(random);
  covariance.set_block(0, P);
  MatrixXd H;
  ResidualFactor factor = residual_factor(random, H);
  factor.residual[1] = std::nan("");
  VectorXd dx(kDenseSize);
  EXPECT_EQ(covariance.apply(factor, dx), FactorResult::kRejected);
  EXPECT_EQ(covariance.matrix(), P);
  InformationFactor information;
  information.columns.add(18, 12);
  information.Lambda = MatrixXd::Identity(12, 12);
  information.eta = VectorXd::Constant(12, std::nan(""));
  EXPECT_EQ(covariance.apply(information, dx), FactorResult::kRejected);
  MatrixXd broken = P;
  broken(20, 19) = broken(19, 20) = 2. * std::sqrt(P(19, 19) * P(20, 20));
  covariance.set_block(0, broken);
  information.eta.setZero();
  EXPECT_EQ(covariance.apply(information, dx), FactorResult::kFailed);
}

TEST(Covariance, IsNotLostWhereRoundingIsAsLargeAsWhatClonesAreOffByFromEachOther) {
  // A kilometre that all of them are off by together, and nothing else that a number can hold.
  Covariance covariance(kDenseSize);
  covariance.set_block(0, MatrixXd::Constant(kDenseSize, kDenseSize, 1e6));
  InformationFactor information;
  information.columns.add(18, 12);
  information.Lambda = MatrixXd::Identity(12, 12);
  information.eta = VectorXd::Constant(12, 1.);
  VectorXd dx(kDenseSize);
  EXPECT_EQ(covariance.apply(information, dx), FactorResult::kApplied);
  EXPECT_TRUE(covariance.matrix().allFinite());
  EXPECT_NEAR(covariance.matrix()(18, 18), 1. / 12., 1e-3);  // of twelve measurements
  EXPECT_NEAR(dx[18], 1., 1e-3);
}

TEST(Covariance, PropagatesAndClonesLikeTheDenseProduct) {
  Random random(6);
  const MatrixXd P = random_covariance(random);
  Covariance covariance(kDenseSize);
  covariance.set_block(0, P);
  ImuTransition transition{random.matrix(kImuSize, kImuSize), ImuMatrix::Identity()};
  MatrixXd Phi = MatrixXd::Identity(kDenseSize, kDenseSize);
  Phi.topLeftCorner<kImuSize, kImuSize>() = transition.Phi;
  MatrixXd expected = Phi * P * Phi.transpose();
  expected.diagonal().head<kImuSize>().array() += 1.;
  covariance.propagate(transition);
  EXPECT_LT((covariance.matrix() - expected).norm(), 1e-11 * expected.norm());
  MatrixXd copy = MatrixXd::Identity(kDenseSize, kDenseSize);
  copy.middleRows(24, 6).setZero();
  copy.block(24, 0, 6, 6).setIdentity();
  covariance.clone_pose(24);
  EXPECT_LT((covariance.matrix() - copy * expected * copy.transpose()).norm(),
            1e-11 * expected.norm());
}

}  // namespace
}  // namespace viwo
