// The plane: derivatives, what it says nothing about, consistency on it and off it.
#include <cmath>

#include <gtest/gtest.h>

#include "allocations.hpp"
#include "filter_fixture.hpp"
#include "message_of.hpp"
#include "planar_pair.hpp"
#include "plane_and_gnss_runs.hpp"
#include "viwo/sim/planar_motion.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace planar_motion;

constexpr std::int64_t kMs = 1'000'000;
const std::vector<std::string> kHalfAMinute{"sensors.simulator0.duration_s=30"};

ImuPose pose_of(const CloneState& clone) { return {clone.R_GtoI, clone.p_IinG}; }

/// A drive over a tilted plane (upright: over the horizontal one), two clones 0.1 s apart.
testing::SmallFilter driving(bool upright = false, double sigma = 1e-3) {
  testing::TiltedDrive drive;
  if (upright) drive.R_GtoW = exp_so3({0., 0., 0.7});
  sim::PlanarMotion motion("icr_sweep", {.ramp_s = 0.});
  sim::PoseIntegrator pose(motion);
  testing::SmallFilter filter(testing::free_wheels(drive));
  for (int k = 0; k < 2; ++k) {
    const double t = 1. + 0.1 * k;
    filter.clones.push_back(
        drive.clone((1000 + 100 * k) * kMs, k, pose.advance_to(t), motion.twist(t)));
  }
  filter.layout();
  filter.P.setIdentity();
  filter.P *= sigma * sigma;
  return filter;
}

ResidualFactor factor(testing::SmallFilter filter, const std::string& more = "") {
  const auto update = testing::load_update("{type: planar_motion" + more + "}");
  filter.start(*update);
  FactorSink sink(1, 60);
  update->update(filter.view(), {}, sink);
  EXPECT_EQ(sink.residuals().size(), 1u);
  return sink.residuals()[0];
}

TEST(PlanarPair, HasTheDerivativesOfCentralDifferencesByThePosesAtRandomStates) {
  std::mt19937_64 rng(7);
  for (int trial = 0; trial < 50; ++trial) {
    const VectorXd n = testing::gaussian(24, rng);
    const ImuPose first{exp_so3(n.segment<3>(0)), n.segment<3>(3)};
    const ImuPose last{exp_so3(0.3 * n.segment<3>(6)) * first.R_GtoI,
                       first.p_IinG + 0.3 * n.segment<3>(9)};
    const Extrinsics mount{exp_so3(n.segment<3>(12)), n.segment<3>(15)};
    const auto predict = [&](const VectorXd& d) -> VectorXd {
      const ImuPose a{exp_so3(-d.segment<3>(0)) * first.R_GtoI, first.p_IinG + d.segment<3>(3)};
      const ImuPose b{exp_so3(-d.segment<3>(6)) * last.R_GtoI, last.p_IinG + d.segment<3>(9)};
      return off_plane(a, b, mount);
    };
    PairJacobian J;
    poses_jacobian(first, last, mount, J);
    EXPECT_EQ(testing::jacobian_mismatch(
                  J.leftCols<12>(), testing::central_difference(predict, VectorXd::Zero(12)), {}),
              "");
  }
}

TEST(PlanarPair, HasTheDerivativesOfCentralDifferencesByTheMountOnThePlane) {
  for (const bool upright : {false, true}) {
    const testing::SmallFilter filter = driving(upright);
    const WheelsView wheels = filter.wheels_view();
    const ImuPose first = pose_of(filter.clones[0]), last = pose_of(filter.clones[1]);
    // The height in G tells nothing about the mount where the plane is level.
    const int rows = upright ? 4 : 3;
    const auto predict = [&](const VectorXd& d) -> VectorXd {
      return off_plane(first, last,
                       {exp_so3(-d.head<3>()) * wheels.R_ItoO, wheels.p_IinO + d.tail<3>()})
          .head(rows);
    };
    const Eigen::MatrixXd numeric = testing::central_difference(predict, VectorXd::Zero(6));
    PairJacobian J;
    mount_jacobian(first, last, {wheels.R_ItoO, wheels.p_IinO}, J);
    EXPECT_EQ(testing::jacobian_mismatch(J.topRightCorner(rows, 3), numeric.leftCols(3), {}), "");
    // It does tell about the tilt, and nothing about where O is.
    EXPECT_GT(numeric.leftCols(2).cwiseAbs().maxCoeff(), 0.01);
    EXPECT_LT(numeric.rightCols(3).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT(numeric.col(2).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(PlanarMotionUpdate, HasNoResidualWhereTheBaseStaysOnItsPlane) {
  const ResidualFactor on_slope = factor(driving());
  EXPECT_EQ(on_slope.residual.size(), 3);
  EXPECT_LT(on_slope.residual.cwiseAbs().maxCoeff(), 1e-9);
  const ResidualFactor level = factor(driving(true), ", ground: horizontal");
  EXPECT_EQ(level.residual.size(), 4);
  EXPECT_LT(level.residual.cwiseAbs().maxCoeff(), 1e-9);
  // A slope is not level: 0.4 m/s on 20 degrees.
  EXPECT_GT(factor(driving(), ", ground: horizontal").residual.cwiseAbs().maxCoeff(), 1e-3);
}

TEST(PlanarMotionUpdate, HasTheDerivativesOfItsResidualAndThoseOfPosesAtFirstEstimates) {
  const testing::SmallFilter truth = driving(true);
  const auto residual = [&](const VectorXd& d) -> VectorXd {
    testing::SmallFilter moved = truth;
    moved.plus(d);
    return factor(moved, ", ground: horizontal").residual;
  };
  const auto size = truth.P.rows();
  const ResidualFactor at_truth = factor(truth, ", ground: horizontal");
  EXPECT_EQ(
      testing::jacobian_mismatch(-testing::SmallFilter::spread(at_truth.columns, at_truth.H, size),
                                 testing::central_difference(residual, VectorXd::Zero(size)), {}),
      "");
  std::mt19937_64 rng(3);
  VectorXd off = VectorXd::Zero(size);
  off.segment(kImuSize, 12) = 0.01 * testing::gaussian(12, rng);
  testing::SmallFilter moved = truth;
  moved.plus(off);
  EXPECT_LT((factor(moved).H - factor(truth).H).leftCols(12).cwiseAbs().maxCoeff(), 1e-12);
  moved.first_estimates();
  EXPECT_GT((factor(moved).H - factor(truth).H).leftCols(12).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(PlanarMotionUpdate, LeavesTheLeverArmAsItWas) {
  testing::SmallFilter filter = driving(true);
  const int mount = filter.column(filter.wheels.extrinsics);
  filter.P.diagonal().segment<3>(mount).setConstant(0.01 * 0.01);
  filter.P.diagonal().segment<3>(mount + 3).setConstant(0.1 * 0.1);
  FactorSink sink(1, 60);
  sink.add_residual() = factor(filter, ", ground: horizontal");
  EXPECT_EQ(sink.residuals()[0].columns.size(), 15);
  filter.apply(sink);
  for (int i = 0; i < 3; ++i) EXPECT_DOUBLE_EQ(filter.P(mount + 3 + i, mount + 3 + i), 0.01);
  EXPECT_LT(filter.P(mount, mount), 0.0099 * 0.01);
  filter.blocks[static_cast<std::size_t>(filter.wheels.extrinsics.index)].column = -1;
  EXPECT_EQ(factor(filter).columns.size(), 12);
}

TEST(PlanarMotionUpdate, AddsNoiseThatGrowsWithThePath) {
  const testing::SmallFilter filter = driving();
  const double path =
      (filter.clones[1].p_IinG - filter.clones[0].p_IinG).norm();  // about that of O
  const ResidualFactor with = factor(filter,
                                     ", sigma_tilt_rad: 0.003, sigma_tilt_rad_per_sqrt_m: 0.02, "
                                     "sigma_height_m: 0.004, sigma_height_m_per_sqrt_m: 0.05");
  EXPECT_NEAR(with.R(0, 0), 9e-6 + path * 4e-4, 0.2 * path * 4e-4);
  EXPECT_EQ(with.R(1, 1), with.R(0, 0));
  EXPECT_NEAR(with.R(2, 2), 16e-6 + path * 25e-4, 0.2 * path * 25e-4);
}

TEST(PlanarMotionUpdate, IsConsistentWithTheFloorItAssumesAndNotWithTheWrongSign) {
  std::mt19937_64 rng(8);
  const testing::SmallFilter truth = driving(true, 2e-3);
  const int mount = truth.column(truth.wheels.extrinsics);
  constexpr int kRuns = 50, kTested = 15;
  double right = 0., wrong = 0.;
  for (int run = 0; run < kRuns; ++run) {
    testing::SmallFilter filter = truth;
    VectorXd drawn = 2e-3 * testing::gaussian(static_cast<int>(truth.P.rows()), rng);
    filter.plus(-drawn);
    filter.first_estimates();
    ResidualFactor measured =
        factor(filter,
               ", sigma_tilt_rad: 0.001, sigma_height_m: 0.001, sigma_tilt_rad_per_sqrt_m: 0, "
               "sigma_height_m_per_sqrt_m: 0");
    measured.residual += 0.001 * testing::gaussian(3, rng);  // what the floor gives
    for (const bool flip : {false, true}) {
      testing::SmallFilter updated = filter;
      FactorSink sink(1, 60);
      ResidualFactor& used = sink.add_residual();
      used = measured;
      if (flip) used.residual = -used.residual;
      updated.apply(sink);
      VectorXd error(kTested);
      for (int i = 0; i < 2; ++i) {
        const auto& is = truth.clones[static_cast<std::size_t>(i)];
        const auto& estimate = updated.clones[static_cast<std::size_t>(i)];
        error.segment<3>(6 * i) = -log_so3(is.R_GtoI * estimate.R_GtoI.transpose());
        error.segment<3>(6 * i + 3) = is.p_IinG - estimate.p_IinG;
      }
      error.tail<3>() = -log_so3(truth.wheels_view().R_ItoO * updated.R_ItoO().transpose());
      const Eigen::MatrixXd P = updated.P.block(kImuSize, kImuSize, kTested, kTested);
      ASSERT_EQ(mount, kImuSize + 12);
      const double nees = error.dot(P.ldlt().solve(error)) / kTested;
      (flip ? wrong : right) += nees / kRuns;
    }
  }
  // 99 % bounds of chi-square / dof for 750 degrees of freedom.
  EXPECT_GT(right, 0.87);
  EXPECT_LT(right, 1.14);
  EXPECT_GT(wrong, 1.3);
}

TEST(PlanarMotionUpdate, DoesNotAllocate) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  testing::SmallFilter filter = driving();
  const auto update = testing::load_update("{type: planar_motion}");
  filter.start(*update);
  FactorSink sink(1, 60);
  const FilterView view = filter.view();
  update->update(view, {}, sink);
  sink.clear();
  const long before = testing::allocations();
  update->update(view, {}, sink);
  EXPECT_EQ(testing::allocations() - before, 0);
  EXPECT_EQ(sink.residuals().size(), 1u);
}

TEST(PlanarMotionUpdate, WantsAWheelSet) {
  const auto update = testing::load_update("{type: planar_motion}");
  testing::UpdateHost no_wheels;
  EXPECT_EQ(testing::error_of([&] { update->declare(no_wheels); }),
            "needs wheels: there is no section 'kinematics'");
}

TEST(PlanarMotionRuns, AreConsistentOnAFloorAndDriftFarLess) {
  const auto plane = testing::plane_and_gnss("wheels_plane", 8, kHalfAMinute);
  EXPECT_EQ(testing::inconsistency(plane), "");
  EXPECT_LT(testing::parameter_nees(plane, "theta_ItoO_x"), 3.27);  // 99.9 % for 8 runs
  EXPECT_LT(testing::parameter_nees(plane, "theta_ItoO_y"), 3.27);
  const auto alone = testing::plane_and_gnss("wheels", 8, kHalfAMinute);
  double ratio = 0.;
  for (std::size_t i = 0; i < plane.size(); ++i) {
    ratio += plane[i].accuracy->ate_m / alone[i].accuracy->ate_m / 8.;
  }
  EXPECT_LT(ratio, 0.1);
  EXPECT_EQ(testing::counts(plane, "planar_motion").rejected, 0);
}

TEST(PlanarMotionRuns, ShowOnUnevenGroundThatItIsNoPlane) {
  std::vector<std::string> uneven = kHalfAMinute;
  uneven.emplace_back("sensors.simulator0.ground=uneven");
  const auto gated = testing::plane_and_gnss("wheels_plane", 8, uneven);
  const UpdateCounts counts = testing::counts(gated, "planar_motion");
  EXPECT_GT(counts.rejected, 4 * counts.applied);
  // What passes the gate by chance spoils the tilt of the mount; without gate the pose as well.
  EXPECT_GT(testing::parameter_nees(gated, "theta_ItoO_x"), 10.);
  uneven.emplace_back("updates.planar_motion.gate_probability=0");
  EXPECT_NE(testing::inconsistency(testing::plane_and_gnss("wheels_plane", 8, uneven)), "");
}

}  // namespace
}  // namespace viwo
