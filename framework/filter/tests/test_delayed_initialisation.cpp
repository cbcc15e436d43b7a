// New columns of a covariance, against dense information form with next to no prior on them.
#include <cmath>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "rows_fixture.hpp"
#include "viwo/filter/covariance.hpp"

namespace viwo {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::kNaN;
using testing::Random;
using testing::random_rows;
using testing::Rows;

struct Gaussian {
  MatrixXd P;
  VectorXd dx;
};

/// Information form over the columns with variance and the new ones, of which nothing is known
/// (but 1e-9, where variances are about one).
Gaussian information_form(const MatrixXd& P, const Rows& rows,
                          const std::vector<int>& new_columns) {
  std::vector<int> known, live;
  for (int i = 0; i < P.rows(); ++i) {
    if (P(i, i) > 0.) known.push_back(i);
  }
  live = known;
  live.insert(live.end(), new_columns.begin(), new_columns.end());
  const auto n = static_cast<Index>(live.size()), k = static_cast<Index>(known.size());
  MatrixXd Lambda = 1e-9 * MatrixXd::Identity(n, n);
  Lambda.topLeftCorner(k, k) = MatrixXd(P(known, known)).inverse();
  const MatrixXd H = rows.dense(P.rows())(Eigen::all, live);
  Lambda += H.transpose() * H;
  Gaussian out{MatrixXd::Zero(P.rows(), P.rows()), VectorXd::Zero(P.rows())};
  const MatrixXd P_live = Lambda.inverse();
  out.P(live, live) = P_live;
  out.dx(live) = P_live * H.transpose() * rows.r;
  return out;
}

constexpr int kStateColumns = 24;

/// Everything is correlated but three pairs of columns, which have no variance.
MatrixXd covariance_with_room(Random& random) {
  const MatrixXd A = random.matrix(kStateColumns, kStateColumns);
  MatrixXd P = A * A.transpose() / kStateColumns + MatrixXd::Identity(kStateColumns, kStateColumns);
  for (const int free : {8, 9, 14, 15, 20, 21}) {
    P.row(free).setZero();
    P.col(free).setZero();
  }
  return P;
}

/// split(), apply() and initialise().
Gaussian initialised(const MatrixXd& P, const Rows& rows, const std::vector<int>& new_columns) {
  Covariance covariance(kStateColumns, 6);
  covariance.set_block(0, P);
  InformationFactor factor = rows.factor(kStateColumns);
  VectorXd dx = VectorXd::Zero(kStateColumns);
  EXPECT_TRUE(covariance.split(new_columns, factor));
  EXPECT_TRUE(covariance.ties_known_columns());
  EXPECT_EQ(covariance.apply(factor, dx), FactorResult::kApplied);
  covariance.initialise(dx);
  return {covariance.matrix(), dx};
}

double distance(const Gaussian& a, const Gaussian& b) {
  return (a.P - b.P).norm() / b.P.norm() + (a.dx - b.dx).norm() / b.dx.norm();
}

constexpr double kSmall = 1e-7;  // the prior of the reference

TEST(DelayedInitialisation, IsInformationFormWithoutAPriorOnTheNewColumns) {  // (F-22), (F-23)
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const MatrixXd P = covariance_with_room(random);
    // New columns between, before and behind known ones; 20, 21 stay without variance.
    const Rows rows = random_rows(random, 9, {{2, 3}, {14, 2}, {20, 2}, {17, 2}, {8, 2}, {23, 1}});
    const std::vector<int> new_columns{8, 9, 14, 15};
    const Gaussian result = initialised(P, rows, new_columns);
    EXPECT_LT(distance(result, information_form(P, rows, new_columns)), kSmall) << trial;
    EXPECT_EQ(result.P, result.P.transpose());
    EXPECT_TRUE(result.P.middleRows(20, 2).isZero(0.));
    EXPECT_GT(
        Eigen::LLT<MatrixXd>(result.P.topLeftCorner(20, 20)).matrixLLT().diagonal().minCoeff(), 0.);
  }
}

TEST(DelayedInitialisation, ComparisonSeesWrongSignsAndMissingCorrelations) {
  Random random(2);
  const MatrixXd P = covariance_with_room(random);
  const Rows rows = random_rows(random, 9, {{2, 3}, {14, 2}, {17, 2}});
  const Gaussian right = initialised(P, rows, {14, 15});
  const Gaussian expected = information_form(P, rows, {14, 15});
  ASSERT_LT(distance(right, expected), kSmall);
  constexpr double kSeen = 1e3 * kSmall;
  Gaussian wrong = right;  // with one column that the factor does not see
  wrong.P.row(14).head(1).setZero();
  wrong.P.col(14).head(1).setZero();
  EXPECT_GT(distance(wrong, expected), kSeen);
  wrong = right;
  wrong.P.middleRows(14, 2).leftCols(14) *= -1.;
  wrong.P.middleCols(14, 2).topRows(14) *= -1.;
  EXPECT_GT(distance(wrong, expected), kSeen);
  wrong = right;
  wrong.dx.segment(14, 2) *= -1.;
  EXPECT_GT(distance(wrong, expected), kSeen);
  Rows flipped = rows;
  flipped.H.col(0) *= -1.;  // a Jacobian
  EXPECT_GT(distance(initialised(P, flipped, {14, 15}), expected), kSeen);
}

TEST(DelayedInitialisation, LeavesWhatTheFactorTellsOfTheOthers) {
  // As many rows as new columns: nothing is left for the others, which do not change.
  Random random(3);
  const MatrixXd P = covariance_with_room(random);
  const Rows exact = random_rows(random, 2, {{2, 3}, {14, 2}});
  const Gaussian result = initialised(P, exact, {14, 15});
  MatrixXd others = result.P;
  others.middleRows(14, 2).setZero();
  others.middleCols(14, 2).setZero();
  EXPECT_LT((others - P).norm(), 1e-12 * P.norm());
  EXPECT_LT((result.dx.head(14)).norm(), 1e-12);
  EXPECT_GT(result.P.block(14, 0, 2, 8).norm(), 0.1) << "correlated, though";
}

TEST(DelayedInitialisation, RefusesWhatDoesNotDetermineTheNewColumns) {
  Random random(4);
  const MatrixXd P = covariance_with_room(random);
  Covariance covariance(kStateColumns, 6);
  covariance.set_block(0, P);
  const auto splits = [&](const Rows& rows, const std::vector<int>& new_columns) {
    InformationFactor factor = rows.factor(kStateColumns);
    return covariance.split(new_columns, factor);
  };
  const Rows good = random_rows(random, 9, {{2, 3}, {14, 2}});
  EXPECT_TRUE(splits(good, {14, 15}));
  EXPECT_FALSE(splits(good, {14, 15, 20})) << "it does not speak of 20";
  EXPECT_FALSE(splits(random_rows(random, 1, {{2, 3}, {14, 2}}), {14, 15})) << "one row for two";
  for (int trial = 0; trial < 50; ++trial) {
    // Rank one but for rounding, in units of all sizes.
    Rows thin = good;
    const double scale = std::pow(10., 4. * random.normal());
    thin.H.col(4) = scale * thin.H.col(3);
    EXPECT_FALSE(splits(thin, {14, 15})) << scale;
    thin.H.col(4) += 1e-4 * scale * random.matrix(9, 1);
    EXPECT_TRUE(splits(thin, {14, 15})) << "poor, but it does: " << scale;
  }
  Rows broken = good;
  broken.H(2, 3) = kNaN;
  EXPECT_FALSE(splits(broken, {14, 15}));
  broken = good;
  broken.H(2, 0) = kNaN;
  EXPECT_FALSE(splits(broken, {14, 15}));
  broken = good;
  broken.r[1] = kNaN;
  EXPECT_FALSE(splits(broken, {14, 15}));
  EXPECT_EQ(covariance.matrix(), P) << "nothing has changed";
}

}  // namespace
}  // namespace viwo
