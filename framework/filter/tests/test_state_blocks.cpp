// Layout of the blocks, how they are corrected, how they move, and which specs are none.
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/filter/state_blocks.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::kNaN;
using testing::numbers_block;
using testing::pose_block;
using testing::Random;
using testing::Vector6;

constexpr int kFirst = 20;  // column of the blocks

BlockSpec number(const std::string& name, double sigma = 1., const std::string& group = "") {
  return numbers_block(name, name + "_", {0.5}, {sigma}, group);
}
BlockSpec pose(const std::string& name, const std::string& group = "") {
  return pose_block(name, name + "_", {0.1, 0.2, 0.3}, {1., 2., 3.}, Vector6::Ones(), group);
}

int column(const StateBlocks& blocks, int index) { return blocks.view({index}).column(); }

TEST(StateBlocks, StandInTheOrderOfTheirDeclarationThenRoomsThenGroupsSideBySide) {
  const StateBlocks blocks({pose("a.pose", "a"), number("free1"), number("b.n", 1., "b"),
                            number("a.n", 1., "a"), pose("b.pose", "b"), number("free2")},
                           {{"points", 2, 3}, {"lines", 1, 4}}, kFirst);
  EXPECT_EQ(column(blocks, 1), kFirst);
  EXPECT_EQ(column(blocks, 5), kFirst + 1);
  EXPECT_EQ(column(blocks, 6), kFirst + 2) << "first point";
  EXPECT_EQ(column(blocks, 7), kFirst + 5);
  EXPECT_EQ(column(blocks, 8), kFirst + 8) << "the line";
  EXPECT_EQ(blocks.first_watched(), kFirst + 12);
  EXPECT_EQ(column(blocks, 0), kFirst + 12) << "a, as it was declared first";
  EXPECT_EQ(column(blocks, 3), kFirst + 18);
  EXPECT_EQ(column(blocks, 2), kFirst + 19) << "b";
  EXPECT_EQ(column(blocks, 4), kFirst + 20);
  EXPECT_EQ(blocks.first_column(), kFirst);
  EXPECT_EQ(blocks.columns(), 26);
  ASSERT_EQ(blocks.groups().size(), 2u);
  EXPECT_EQ(blocks.groups()[0].name, "a");
  EXPECT_EQ(blocks.groups()[0].blocks, (std::vector<BlockId>{{0}, {3}}));
  EXPECT_EQ(blocks.groups()[0].mount, BlockId{0});
  EXPECT_EQ(blocks.groups()[1].blocks, (std::vector<BlockId>{{2}, {4}}));
  EXPECT_EQ(blocks.groups()[1].mount, BlockId{4});
}

TEST(StateBlocks, HaveNoColumnWhenAllOfThemIsHeld) {
  const StateBlocks blocks({number("held", 0.), number("a"), pose("b")}, {}, kFirst);
  EXPECT_EQ(column(blocks, 0), -1);
  EXPECT_EQ(blocks.view({0}).size(), 1);
  EXPECT_EQ(blocks.view({0}).numbers()[0], 0.5);
  EXPECT_EQ(column(blocks, 1), kFirst);
  EXPECT_EQ(column(blocks, 2), kFirst + 1);
  EXPECT_EQ(blocks.columns(), 7);
  EXPECT_EQ(blocks.first_watched(), kFirst + 7);
  EXPECT_TRUE(blocks.groups().empty());
}

TEST(StateBlocks, HaveAColumnWhenTheyAreKnownAtFirstButWalk) {
  BlockSpec walk = number("walk", 0.);
  walk.process = Process::kRandomWalk;
  walk.entries[0].process_sigma = 0.1;
  const StateBlocks blocks({walk}, {}, kFirst);
  EXPECT_EQ(column(blocks, 0), kFirst);
}

TEST(StateBlocks, StayWhereTheyAreWhenTheyAreMoved) {
  StateBlocks first({pose("a"), number("b")}, {{"points", 2, 3}}, kFirst);
  const StateBlocks second = std::move(first);
  EXPECT_EQ(second.view({1}).numbers()[0], 0.5);
  EXPECT_EQ(Vector3d(second.view({0}).numbers()), Vector3d(1., 2., 3.));
}

/// Two rotations and two numbers.
BlockSpec product() {
  BlockSpec block{.name = "product"};
  block.add_rotation({"a_x", "a_y", "a_z"}, exp_so3({0.1, -0.5, 0.9}), {0.1, 0.1, 0.1});
  block.add_rotation({"b_x", "b_y", "b_z"}, exp_so3({-2., 0.3, 0.2}), {0.1, 0.1, 0.1});
  block.add("n_1", "m", 4., 0.1).add("n_2", "", 5., 0.1);
  return block;
}

/// Rodrigues' formula, so that the retraction is not compared with itself.
Matrix3d turn_about(const Vector3d& v) {
  Matrix3d K;
  K << 0., -v.z(), v.y(), v.z(), 0., -v.x(), -v.y(), v.x(), 0.;
  const double angle = v.norm();
  return Matrix3d::Identity() + std::sin(angle) / angle * K +
         (1. - std::cos(angle)) / (angle * angle) * K * K;
}

TEST(StateBlocks, AreCorrectedByTheirRetraction) {
  const BlockSpec spec = product();
  StateBlocks blocks({number("other"), spec}, {}, kFirst);
  Random random(1);
  VectorXd dx = VectorXd::Zero(kFirst + blocks.columns());
  dx.tail(9) = random.matrix(9, 1);
  blocks.correct(dx, true);
  const BlockView& view = blocks.view({1});
  const auto R = [&](int i) { return Matrix3d(Matrix3d::Map(spec.value.data() + 9 * i)); };
  EXPECT_LT((view.rotation(0) - turn_about(-dx.segment<3>(21)) * R(0)).norm(), 1e-13);
  EXPECT_LT((view.rotation(1) - turn_about(-dx.segment<3>(24)) * R(1)).norm(), 1e-13);
  EXPECT_NEAR(view.numbers()[0], 4. + dx[27], 1e-14);
  EXPECT_NEAR(view.numbers()[1], 5. + dx[28], 1e-14);
  EXPECT_EQ(blocks.view({0}).numbers()[0], 0.5 + dx[20]);
  EXPECT_EQ(view.first_rotation(0), R(0)) << "first estimates stay";
  EXPECT_EQ(view.first_rotation(1), R(1));
  EXPECT_EQ(view.first_numbers()[1], 5.);
}

TEST(StateBlocks, WithoutFirstEstimatesThoseFollow) {
  StateBlocks blocks({product()}, {}, 0);
  blocks.correct(VectorXd::Constant(8, 0.1), false);
  const BlockView& view = blocks.view({0});
  EXPECT_EQ(view.first_rotation(1), view.rotation(1));
  EXPECT_EQ(view.first_numbers()[0], view.numbers()[0]);
  EXPECT_EQ(view.numbers()[0], 4.1);
}

TEST(StateBlocks, KeepTheirBitsWithoutACorrection) {
  const BlockSpec spec = product();
  StateBlocks blocks({spec}, {}, 0);
  blocks.correct(VectorXd::Zero(8), true);
  EXPECT_EQ(Matrix3d(blocks.view({0}).rotation(0)), Matrix3d(Matrix3d::Map(spec.value.data())));
  EXPECT_EQ(blocks.view({0}).numbers()[1], 5.);
}

TEST(StateBlocks, ShowRotationVectorsNumbersAndSigmas) {
  const BlockSpec spec = product();
  BlockSpec held = number("held", 0.);
  const StateBlocks blocks({held, spec}, {}, 0);
  Covariance covariance(blocks.columns());
  blocks.set_prior(covariance);
  std::vector<BlockEstimate> all;
  blocks.estimates({1}, covariance, all);
  blocks.estimates({0}, covariance, all);
  ASSERT_EQ(all.size(), 9u);
  const double expected[] = {0.1, -0.5, 0.9, -2., 0.3, 0.2, 4., 5., 0.5};
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_NEAR(all[i].value, expected[i], 1e-14) << i;
    EXPECT_EQ(all[i].sigma, i < 8 ? 0.1 : 0.) << i;
  }
  EXPECT_EQ(blocks.value(1), spec.value);
}

TEST(StateBlocks, PriorIsTheSquareOfTheSigmasCorrelatesNothingAndEmptiesRooms) {
  const StateBlocks blocks({pose("a"), testing::base_numbers()}, {{"points", 2, 3}}, 3);
  Covariance covariance(3 + blocks.columns());
  covariance.set_block(0, MatrixXd::Ones(covariance.size(), covariance.size()));
  blocks.set_prior(covariance);
  MatrixXd expected = MatrixXd::Zero(covariance.size(), covariance.size());
  expected.topLeftCorner<3, 3>().setOnes();  // of what is not in blocks
  for (const auto& [first, sigma] :
       {std::pair{3, std::vector<double>(6, 1.)}, std::pair{15, testing::kBaseNumbersSigma}}) {
    for (std::size_t i = 0; i < sigma.size(); ++i) {
      const Eigen::Index k = first + static_cast<Eigen::Index>(i);
      expected(k, k) = sigma[i] * sigma[i];
    }
  }
  EXPECT_EQ(covariance.matrix(), expected);
}

TEST(StateBlocks, CorrelationsAmongSomeAreInTheirOrder) {
  Eigen::Matrix3d matrix;
  matrix << 1., 0.1, 0.2, 0.1, 1., 0.3, 0.2, 0.3, 1.;
  const PriorCorrelations correlations{{"a", "b", "c"}, matrix};
  const std::vector<std::string> names{"c", "unknown", "a"};
  Eigen::Matrix3d expected;
  expected << 1., 0., 0.2, 0., 1., 0., 0.2, 0., 1.;
  EXPECT_EQ(correlations.among(names), expected);
}

/// A covariance that correlates everything.
MatrixXd full_covariance(Random& random, int size) {
  const MatrixXd A = random.matrix(size, size);
  return A * A.transpose() + 0.1 * MatrixXd::Identity(size, size);
}

TEST(StateBlocks, RandomWalkGainsVarianceAndKeepsItsCorrelations) {  // (F-25)
  Random random(2);
  BlockSpec walk = numbers_block("walk", "w_", {1., 2.}, {0.1, 0.1});
  walk.process = Process::kRandomWalk;
  walk.entries[0].process_sigma = 0.3;
  StateBlocks blocks({number("other"), walk}, {}, 2);
  Covariance covariance(5);
  const MatrixXd P = full_covariance(random, 5);
  covariance.set_block(0, P);
  // In two steps as in one.
  blocks.propagate(0.05, covariance);
  blocks.propagate(0.15, covariance);
  MatrixXd expected = P;
  expected(3, 3) += 0.3 * 0.3 * 0.2;
  EXPECT_LT((covariance.matrix() - expected).norm(), 1e-14);
  EXPECT_EQ(blocks.view({1}).numbers()[0], 1.);
}

TEST(StateBlocks, GaussMarkovGoesBackToTheDeclaredValueAndItsSigma) {  // (F-26)
  Random random(3);
  BlockSpec slip = numbers_block("slip", "s_", {1., -2.}, {0.1, 0.1});
  slip.process = Process::kGaussMarkov;
  slip.time_constant_s = 0.4;
  slip.entries[0].process_sigma = 0.3;
  slip.entries[1].process_sigma = 0.7;
  StateBlocks blocks({number("other"), slip}, {}, 2);
  VectorXd dx = VectorXd::Zero(5);
  dx.tail(2) << 0.5, -0.25;
  blocks.correct(dx, true);
  Covariance covariance(5);
  const MatrixXd P = full_covariance(random, 5);
  covariance.set_block(0, P);
  for (int i = 0; i < 4; ++i) blocks.propagate(0.05, covariance);
  // F = diag(1, 1, 1, f, f): P <- F P F^T + Q, f = exp(-t / tau), Q = (1 - f^2) sigma^2.
  const double f = std::exp(-0.2 / 0.4);
  VectorXd F = VectorXd::Ones(5);
  F.tail(2).setConstant(f);
  MatrixXd expected = F.asDiagonal() * P * F.asDiagonal();
  expected(3, 3) += (1. - f * f) * 0.3 * 0.3;
  expected(4, 4) += (1. - f * f) * 0.7 * 0.7;
  EXPECT_LT((covariance.matrix() - expected).norm(), 1e-14);
  EXPECT_LT(std::abs(covariance.matrix()(3, 4) - f * f * P(3, 4)), 1e-14);
  EXPECT_LT(std::abs(covariance.matrix()(0, 4) - f * P(0, 4)), 1e-14);
  EXPECT_NEAR(blocks.view({1}).numbers()[0], 1. + f * 0.5, 1e-14);
  EXPECT_NEAR(blocks.view({1}).numbers()[1], -2. - f * 0.25, 1e-14);
  for (int i = 0; i < 100; ++i) blocks.propagate(1., covariance);
  EXPECT_NEAR(blocks.view({1}).numbers()[0], 1., 1e-12);
  EXPECT_NEAR(covariance.matrix()(3, 3), 0.3 * 0.3, 1e-12);
  EXPECT_NEAR(covariance.matrix()(3, 4), 0., 1e-12);
  EXPECT_NEAR(covariance.matrix()(2, 2), P(2, 2), 1e-14) << "constants stay";
}

TEST(StateBlocks, MoveWithTheTimeThatTheFilterPropagates) {
  std::vector<BlockSpec> specs = testing::fixture_blocks();
  specs[1].process = Process::kRandomWalk;
  for (BlockEntry& entry : specs[1].entries) entry.process_sigma = 2.;
  Filter filter(testing::kOptions, specs);
  Random random(4);
  filter.initialize(testing::imu_prior(random));
  const MatrixXd before = filter.covariance();
  testing::step(filter, random);
  const double gained = 4. * 1e-9 * static_cast<double>(testing::kPeriodNs);
  for (int i = 0; i < 8; ++i) {
    const int k = testing::kArmNumbers + i;
    EXPECT_NEAR(filter.covariance()(k, k), before(k, k) + gained, 1e-13);
  }
  EXPECT_EQ(filter.covariance()(testing::kBaseClock, testing::kBaseClock),
            before(testing::kBaseClock, testing::kBaseClock));
}

TEST(StateBlocks, NameTheBlockThatIsNotFinite) {
  StateBlocks blocks({number("a"), pose("b")}, {}, 0);
  EXPECT_EQ(blocks.not_finite(), "");
  VectorXd dx = VectorXd::Zero(7);
  dx[6] = std::numeric_limits<double>::infinity();
  blocks.correct(dx, true);
  EXPECT_EQ(blocks.not_finite(), "b");
}

TEST(StateBlocks, SayWhatIsWrongWithASpec) {
  const auto fault = [](auto change) {
    BlockSpec spec = product();
    change(spec);
    return fault_of(spec);
  };
  EXPECT_EQ(fault([](BlockSpec&) {}), "");
  EXPECT_EQ(fault([](BlockSpec& spec) { spec.name = ""; }), "it has no name");
  EXPECT_EQ(fault([](BlockSpec& spec) { spec = {.name = "x"}; }), "it has no entries");
  EXPECT_EQ(fault([](BlockSpec& spec) { spec.rotations = 3; }),
            "its retraction is none: 3 rotations need 9 entries, not 8");
  EXPECT_NE(fault([](BlockSpec& spec) { spec.rotations = -1; }), "");
  EXPECT_EQ(fault([](BlockSpec& spec) { spec.value.pop_back(); }),
            "its value has 19 numbers, not 20");
  EXPECT_EQ(fault([](BlockSpec& spec) { spec.value.clear(); }), "its value has 0 numbers, not 20");
  EXPECT_EQ(fault([](BlockSpec& spec) { spec.value[18] = kNaN; }), "its value is not finite");
  EXPECT_EQ(fault([](BlockSpec& spec) { spec.value[10] += 1e-3; }),
            "its retraction is none: rotation 1 of its value is not one");
  EXPECT_EQ(fault([](BlockSpec& spec) {
              for (std::size_t i = 0; i < 3; ++i) spec.value[i] *= -1.;  // a mirror
            }),
            "its retraction is none: rotation 0 of its value is not one");
  EXPECT_EQ(fault([](BlockSpec& spec) { spec.entries[4].name = ""; }), "an entry has no name");
  EXPECT_EQ(fault([](BlockSpec& spec) { spec.entries[4].name = "a_y"; }),
            "two of its entries are called 'a_y'");
  for (const double sigma : {-0.1, kNaN, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(fault([&](BlockSpec& spec) { spec.entries[6].sigma = sigma; }),
              "a sigma of 'n_1' is negative or not finite");
    EXPECT_EQ(fault([&](BlockSpec& spec) { spec.entries[7].process_sigma = sigma; }),
              "a sigma of 'n_2' is negative or not finite");
  }
}

TEST(StateBlocks, SayWhatIsWrongWithAProcess) {
  BlockSpec slip = number("slip");
  slip.process = Process::kGaussMarkov;
  for (const double time_constant_s : {0., -1., kNaN, std::numeric_limits<double>::infinity()}) {
    slip.time_constant_s = time_constant_s;
    EXPECT_EQ(fault_of(slip), "a Gauss-Markov process needs a time constant above zero");
  }
  slip.time_constant_s = 0.1;
  EXPECT_EQ(fault_of(slip), "");
  BlockSpec turning = product();
  turning.process = Process::kGaussMarkov;
  turning.time_constant_s = 0.1;
  EXPECT_EQ(fault_of(turning), "a rotation cannot be a Gauss-Markov process");
  turning.process = Process::kRandomWalk;
  EXPECT_EQ(fault_of(turning), "");
}

TEST(StateBlocks, SayWhatIsWrongWithARoom) {
  EXPECT_EQ(fault_of(RoomSpec{"points", 0, 1}), "");
  EXPECT_EQ(fault_of(RoomSpec{"points", 50, 9}), "");
  EXPECT_EQ(fault_of(RoomSpec{"", 1, 1}), "it has no name");
  EXPECT_EQ(fault_of(RoomSpec{"points", -1, 1}), "it has room for less than no block");
  EXPECT_EQ(fault_of(RoomSpec{"points", 1, 0}), "its blocks have 0 entries, not 1 to 9");
}

AddedBlock added(BlockId id, double value) {
  AddedBlock block;
  block.id = id;
  block.value.fill(value);
  return block;
}

TEST(StateBlocks, OfARoomComeAndGo) {
  StateBlocks blocks({number("a")}, {{"points", 3, 2}, {"lines", 1, 4}}, 0);
  const RoomId points{0};
  EXPECT_EQ(blocks.free_blocks(points), (std::vector<BlockId>{{3}, {2}, {1}}));
  EXPECT_EQ(blocks.room_of({0}), -1);
  EXPECT_EQ(blocks.room_of({-1}), -1);
  EXPECT_EQ(blocks.room_of({5}), -1);
  EXPECT_EQ(blocks.room_of({3}), 0);
  EXPECT_EQ(blocks.room_of({4}), 1);
  EXPECT_FALSE(blocks.exists({1}));
  blocks.add(added({1}, 7.));
  blocks.add(added({2}, 8.));
  EXPECT_TRUE(blocks.exists({1}));
  EXPECT_FALSE(blocks.exists({0})) << "a declared block is not of a room";
  EXPECT_EQ(blocks.view({1}).numbers()[1], 7.);
  EXPECT_EQ(blocks.view({1}).first_numbers()[1], 7.);
  EXPECT_EQ(blocks.free_blocks(points), (std::vector<BlockId>{{3}}));
  blocks.drop({1});
  EXPECT_FALSE(blocks.exists({1}));
  EXPECT_EQ(blocks.free_blocks(points), (std::vector<BlockId>{{3}, {1}}));
  EXPECT_EQ(blocks.columns(), 1 + 3 * 2 + 4) << "columns stay";
}

TEST(StateBlocks, OfARoomAreCorrectedOnlyWhileTheyExist) {
  StateBlocks blocks({}, {{"points", 2, 2}}, 0);
  blocks.add(added({0}, 7.));
  blocks.correct(VectorXd::Ones(4), true);
  EXPECT_EQ(blocks.view({0}).numbers()[1], 8.);
  EXPECT_EQ(blocks.view({0}).first_numbers()[1], 7.);
  EXPECT_EQ(blocks.view({1}).numbers()[1], 0.);
  BlockRewrite anew;
  anew.id = {0};
  anew.value.fill(5.);
  anew.first_estimate.fill(4.);
  blocks.rewrite(anew);
  EXPECT_EQ(blocks.view({0}).numbers()[0], 5.);
  EXPECT_EQ(blocks.view({0}).first_numbers()[0], 4.);
}

}  // namespace
}  // namespace viwo
