// Swerve bases: their intrinsics in another odometry frame, and how they steer.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "viwo/math/se2.hpp"
#include "viwo/wheel/twist_solver.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

TEST(MoveFrame, GivesTheTwistOfTheOtherFrameFromTheSameReadings) {
  std::mt19937_64 rng(11);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  for (const char* type : {"four_wis_wid", "four_wis_wid_drive_only"}) {
    const auto model = testing::load_model(testing::swerve(type));
    int told = 0;
    for (int trial = 0; trial < 20; ++trial) {
      const Twist xi{uniform(rng), uniform(rng), 2. * uniform(rng)};
      const Eigen::Vector3d g{3. * uniform(rng), 0.3 * uniform(rng), 0.3 * uniform(rng)};
      EncoderSample sample;
      testing::follow(*model, xi, sample);
      Intrinsics moved = model->nominal();
      ASSERT_EQ(model->model().move_frame(g, moved), Status::kOk);
      TwistSolver solver(model, {});
      solver.set_intrinsics(moved);
      TwistSolution solution;
      ASSERT_EQ(solver.solve(sample, solution), Status::kOk);
      if (solution.rank_deficient) continue;  // drives of wheels that are nearly parallel
      ++told;
      // The velocity of the origin of O', written in O'.
      const Eigen::Vector2d v = xi.head<2>() + xi[2] * J2() * g.tail<2>();
      Twist expected;
      expected << R2(-g[0]) * v, xi[2];
      EXPECT_LT((solution.xi - expected).norm(), 1e-9);
      EXPECT_LT(solution.e.norm(), 1e-9);
    }
    EXPECT_GE(told, 15) << type;
  }
}

TEST(MoveFrame, ThereAndBackChangesNothing) {
  const auto model = testing::load_model(testing::swerve("four_wis_wid"));
  const Eigen::Vector3d g(0.7, -0.2, 0.4);
  Intrinsics x = model->nominal();
  model->model().move_frame(g, x);
  EXPECT_GT((x - model->nominal()).norm(), 0.1);
  model->model().move_frame(between(g, Eigen::Vector3d::Zero()), x);
  EXPECT_LT((x - model->nominal()).norm(), 1e-14);
}

/// Splines of motions that pause creep by less than a micrometre per second, in any direction.
TEST(SwerveInverse, SteersNoWheelOfABaseThatStands) {
  const auto model = testing::load_model(testing::swerve("four_wis_wid"));
  EncoderSample sample;
  testing::follow(*model, {0.5, 0.1, 0.3}, sample);
  const auto steered = sample.steer_rad;
  for (const Twist& creeping : {Twist(-1e-7, 3e-7, 1e-7), Twist(2e-7, -4e-7, -3e-7)}) {
    testing::follow(*model, creeping, sample);
    EXPECT_EQ(sample.steer_rad, steered);
    for (int j = 0; j < sample.n_drive; ++j) {
      EXPECT_LT(std::abs(sample.drive_rad_per_s[static_cast<std::size_t>(j)]), 1e-4);
    }
  }
  testing::follow(*model, {1e-4, 2e-4, 0.}, sample);
  EXPECT_NE(sample.steer_rad, steered);
}

}  // namespace
}  // namespace viwo
