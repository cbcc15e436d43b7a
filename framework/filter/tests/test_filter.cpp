// The ring of clones, first estimates, corrections, what is held.
#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/filter/filter.hpp"
#include "viwo/filter/health.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace testing;

TEST(Filter, CloneIsACopyOfThePoseAndOfItsCovarianceWithEverything) {
  Random random(1);
  Filter filter = running_filter(random, 2);
  const ImuSample samples[] = {imu_sample(filter.t_ns(), random),
                               imu_sample(filter.t_ns() + kPeriodNs, random)};
  filter.propagate(samples);
  const MatrixXd before = filter.covariance();
  filter.clone(samples[1]);
  const CloneState& clone = filter.clones().back();
  EXPECT_EQ(clone.t_ns, samples[1].t_ns);
  EXPECT_EQ(clone.R_GtoI, filter.imu().R_GtoI);
  EXPECT_EQ(clone.p_IinG, filter.imu().p_IinG);
  EXPECT_EQ(clone.R_GtoI_fej, filter.imu().R_GtoI);
  EXPECT_EQ(clone.p_IinG_fej, filter.imu().p_IinG);
  EXPECT_EQ(clone.v_IinG, filter.imu().v_IinG);
  const auto& gyro = samples[1].gyro_rad_per_s;
  EXPECT_EQ(clone.w_IinI, Vector3d(gyro[0], gyro[1], gyro[2]) - filter.imu().gyro_bias);
  // P of [x; pose] is J P J^T with J that copies the pose.
  MatrixXd J = MatrixXd::Identity(kSize, kSize);
  J.middleRows(clone.column, kPoseSize).setZero();
  J.block(clone.column, 0, kPoseSize, kPoseSize).setIdentity();
  EXPECT_EQ(filter.covariance(), J * before * J.transpose());
}

TEST(Filter, DroppingTheOldestCloneFreesItsSlotAndLeavesAllOthersAlone) {
  Random random(2);
  Filter filter = running_filter(random, 4);
  EXPECT_TRUE(filter.window_full());
  EXPECT_TRUE(filter.view().oldest_leaves);
  EXPECT_THROW(filter.clone(imu_sample(filter.t_ns(), random)), std::logic_error);
  std::vector<int> slots;
  for (int k = 0; k < 9; ++k) {
    const std::vector<CloneState> clones(filter.clones().begin(), filter.clones().end());
    MatrixXd expected = filter.covariance();
    expected.middleRows(clones[0].column, kPoseSize).setZero();
    expected.middleCols(clones[0].column, kPoseSize).setZero();
    filter.drop_oldest_clone();
    EXPECT_EQ(filter.covariance(), expected);
    EXPECT_FALSE(filter.window_full());
    EXPECT_FALSE(filter.view().oldest_leaves);
    ASSERT_EQ(filter.clones().size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(filter.clones()[i].t_ns, clones[i + 1].t_ns);
      EXPECT_EQ(filter.clones()[i].slot, clones[i + 1].slot);
      EXPECT_EQ(filter.clones()[i].column, clones[i + 1].column);
      EXPECT_EQ(filter.clones()[i].R_GtoI, clones[i + 1].R_GtoI);
    }
    step(filter, random);
    EXPECT_EQ(filter.clones().back().slot, clones[0].slot);
    EXPECT_EQ(filter.clones().back().column, kClones + kPoseSize * clones[0].slot);
    slots.push_back(clones[0].slot);
  }
  EXPECT_EQ(slots, (std::vector<int>{0, 1, 2, 3, 0, 1, 2, 3, 0}));
}

TEST(Filter, DroppingACloneOfAnEmptyWindowDoesNothing) {
  Random random(3);
  Filter filter = running_filter(random, 0);
  const MatrixXd before = filter.covariance();
  filter.drop_oldest_clone();
  EXPECT_EQ(filter.covariance(), before);
  EXPECT_TRUE(filter.clones().empty());
}

FilterOptions with(Consistency consistency) {
  FilterOptions options = kOptions;
  options.consistency = consistency;
  return options;
}

TEST(Filter, FirstEstimatesStayWhenAnUpdateMovesTheEstimate) {
  Random random(4);
  Filter filter = running_filter(random, 3, with(Consistency::kFirstEstimates));
  const std::vector<CloneState> before(filter.clones().begin(), filter.clones().end());
  const ImuState imu = filter.imu();
  ASSERT_EQ(filter.apply(random_factor(random)), FactorResult::kApplied);
  const MatrixXd P = filter.covariance();
  filter.rebase();
  EXPECT_EQ(filter.covariance(), P);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_NE(filter.clones()[i].R_GtoI, before[i].R_GtoI);
    EXPECT_NE(filter.clones()[i].p_IinG, before[i].p_IinG);
    EXPECT_EQ(filter.clones()[i].R_GtoI_fej, before[i].R_GtoI);
    EXPECT_EQ(filter.clones()[i].p_IinG_fej, before[i].p_IinG);
    if (i + 1 == before.size()) continue;  // of now: below
    EXPECT_EQ(filter.clones()[i].v_IinG, before[i].v_IinG);
  }
  // Of now it is that of the IMU, in the frame of the first estimate.
  const CloneState& now = filter.clones().back();
  EXPECT_NE(filter.imu().v_IinG, imu.v_IinG);
  EXPECT_TRUE((now.R_GtoI_fej * now.v_IinG).isApprox(filter.imu().R_GtoI * filter.imu().v_IinG));
  EXPECT_TRUE((now.w_IinI + filter.imu().gyro_bias).isApprox(before.back().w_IinI + imu.gyro_bias));
  EXPECT_EQ(filter.imu().R_GtoI_fej, imu.R_GtoI);
  EXPECT_EQ(filter.imu().p_IinG_fej, imu.p_IinG);
  EXPECT_EQ(filter.imu().v_IinG_fej, imu.v_IinG);
}

TEST(Filter, WithoutFirstEstimatesTheyFollowTheEstimateOnceAllFactorsAreApplied) {
  Random random(5);
  const FilterOptions options = with(Consistency::kNone);
  Filter filter = running_filter(random, 3, options);
  const std::vector<CloneState> before(filter.clones().begin(), filter.clones().end());
  ASSERT_EQ(filter.apply(random_factor(random)), FactorResult::kApplied);
  EXPECT_EQ(filter.clones()[0].R_GtoI_fej, before[0].R_GtoI);
  const MatrixXd P = filter.covariance();
  filter.rebase();
  EXPECT_EQ(filter.covariance(), P);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const CloneState& clone = filter.clones()[i];
    EXPECT_EQ(clone.R_GtoI_fej, clone.R_GtoI);
    EXPECT_EQ(clone.p_IinG_fej, clone.p_IinG);
    EXPECT_NE(clone.v_IinG, before[i].v_IinG);
    if (i + 1 == before.size()) continue;  // of now: that of the IMU
    // The velocity that it had is known in I.
    EXPECT_LT((clone.R_GtoI * clone.v_IinG - before[i].R_GtoI * before[i].v_IinG).norm(), 1e-12);
  }
  EXPECT_EQ(filter.imu().R_GtoI_fej, filter.imu().R_GtoI);
  EXPECT_EQ(filter.imu().v_IinG_fej, filter.imu().v_IinG);
  // The transition starts at the present estimate: as that of a filter that was started there.
  ImuPrior prior;
  prior.t_ns = filter.t_ns();
  prior.state = filter.imu();
  prior.P = filter.covariance().topLeftCorner<kImuSize, kImuSize>();
  Filter fresh = make_filter(options);
  fresh.initialize(prior);
  const ImuSample samples[] = {imu_sample(filter.t_ns(), random),
                               imu_sample(filter.t_ns() + kPeriodNs, random)};
  filter.propagate(samples);
  fresh.propagate(samples);
  const auto imu_block = [](const Filter& f) -> ImuMatrix {
    return f.covariance().topLeftCorner<kImuSize, kImuSize>();
  };
  EXPECT_EQ(imu_block(filter), imu_block(fresh));
}

/// What a turn of the world about the vertical through `axis` does to the errors about an estimate.
VectorXd world_turn(const Filter& filter, const Vector3d& axis = Vector3d::Zero()) {
  const Vector3d up = Vector3d::UnitZ();
  VectorXd turn = VectorXd::Zero(filter.size());
  turn.segment<3>(kThetaColumn) = filter.imu().R_GtoI * up;
  turn.segment<3>(kPositionColumn) = up.cross(filter.imu().p_IinG - axis);
  turn.segment<3>(kVelocityColumn) = up.cross(filter.imu().v_IinG);
  for (const CloneState& clone : filter.clones()) {
    turn.segment<3>(clone.column) = clone.R_GtoI * up;
    turn.segment<3>(clone.column + 3) = up.cross(clone.p_IinG - axis);
  }
  return turn;
}

struct CorrectedFilter {
  Filter filter;
  Vector3d correction_m;  ///< of the newest place, all of them
};

/// A filter that knows the yaw of the world to `sigma_rad`, after factors at its estimates that do
/// not see the world turn or move.
CorrectedFilter after_factors_blind_for_the_world(Consistency consistency, double sigma_rad) {
  Random random(5);
  Vector3d correction = Vector3d::Zero();
  Filter filter = make_filter(with(consistency));
  ImuPrior prior = imu_prior(random);
  filter.initialize(prior);
  const VectorXd turn = sigma_rad * world_turn(filter).head(kImuSize);
  prior.P += turn * turn.transpose();
  filter.initialize(prior);
  for (int epoch = 0; epoch < 3; ++epoch) {
    step(filter, random);
    MatrixXd unseen = MatrixXd::Zero(filter.size(), 4);
    unseen.col(0) = world_turn(filter);
    unseen.block<3, 3>(kPositionColumn, 1).setIdentity();
    for (const CloneState& clone : filter.clones()) {
      unseen.block<3, 3>(clone.column + 3, 1).setIdentity();
    }
    const Eigen::HouseholderQR<MatrixXd> qr(unseen);
    const MatrixXd basis = qr.householderQ() * MatrixXd::Identity(filter.size(), 4);
    const Vector3d before = filter.imu().p_IinG;
    for (int k = 0; k < 2; ++k) {  // of one linearisation
      const MatrixXd H = random.matrix(3, filter.size());
      ResidualFactor factor;
      factor.columns.add(0, filter.size());
      factor.set_rows(3);
      factor.H = H - H * basis * basis.transpose();
      factor.residual = 0.5 * random.matrix(3, 1);
      factor.R.setIdentity();
      EXPECT_EQ(filter.apply(factor), FactorResult::kApplied);
    }
    filter.rebase();
    EXPECT_EQ(filter.covariance(), filter.covariance().transpose());
    correction += filter.imu().p_IinG - before;
  }
  return {std::move(filter), correction};
}

/// How far from that of a yaw at the estimate what another yaw at the start adds to the covariance
/// is then.
double what_is_seen_of_the_yaw(Consistency consistency) {
  constexpr double kSigma = 0.3;
  const auto sure = after_factors_blind_for_the_world(consistency, 0.);
  const auto unsure = after_factors_blind_for_the_world(consistency, kSigma);
  const VectorXd turn = kSigma * world_turn(unsure.filter, unsure.correction_m);
  return (unsure.filter.covariance() - sure.filter.covariance() - turn * turn.transpose()).norm();
}

TEST(Filter, ItsCovarianceGoesWithTheEstimateAndDoesNotSeeTheYawOfTheWorld) {
  EXPECT_LT(what_is_seen_of_the_yaw(Consistency::kTransform), 1e-9);
  EXPECT_GT(what_is_seen_of_the_yaw(Consistency::kNone), 1e-2) << "a plain Kalman filter does";
}

/// A place that is measured is known as well as that, wherever it was taken to be.
TEST(Filter, APlaceThatIsMeasuredFarAwayTellsNothingOfTheOrientation) {
  constexpr double kFarM = 100.;
  constexpr double kSigmaM = 0.01;
  Random random(7);
  Filter filter = make_filter(with(Consistency::kTransform));
  ImuPrior prior = imu_prior(random);
  prior.P = 0.01 * ImuMatrix::Identity();
  prior.P.block<3, 3>(kPositionColumn, kPositionColumn) *= 1e4;
  filter.initialize(prior);
  ResidualFactor fix;
  fix.columns.add(kPositionColumn, 3);
  fix.set_rows(3);
  fix.H.setIdentity();
  fix.R = kSigmaM * kSigmaM * Eigen::Matrix3d::Identity();
  fix.residual << kFarM, 0., 0.;
  ASSERT_EQ(filter.apply(fix), FactorResult::kApplied);
  filter.rebase();
  fix.residual.setZero();
  ASSERT_EQ(filter.apply(fix), FactorResult::kApplied);
  const auto covariance = filter.covariance();
  EXPECT_NEAR(covariance(kPositionColumn, kPositionColumn), kSigmaM * kSigmaM / 2., 1e-8);
  EXPECT_NEAR(covariance.topLeftCorner(3, 3).trace(), prior.P.topLeftCorner(3, 3).trace(), 1e-6);
}

/// The rotation that a filter must have after an error dtheta is found in `R`.
Matrix3d turned(const Matrix3d& R, const VectorXd& dx, int column) {
  return exp_so3(-Vector3d(dx.segment<3>(column))) * R;
}

TEST(Filter, CorrectsEveryBlockThroughItsBoxplus) {
  Random random(6);
  Filter filter = running_filter(random, 3);
  const std::vector<CloneState> clones(filter.clones().begin(), filter.clones().end());
  const ImuState imu = filter.imu();
  // The information factor correlates calibration and motion first. (Not of the present pose: the
  // newest clone is that.)
  InformationFactor information;
  information.columns.add(kVelocityColumn, kSize - kVelocityColumn);
  const int n = information.columns.size();
  const MatrixXd A = random.matrix(n + 20, n);
  information.Lambda = A.transpose() * A;
  information.eta = VectorXd::Zero(n);
  ASSERT_EQ(filter.apply(information), FactorResult::kApplied);
  EXPECT_EQ(filter.imu().p_IinG, imu.p_IinG);  // eta was zero

  const ResidualFactor factor = random_factor(random);
  MatrixXd H = MatrixXd::Zero(5, kSize);
  int start = 0;
  for (const ColumnRange& block : factor.columns.blocks()) {
    H.middleCols(block.first, block.count) = factor.H.middleCols(start, block.count);
    start += block.count;
  }
  const MatrixXd P = filter.covariance();
  const MatrixXd S = H * P * H.transpose() + MatrixXd(factor.R);
  const VectorXd dx = P * H.transpose() * S.inverse() * factor.residual;
  ASSERT_EQ(filter.apply(factor), FactorResult::kApplied);
  EXPECT_LT((filter.correction() - dx).norm(), 1e-12);

  constexpr double kTolerance = 1e-12;
  const auto near = [](const auto& a, const auto& b) { return (a - b).norm() < kTolerance; };
  EXPECT_TRUE(near(filter.imu().R_GtoI, turned(imu.R_GtoI, dx, kThetaColumn)));
  EXPECT_TRUE(near(filter.imu().p_IinG, imu.p_IinG + dx.segment<3>(kPositionColumn)));
  EXPECT_TRUE(near(filter.imu().v_IinG, imu.v_IinG + dx.segment<3>(kVelocityColumn)));
  EXPECT_TRUE(near(filter.imu().gyro_bias, imu.gyro_bias + dx.segment<3>(kGyroBiasColumn)));
  EXPECT_TRUE(near(filter.imu().accel_bias, imu.accel_bias + dx.segment<3>(kAccelBiasColumn)));
  for (std::size_t i = 0; i < clones.size(); ++i) {
    const int column = clones[i].column;
    EXPECT_TRUE(near(filter.clones()[i].R_GtoI, turned(clones[i].R_GtoI, dx, column)));
    EXPECT_TRUE(near(filter.clones()[i].p_IinG, clones[i].p_IinG + dx.segment<3>(column + 3)));
  }
  const auto& blocks = filter.blocks();
  const auto numbers_of = [](const BlockSpec& spec) {
    const Eigen::Index first = 9 * spec.rotations;
    return VectorXd(VectorXd::Map(spec.value.data() + first,
                                  static_cast<Eigen::Index>(spec.value.size()) - first));
  };
  const auto rotation_of = [](const BlockSpec& spec) {
    return Matrix3d(Matrix3d::Map(spec.value.data()));
  };
  EXPECT_TRUE(
      near(blocks.view(kArmMountId).rotation(), turned(rotation_of(arm_mount()), dx, kArmMount)));
  EXPECT_TRUE(near(blocks.view(kArmMountId).numbers(),
                   numbers_of(arm_mount()) + dx.segment<3>(kArmMount + 3)));
  EXPECT_TRUE(near(blocks.view(kArmNumbersId).numbers(),
                   numbers_of(arm_numbers()) + dx.segment<8>(kArmNumbers)));
  EXPECT_TRUE(near(blocks.view(kBaseMountId).rotation(),
                   turned(rotation_of(base_mount()), dx, kBaseMount)));
  EXPECT_TRUE(near(blocks.view(kBaseMountId).numbers(),
                   numbers_of(base_mount()) + dx.segment<3>(kBaseMount + 3)));
  EXPECT_TRUE(near(blocks.view(kBaseClockId).numbers(),
                   numbers_of(base_clock()) + dx.segment<1>(kBaseClock)));
  EXPECT_TRUE(near(blocks.view(kBaseNumbersId).numbers(),
                   numbers_of(base_numbers()) + dx.segment<3>(kBaseNumbers)));
  EXPECT_EQ(blocks.view(kArmMountId).first_rotation(), rotation_of(arm_mount()));
  EXPECT_EQ(blocks.view(kBaseNumbersId).first_numbers(), numbers_of(base_numbers()));
  // Every block has moved by more than the tolerance, so that a wrong sign is seen.
  for (int column = 0; column < kImuSize; ++column) EXPECT_GT(std::abs(dx[column]), 1e-10);
  EXPECT_GT(dx.segment<6>(kArmMount).cwiseAbs().minCoeff(), 1e-10);
  EXPECT_GT(dx.segment<6>(kBaseMount).cwiseAbs().minCoeff(), 1e-10);
}

TEST(Filter, ObservedRotationErrorTurnsTheEstimateOntoTheTruth) {
  Random random(7);
  Filter filter = running_filter(random, 1);
  const Vector3d error(0.02, -0.01, 0.03);
  const Matrix3d truth = exp_so3(-error) * filter.blocks().view(kBaseMountId).rotation();
  filter.apply(observation(kBaseMount, error, 1e-9));
  EXPECT_LT((filter.blocks().view(kBaseMountId).rotation() - truth).norm(), 1e-12);
  const Matrix3d true_R_GtoI = exp_so3(-error) * filter.imu().R_GtoI;
  filter.apply(observation(kThetaColumn, error, 1e-9));
  EXPECT_LT((filter.imu().R_GtoI - true_R_GtoI).norm(), 1e-10);
}

TEST(Filter, HeldValuesStayTheSameBits) {
  Random random(8);
  std::vector<BlockSpec> blocks = fixture_blocks();
  for (BlockEntry& entry : blocks[1].entries) entry.sigma = 0.;  // all of arm.numbers
  blocks[2].entries[5].sigma = 0.;                               // p_z of base.mount
  Filter filter(kOptions, blocks);
  filter.initialize(imu_prior(random));
  const int mount = filter.blocks().view(kBaseMountId).column();
  const int numbers = filter.blocks().view(kBaseNumbersId).column();
  for (int k = 0; k < 12; ++k) {
    if (filter.window_full()) filter.drop_oldest_clone();
    step(filter, random);
    ResidualFactor factor;
    factor.columns.add(0, kImuSize);
    factor.columns.add(mount, filter.size() - mount);
    factor.set_rows(4);
    factor.H = random.matrix(4, factor.columns.size());
    factor.residual = 0.05 * random.matrix(4, 1);
    factor.R.setIdentity();
    ASSERT_EQ(filter.apply(factor), FactorResult::kApplied);
    InformationFactor information;
    information.columns = factor.columns;
    const int n = factor.columns.size();
    const MatrixXd A = random.matrix(2 * n, n);
    information.Lambda = A.transpose() * A;
    information.eta = random.matrix(n, 1);
    ASSERT_EQ(filter.apply(information), FactorResult::kApplied);
  }
  const auto now = [&](BlockId id) { return filter.blocks().view(id).numbers(); };
  EXPECT_EQ(now(kBaseNumbersId)[1], 0.06);
  EXPECT_EQ(now(kBaseMountId)[2], 0.15);
  EXPECT_EQ(VectorXd(now(kArmNumbersId)), VectorXd(VectorXd::Map(blocks[1].value.data(), 8)));
  for (const int column : {numbers + 1, mount + 5}) {
    EXPECT_EQ(filter.covariance().col(column), VectorXd::Zero(filter.size()));
    EXPECT_EQ(filter.covariance().row(column).transpose(), VectorXd::Zero(filter.size()));
  }
  EXPECT_NE(now(kBaseNumbersId)[0], 0.05);
  EXPECT_NE(now(kBaseNumbersId)[2], 0.3);
  EXPECT_NE(now(kBaseMountId)[1], 0.02);
  EXPECT_EQ(failure_of(filter), "");
}

}  // namespace
}  // namespace viwo
