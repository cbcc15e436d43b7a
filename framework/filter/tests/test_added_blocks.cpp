// Blocks that are added, written anew and dropped while a filter runs, against dense matrices.
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "rows_fixture.hpp"
#include "viwo/filter/filter.hpp"
#include "viwo/filter/health.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::kArmMount;
using testing::kBaseMount;
using testing::kClones;
using testing::kNaN;
using testing::kOptions;
using testing::Random;
using testing::random_rows;
using testing::Rows;
using testing::running_filter;

const std::vector<RoomSpec> kRooms{{"points", 4, 3}, {"lines", 2, 2}};
// Rooms stand before the group `base`.
constexpr int kPoints = kBaseMount;
constexpr int kLines = kPoints + 4 * 3;

/// The next block of a room, with a value.
AddedBlock next_block(const Filter& filter, int room, std::size_t skip, double value) {
  const auto& free = filter.blocks().free_blocks({room});
  AddedBlock block;
  block.id = free[free.size() - 1 - skip];
  block.value.fill(value);
  return block;
}

std::vector<int> columns_of(const Filter& filter, const std::vector<AddedBlock>& added) {
  std::vector<int> columns;
  for (const AddedBlock& block : added) {
    const BlockView& view = filter.blocks().view(block.id);
    for (int i = 0; i < view.size(); ++i) columns.push_back(view.column() + i);
  }
  return columns;
}

/// A filter that runs, with a covariance that ties everything together.
Filter tied_filter(Random& random) {
  Filter filter = running_filter(random, 3, kOptions, kRooms);
  // Not of the present pose: the newest clone is that.
  Rows rows = random_rows(random, 200, {{kVelocityColumn, kPoints - kVelocityColumn}});
  rows.r.setZero();
  const InformationFactor factor = rows.factor(filter.size());
  EXPECT_EQ(filter.apply(factor), FactorResult::kApplied);
  return filter;
}

TEST(AddedBlocks, AreCorrectedTogetherWithAllOthers) {
  Random random(5);
  Filter filter = tied_filter(random);
  const std::vector<AddedBlock> added{next_block(filter, 0, 0, 5.), next_block(filter, 1, 0, 7.),
                                      next_block(filter, 0, 1, 6.)};
  EXPECT_EQ(added[0].id.index, 5) << "behind the declared ones";
  const std::vector<int> columns = columns_of(filter, added);
  EXPECT_EQ(columns, (std::vector<int>{kPoints, kPoints + 1, kPoints + 2, kLines, kLines + 1,
                                       kPoints + 3, kPoints + 4, kPoints + 5}));
  Rows rows = random_rows(
      random, 30, {{kPoints, 6}, {kClones, 18}, {kLines, 2}, {kArmMount, 6}, {kVelocityColumn, 3}});
  rows.H *= 10.;
  rows.r *= 0.01;
  const MatrixXd P = filter.covariance();
  const Eigen::Vector3d p = filter.imu().p_IinG;
  const Eigen::Vector3d arm = filter.blocks().view(testing::kArmMountId).numbers();
  InformationFactor factor = rows.factor(filter.size());
  ASSERT_EQ(filter.apply(factor, added), FactorResult::kApplied);

  // Kalman form with a prior of the new columns that says nothing.
  MatrixXd wide = P;
  for (const int column : columns) wide(column, column) = 1e7;
  const MatrixXd H = rows.dense(filter.size());
  const MatrixXd S = H * wide * H.transpose() + MatrixXd::Identity(30, 30);
  const MatrixXd K = S.ldlt().solve(H * wide).transpose();
  const MatrixXd I_KH = MatrixXd::Identity(filter.size(), filter.size()) - K * H;
  const MatrixXd expected = I_KH * wide * I_KH.transpose() + K * K.transpose();
  const VectorXd dx = K * rows.r;
  EXPECT_LT((filter.covariance() - expected).norm(), 1e-5 * expected.norm());
  EXPECT_LT((filter.correction() - dx).norm(), 1e-5 * dx.norm());
  EXPECT_LT((filter.imu().p_IinG - p - dx.segment<3>(kPositionColumn)).norm(), 1e-6 * dx.norm());
  EXPECT_LT(
      (filter.blocks().view(testing::kArmMountId).numbers() - arm - dx.segment<3>(kArmMount + 3))
          .norm(),
      1e-6 * dx.norm());
  for (const AddedBlock& block : added) {
    const BlockView& view = filter.blocks().view(block.id);
    ASSERT_TRUE(filter.blocks().exists(block.id));
    for (int i = 0; i < view.size(); ++i) {
      EXPECT_NEAR(view.numbers()[i], block.value[0] + dx[view.column() + i], 1e-5 * dx.norm());
      EXPECT_EQ(view.first_numbers()[i], block.value[0]) << "where the factor was linearised";
      EXPECT_GT(std::abs(dx[view.column() + i]), 1e-5 * dx.norm());
    }
  }
  EXPECT_EQ(failure_of(filter), "");
}

TEST(AddedBlocks, NeedNoOtherColumns) {
  Random random(6);
  Filter filter = running_filter(random, 2, kOptions, kRooms);
  const MatrixXd P = filter.covariance();
  const std::vector<AddedBlock> added{next_block(filter, 1, 0, 7.)};
  const Rows rows = random_rows(random, 5, {{kLines, 2}});
  InformationFactor factor = rows.factor(filter.size());
  ASSERT_EQ(filter.apply(factor, added), FactorResult::kApplied);
  const MatrixXd Lambda = rows.H.transpose() * rows.H;
  MatrixXd expected = P;
  expected.block(kLines, kLines, 2, 2) = Lambda.inverse();
  EXPECT_LT((filter.covariance() - expected).norm(), 1e-12);
  const VectorXd dx = Lambda.inverse() * rows.H.transpose() * rows.r;
  EXPECT_NEAR(filter.blocks().view(added[0].id).numbers()[1], 7. + dx[1], 1e-12);
}

TEST(AddedBlocks, ThatTheFactorDoesNotDetermineChangeNothing) {
  Random random(7);
  Filter filter = running_filter(random, 3, kOptions, kRooms);
  const std::vector<AddedBlock> added{next_block(filter, 0, 0, 5.)};
  const MatrixXd P = filter.covariance();
  const Eigen::Vector3d p = filter.imu().p_IinG;
  const auto refused = [&](const Rows& rows) {
    InformationFactor factor = rows.factor(filter.size());
    EXPECT_EQ(filter.apply(factor, added), FactorResult::kRejected);
    EXPECT_EQ(filter.covariance(), P);
    EXPECT_EQ(filter.imu().p_IinG, p);
    EXPECT_TRUE(filter.correction().isZero(0.));
    EXPECT_FALSE(filter.blocks().exists(added[0].id));
    EXPECT_EQ(filter.blocks().free_blocks({0}).size(), 4u);
  };
  refused(random_rows(random, 2, {{kPoints, 3}, {kClones, 6}}));       // rank 2 of 3
  refused(random_rows(random, 20, {{kPoints, 2}, {kClones, 6}}));      // forgets a column
  refused(random_rows(random, 20, {{kPoints + 3, 3}, {kClones, 6}}));  // of another block
  Rows broken = random_rows(random, 20, {{kPoints, 3}, {kClones, 6}});
  broken.H(0, 4) = kNaN;
  refused(broken);
  EXPECT_EQ(failure_of(filter), "");
}

TEST(AddedBlocks, LeaveHeldDirectionsAlone) {
  Random random(8);
  Filter filter = tied_filter(random);
  const int numbers = filter.blocks().view(testing::kBaseNumbersId).column();
  const std::array columns{numbers};
  filter.held().add(columns, VectorXd::Ones(1), VectorXd::Constant(1, 0.001));
  const double before = filter.blocks().view(testing::kBaseNumbersId).numbers()[0];
  const MatrixXd P = filter.covariance();
  const std::vector<AddedBlock> added{next_block(filter, 0, 0, 5.)};
  const Rows rows = random_rows(random, 20, {{kPoints, 3}, {kClones, 6}, {numbers, 3}});
  InformationFactor factor = rows.factor(filter.size());
  ASSERT_EQ(filter.apply(factor, added), FactorResult::kApplied);
  EXPECT_EQ(filter.blocks().view(testing::kBaseNumbersId).numbers()[0], before);
  EXPECT_NEAR(filter.covariance()(numbers, numbers), P(numbers, numbers), 1e-18);
  // Joseph's form with the gain that the held column does not have.
  MatrixXd wide = P;
  for (int i = 0; i < 3; ++i) wide(kPoints + i, kPoints + i) = 1e7;
  const MatrixXd H = rows.dense(filter.size());
  const MatrixXd S = H * wide * H.transpose() + MatrixXd::Identity(20, 20);
  MatrixXd K = S.ldlt().solve(H * wide).transpose();
  K.row(numbers).setZero();
  const MatrixXd I_KH = MatrixXd::Identity(filter.size(), filter.size()) - K * H;
  const MatrixXd expected = I_KH * wide * I_KH.transpose() + K * K.transpose();
  EXPECT_LT((filter.covariance() - expected).norm(), 1e-5 * expected.norm());
}

TEST(AddedBlocks, ThatAreDroppedLeaveNothingBehindAndAreUsedAgain) {
  Random random(9);
  Filter filter = tied_filter(random);
  const MatrixXd P = filter.covariance();
  std::vector<AddedBlock> added{next_block(filter, 0, 0, 5.)};
  const Rows exact = random_rows(random, 3, {{kPoints, 3}, {kClones, 6}});
  InformationFactor factor = exact.factor(filter.size());
  ASSERT_EQ(filter.apply(factor, added), FactorResult::kApplied);
  filter.drop(added[0].id);
  EXPECT_FALSE(filter.blocks().exists(added[0].id));
  EXPECT_TRUE(filter.covariance().middleCols(kPoints, 3).isZero(0.));
  EXPECT_LT((filter.covariance() - P).norm(), 1e-10 * P.norm());
  const AddedBlock again = next_block(filter, 0, 0, 8.);
  EXPECT_EQ(again.id, added[0].id);
  added = {again};
  factor = exact.factor(filter.size());
  ASSERT_EQ(filter.apply(factor, added), FactorResult::kApplied);
  EXPECT_EQ(filter.blocks().view(again.id).first_numbers()[0], 8.);
}

TEST(AddedBlocks, WrittenAnewHaveTheirJacobianTimesTheCovariance) {  // (F-24)
  Random random(10);
  Filter filter = tied_filter(random);
  std::vector<AddedBlock> added{next_block(filter, 0, 0, 5.), next_block(filter, 0, 1, 6.)};
  const Rows rows = random_rows(random, 30, {{kPoints, 6}, {kClones, 12}});
  InformationFactor factor = rows.factor(filter.size());
  ASSERT_EQ(filter.apply(factor, added), FactorResult::kApplied);
  filter.rebase();
  const MatrixXd P = filter.covariance();
  // Of its own old error (that of a block in the middle), of a clone, and of the other block.
  BlockRewrite anew;
  anew.id = added[0].id;
  anew.columns.add(kClones, 6);
  anew.columns.add(kPoints, 3);
  anew.columns.add(kPoints + 3, 2);
  anew.J = random.matrix(3, 11);
  anew.value = {1., 2., 3.};
  anew.first_estimate = {1.5, 2.5, 3.5};
  filter.rewrite(anew);
  MatrixXd J = MatrixXd::Identity(filter.size(), filter.size());
  J.middleRows(kPoints, 3).setZero();
  J.block(kPoints, kClones, 3, 6) = anew.J.leftCols(6);
  J.block(kPoints, kPoints, 3, 3) = anew.J.middleCols(6, 3);
  J.block(kPoints, kPoints + 3, 3, 2) = anew.J.rightCols(2);
  const MatrixXd expected = J * P * J.transpose();
  EXPECT_LT((filter.covariance() - expected).norm(), 1e-13 * expected.norm());
  EXPECT_EQ(filter.covariance(), filter.covariance().transpose());
  EXPECT_EQ(filter.blocks().view(anew.id).numbers()[2], 3.);
  EXPECT_EQ(filter.blocks().view(anew.id).first_numbers()[0], 1.5);
  // The comparison sees a wrong Jacobian.
  J(kPoints, kClones) *= -1.;
  EXPECT_GT((filter.covariance() - J * P * J.transpose()).norm(), 1e-3 * expected.norm());
}

}  // namespace
}  // namespace viwo
