// Samples that do not tell a twist, or not all of it.
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/wheel/twist_solver.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::follow;
using testing::load_model;
using testing::swerve;

TEST(TwistSolver, CountsParallelRollingRowsAsRankDeficientAndStaysFinite) {
  const auto model = load_model(
      "{type: four_wis_wid_drive_only, radius_m: 0.0254, x_m: [0.1, -0.1, -0.1, 0.1], "
      "y_m: [0.1, 0.1, -0.1, -0.1]}");
  TwistSolver solver(model, {});
  for (const Twist& xi : {Twist(0.5, 0., 0.), Twist(0., 0.5, 0.), Twist(0.3, 0.3, 0.)}) {
    EncoderSample y;
    follow(*model, xi, y);
    TwistSolution solution;
    ASSERT_EQ(solver.solve(y, solution), Status::kOk);
    EXPECT_TRUE(solution.rank_deficient);
    EXPECT_LT((solution.xi - xi).norm(), 1e-9) << "the missing velocity is taken as zero";
    EXPECT_TRUE(solution.J_xi_WI.allFinite());
    // What the rows cannot tell is uncertain: across the rolling direction.
    const Eigen::Vector2d across = J2() * xi.head<2>().normalized();
    const double sigma_across = std::sqrt(across.dot(solution.P_xi.topLeftCorner<2, 2>() * across));
    EXPECT_GT(sigma_across, 0.05);
    EXPECT_LT(solution.P_xi(2, 2), 1.);
  }
}

// Where the rows tell the whole twist they do so however noisy one of them is.
TEST(TwistSolver, TakesANoisyRowForANoisyOne) {
  constexpr double kSigmas[] = {0.001, 0.0099, 0.02, 0.5};
  for (const double sigma : kSigmas) {
    const auto model = load_model(
        "{type: differential, radius_left_m: 0.1, radius_right_m: 0.1, baseline_m: 0.5, "
        "sigma_drive_rad_per_s: 0.001, "
        "sigma_lateral_m_per_s: " +
        std::to_string(sigma) + "}");
    TwistSolver solver(model, {.noise_weighted = true});
    EncoderSample y;
    follow(*model, {0.5, 0., 0.2}, y);
    TwistSolution solution;
    ASSERT_EQ(solver.solve(y, solution), Status::kOk);
    EXPECT_FALSE(solution.rank_deficient);
    EXPECT_NEAR(std::sqrt(solution.P_xi(1, 1)), sigma, 1e-6 * sigma);
  }
}

// A row that says that nothing goes sideways is no measurement of a base that goes nowhere.
TEST(TwistSolver, RefusesASampleOfWhichNoDriveIsLeft) {
  for (const std::string& base :
       {swerve("four_wis_wid"),
        std::string("{type: differential, radius_left_m: 0.1, radius_right_m: 0.1, "
                    "baseline_m: 0.5}"),
        std::string("{type: ackermann, wheel_base_m: 0.5, track_m: 0.4, radius_m: [0.1], "
                    "wheel_speeds: all, steering: both}")}) {
    const auto model = load_model(base);
    TwistSolver solver(model, {.noise_weighted = true});
    EncoderSample y;
    follow(*model, {0.3, 0., 0.1}, y);
    TwistSolution solution;
    y.bad_drives = (1u << model->description().n_drive) - 1u;
    EXPECT_EQ(solver.solve(y, solution), Status::kRejected) << base;
    y.bad_drives = 0;
    EXPECT_EQ(solver.solve(y, solution), Status::kOk) << base;
  }
}

TEST(TwistSolver, RefusesASampleThatIsNotFinite) {
  const auto model = load_model(swerve("four_wis_wid"));
  TwistSolver solver(model, {});
  EncoderSample y;
  follow(*model, {0.1, 0., 0.2}, y);
  y.drive_rad_per_s[2] = std::nan("");
  TwistSolution solution;
  EXPECT_EQ(solver.solve(y, solution), Status::kRejected);
}

TEST(WheelModel, NamesBothCountsWhenASampleHasOtherChannels) {
  const auto model = load_model(swerve("four_wis_wid"));
  EncoderSample y;
  y.n_drive = 2;
  y.n_steer = 0;
  EXPECT_EQ(testing::error_of([&] { model->require_channels(y, "sensors.wheels0"); }),
            "sensors.wheels0 has 2 drive and 0 steering channels, but the kinematic model has "
            "4 driven and 4 steered wheels");
}

}  // namespace
}  // namespace viwo
