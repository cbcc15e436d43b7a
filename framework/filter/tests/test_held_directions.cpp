// Holding directions against Joseph's form of the covariance update with dense matrices.
#include <array>
#include <numeric>
#include <span>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/filter/covariance.hpp"
#include "viwo/filter/health.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::Random;

constexpr int kHeldStateSize = 40;
constexpr int kFirstHeld = 28;  // the columns of which directions are held
constexpr int kCount = 9;
constexpr int kGauge = 30;  // held altogether, without variance

MatrixXd covariance_with_gauge(Random& random) {
  const MatrixXd A = random.matrix(kHeldStateSize, kHeldStateSize);
  MatrixXd P = 0.1 * MatrixXd::Identity(kHeldStateSize, kHeldStateSize);
  P.selfadjointView<Eigen::Lower>().rankUpdate(A);
  P = P.selfadjointView<Eigen::Lower>();  // symmetric to the bit, which a product need not be
  P.row(kGauge).setZero();
  P.col(kGauge).setZero();
  return P;
}

/// Three directions of the columns that are free, in units of sigmas between 0.1 and 10.
struct Held {
  std::vector<int> columns;
  VectorXd sigma;
  MatrixXd N;
  HeldDirections held{kFirstHeld, kCount};
  MatrixXd Q = MatrixXd::Zero(kHeldStateSize, kHeldStateSize);

  explicit Held(Random& random) {
    for (int i = kFirstHeld; i < kFirstHeld + kCount; ++i) {
      if (i != kGauge) columns.push_back(i);
    }
    const auto n = static_cast<Eigen::Index>(columns.size());
    sigma = random.matrix(n, 1).unaryExpr([](double x) { return std::pow(10., std::sin(x)); });
    N = MatrixXd(random.matrix(n, n).householderQr().householderQ()).leftCols(3);
    for (int k = 0; k < 3; ++k) held.add(columns, N.col(k), sigma);
    const MatrixXd Q_free =
        sigma.asDiagonal() * N * N.transpose() * sigma.cwiseInverse().asDiagonal();
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index k = 0; k < n; ++k) {
        Q(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(k)]) =
            Q_free(i, k);
      }
    }
  }

  /// N^T D^-1, on all columns.
  MatrixXd along() const {
    MatrixXd W = MatrixXd::Zero(3, kHeldStateSize);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      W.col(columns[i]) = N.row(k).transpose() / sigma[k];
    }
    return W;
  }
};

/// (I - K'H) P (I - K'H)^T + K' R K'^T with K' = (I - Q) K.
struct Joseph {
  MatrixXd P;
  VectorXd dx;
};
Joseph joseph(const MatrixXd& P, const MatrixXd& Q, const MatrixXd& H, const MatrixXd& R,
              const VectorXd& r) {
  const MatrixXd I = MatrixXd::Identity(kHeldStateSize, kHeldStateSize);
  const MatrixXd K = (I - Q) * P * H.transpose() * (H * P * H.transpose() + R).inverse();
  const MatrixXd F = I - K * H;
  return {F * P * F.transpose() + K * R * K.transpose(), K * r};
}

void expect_joseph(const Held& held, const MatrixXd& before, const Covariance& covariance,
                   const VectorXd& dx, const Joseph& expected) {
  EXPECT_LT((covariance.matrix() - expected.P).norm(), 1e-10 * before.norm());
  EXPECT_LT((dx - expected.dx).norm(), 1e-10 * expected.dx.norm());
  EXPECT_EQ(covariance.matrix(), covariance.matrix().transpose());
  const MatrixXd W = held.along();
  EXPECT_LT((W * dx).norm(), 1e-11);
  const MatrixXd variance = W * before * W.transpose();
  EXPECT_LT((W * covariance.matrix() * W.transpose() - variance).norm(), 1e-11 * variance.norm());
  EXPECT_EQ(dx[kGauge], 0.);
  EXPECT_TRUE(covariance.matrix().col(kGauge).isZero(0.));
}

/// Rows on columns inside and outside of what is held.
MatrixXd rows_of(Random& random, Eigen::Index rows) {
  MatrixXd H = MatrixXd::Zero(rows, kHeldStateSize);
  H.middleCols(3, 4) = random.matrix(rows, 4);
  H.middleCols(27, 8) = random.matrix(rows, 8);
  return H;
}

MatrixXd compact(const MatrixXd& H) {
  MatrixXd out(H.rows(), 12);
  out << H.middleCols(3, 4), H.middleCols(27, 8);
  return out;
}

TEST(HeldDirections, ResidualFactorIsJosephsFormWithTheReducedGain) {
  Random random(11);
  Held held(random);
  const MatrixXd P = covariance_with_gauge(random);
  const MatrixXd H = rows_of(random, 4);
  ResidualFactor factor;
  factor.columns.add(3, 4);
  factor.columns.add(27, 8);
  factor.set_rows(4);
  factor.H = compact(H);
  factor.residual = random.matrix(4, 1);
  const MatrixXd A = random.matrix(4, 4);
  factor.R = A * A.transpose() + MatrixXd::Identity(4, 4);
  Covariance covariance(kHeldStateSize);
  covariance.set_block(0, P);
  VectorXd dx(kHeldStateSize);
  Covariance normal = covariance;
  ASSERT_EQ(normal.apply(factor, dx), FactorResult::kApplied);
  EXPECT_GT((held.along() * dx).norm(), 1e-3);  // it would move them
  ASSERT_EQ(covariance.apply(factor, held.held, dx), FactorResult::kApplied);
  expect_joseph(held, P, covariance, dx, joseph(P, held.Q, H, factor.R, factor.residual));
}

TEST(HeldDirections, InformationFactorIsTheSame) {
  Random random(12);
  Held held(random);
  const MatrixXd P = covariance_with_gauge(random);
  const MatrixXd H = rows_of(random, 50);
  const VectorXd r = random.matrix(50, 1);
  InformationFactor factor;
  factor.columns.add(3, 4);
  factor.columns.add(27, 8);
  factor.Lambda = compact(H).transpose() * compact(H);
  factor.eta = compact(H).transpose() * r;
  Covariance covariance(kHeldStateSize);
  covariance.set_block(0, P);
  VectorXd dx(kHeldStateSize);
  ASSERT_EQ(covariance.apply(factor, held.held, dx), FactorResult::kApplied);
  expect_joseph(held, P, covariance, dx, joseph(P, held.Q, H, MatrixXd::Identity(50, 50), r));
}

TEST(HeldDirections, NoneOfThemIsTheNormalUpdateToTheBit) {
  Random random(13);
  const MatrixXd P = covariance_with_gauge(random);
  Covariance covariance(kHeldStateSize), normal(kHeldStateSize);
  covariance.set_block(0, P);
  normal.set_block(0, P);
  HeldDirections held(kFirstHeld, kCount);
  VectorXd dx(kHeldStateSize), dx_normal(kHeldStateSize);
  const ResidualFactor factor = testing::observation(29, random.matrix(1, 1), 0.3);
  covariance.apply(factor, held, dx);
  normal.apply(factor, dx_normal);
  EXPECT_EQ(covariance.matrix(), normal.matrix());
  EXPECT_EQ(dx, dx_normal);
}

TEST(HeldDirections, RefusesColumnsThatAreNotTheirs) {
  HeldDirections held(kFirstHeld, 2);
  const VectorXd one = VectorXd::Ones(1);
  const std::array outside{kFirstHeld + 2};
  EXPECT_THROW(held.add(outside, one, one), std::out_of_range);
  const std::array inside{kFirstHeld};
  held.add(inside, one, one);
  held.add(inside, one, one);
  EXPECT_THROW(held.add(inside, one, one), std::out_of_range);
  held.clear();
  EXPECT_EQ(held.size(), 0);
}

TEST(Filter, HeldDirectionsOfABlockNeverMoveWhateverIsObserved) {
  Random random(14);
  Filter filter = testing::running_filter(random, 3);
  // The first of the numbers and the clock, mixed.
  const std::array columns{testing::kBaseClock, testing::kBaseNumbers};
  const Eigen::Vector2d sigma(0.01, 0.001), unit(0.6, 0.8);
  filter.held().add(columns, unit, sigma);
  const auto number = [&](BlockId id) { return filter.blocks().view(id).numbers()[0]; };
  const auto along = [&] {
    return unit[0] * number(testing::kBaseClockId) / sigma[0] +
           unit[1] * number(testing::kBaseNumbersId) / sigma[1];
  };
  const double before = along();
  const double clock_before = number(testing::kBaseClockId);
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(filter.apply(testing::random_factor(random)), FactorResult::kApplied);
  }
  EXPECT_NEAR(along(), before, 1e-12);
  EXPECT_GT(std::abs(number(testing::kBaseClockId) - clock_before), 1e-7);  // across, it moves
  EXPECT_EQ(failure_of(filter), "");
}

}  // namespace
}  // namespace viwo
