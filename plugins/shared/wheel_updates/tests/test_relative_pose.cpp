// The planar pose between two instants: derivatives against central differences.
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "relative_pose.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using Eigen::VectorXd;
using namespace wheel_motion;

TEST(RelativePose, HasTheDerivativesOfCentralDifferencesAtRandomStates) {
  std::mt19937_64 rng(7);
  for (int trial = 0; trial < 50; ++trial) {
    const VectorXd n = testing::gaussian(30, rng);
    MovingPose first, last;
    first.R_GtoI = exp_so3(n.segment<3>(0));
    last.R_GtoI = exp_so3(0.3 * n.segment<3>(3)) * first.R_GtoI;
    first.p_IinG = n.segment<3>(6);
    last.p_IinG = first.p_IinG + 0.3 * n.segment<3>(9);
    first.w_IinI = n.segment<3>(12);
    last.w_IinI = n.segment<3>(15);
    first.v_IinI = n.segment<3>(18);
    last.v_IinI = n.segment<3>(21);
    first.after_s = 0.02 * n[24];
    last.after_s = 0.02 * n[25];
    const Extrinsics mount{exp_so3(n.segment<3>(26)), n.segment<3>(0)};
    const auto predict = [&](const VectorXd& d) -> VectorXd {
      MovingPose a = first, b = last;
      a.R_GtoI = exp_so3(-d.segment<3>(kFirstTheta)) * a.R_GtoI;
      a.p_IinG += d.segment<3>(kFirstPosition);
      b.R_GtoI = exp_so3(-d.segment<3>(kLastTheta)) * b.R_GtoI;
      b.p_IinG += d.segment<3>(kLastPosition);
      a.after_s += d[kTimeOffset];
      b.after_s += d[kTimeOffset];
      const Extrinsics m{exp_so3(-d.segment<3>(kMountTheta)) * mount.R_ItoO,
                         mount.p_IinO + d.segment<3>(kMountPosition)};
      return relative_pose(a, b, m);
    };
    EXPECT_EQ(testing::jacobian_mismatch(
                  relative_pose_jacobian(first, last, mount),
                  testing::central_difference(predict, VectorXd::Zero(kGeometrySize)), {}, 1e-6),
              "");
  }
}

TEST(RelativePose, HasTheDerivativesOfItsTiltWhereItTurnsLittle) {
  std::mt19937_64 rng(8);
  for (int trial = 0; trial < 20; ++trial) {
    const VectorXd n = testing::gaussian(12, rng);
    MovingPose first, last;
    first.R_GtoI = exp_so3(n.segment<3>(0));
    last.R_GtoI = exp_so3(1e-4 * n.segment<3>(3)) * first.R_GtoI;
    const Extrinsics mount{exp_so3(n.segment<3>(6)), n.segment<3>(9)};
    const auto predict = [&](const VectorXd& d) -> VectorXd {
      MovingPose a = first, b = last;
      a.R_GtoI = exp_so3(-d.segment<3>(kFirstTheta)) * a.R_GtoI;
      b.R_GtoI = exp_so3(-d.segment<3>(kLastTheta)) * b.R_GtoI;
      Eigen::Vector2d tilt;
      relative_pose(a, b, mount, &tilt);
      return tilt;
    };
    EXPECT_EQ(testing::jacobian_mismatch(
                  tilt_jacobian(first, last, mount),
                  testing::central_difference(predict, VectorXd::Zero(kGeometrySize)), {}, 1e-3),
              "");
  }
}

}  // namespace
}  // namespace viwo
