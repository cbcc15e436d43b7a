// Pieces of motion: within the limits of the base, at the price that is said.
#include <gtest/gtest.h>

#include "plan_files.hpp"
#include "viwo/math/se2.hpp"

namespace viwo {
namespace {

using plan::LimitParams;
using plan::Piece;

/// By how much a motion exceeds its limits at worst, found with differences of two milliseconds: 1
/// is just within.
double worst_use(const std::function<Twist(double)>& twist, double duration_s,
                 const LimitParams& limits) {
  constexpr double kStep_s = 2e-3;
  double worst = 0.;
  for (double t_s = kStep_s; t_s < duration_s; t_s += kStep_s) {
    const Twist xi = twist(t_s);
    // The velocity of four points of the rim in the frame of the floor, before and after.
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2d point = limits.base_radius_m * R2(k * M_PI / 2.).col(0);
      const auto velocity = [&](double at_s, double yaw_rad) -> Eigen::Vector2d {
        const Twist moved = twist(at_s);
        return R2(yaw_rad) * (moved.head<2>() + moved[2] * (J2() * point));
      };
      const double turned = 0.5 * kStep_s * xi[2];
      const Eigen::Vector2d acceleration =
          (velocity(t_s + 0.5 * kStep_s, turned) - velocity(t_s - 0.5 * kStep_s, -turned)) /
          kStep_s;
      worst = std::max({worst, velocity(t_s, 0.).norm() / limits.max_speed_m_per_s,
                        acceleration.norm() / limits.max_acceleration_m_per_s2,
                        std::abs(xi[2]) / limits.max_yaw_rate_rad_per_s});
    }
  }
  return worst;
}

TEST(Pieces, KeepAllLimitsWhateverTheyAre) {
  for (const double slower : {1., 0.3}) {
    LimitParams limits;
    limits.base_radius_m = 0.3;
    limits.max_speed_m_per_s = 1. * slower;
    limits.max_yaw_rate_rad_per_s = 1.2;
    limits.max_acceleration_m_per_s2 = 0.4 / slower;
    int limited = 0;
    for (const plan::Shape& shape : plan::shapes_for(limits.base_radius_m)) {
      const Piece piece = drive(shape, limits);
      const double use = worst_use(piece.twist, piece.duration_s, limits);
      EXPECT_LE(use, 1.) << shape.name;
      if (use > 0.85) ++limited;  // nor is it slower than need be: points of the rim are few
    }
    EXPECT_GT(limited, 50);
  }
}

TEST(Pieces, DrivenFasterWouldExceedALimit) {
  LimitParams limits;
  limits.base_radius_m = 0.3;
  const Piece piece = drive(plan::shapes_for(0.3).front(), limits);
  const auto faster = [&](double t_s) -> Twist { return 1.1 * piece.twist(1.1 * t_s); };
  EXPECT_GT(worst_use(faster, piece.duration_s, limits), 1.);
}

TEST(Pieces, CostTheWayOfTheFastestPoint) {
  LimitParams limits;
  limits.base_radius_m = 0.3;
  limits.pause_s = 1.;
  const plan::Shape line{"", [](double) { return Twist(0.6, 0.8, 0.); }};
  const Piece straight = drive(line, limits);
  EXPECT_NEAR(straight.cost_m, 1., 1e-6);
  EXPECT_NEAR(straight.path_m, 1., 1e-6);
  EXPECT_LT((straight.end() - Eigen::Vector3d(0., 0.6, 0.8)).norm(), 1e-9);
  LimitParams unpaused = limits;
  unpaused.pause_s = 0.;
  EXPECT_NEAR(straight.duration_s - drive(line, unpaused).duration_s, 1., 1e-12);
  const Piece spin = drive({"", [](double) { return Twist(0., 0., 2.); }}, limits);
  EXPECT_NEAR(spin.cost_m, 0.6, 1e-6);
  EXPECT_EQ(spin.path_m, 0.);
  EXPECT_NEAR(spin.end()[0], 2., 1e-9);
}

/// The way is that of the shape, at any speed.
TEST(Pieces, GoTheSameWayFastAndSlowly) {
  LimitParams fast, slow;
  fast.base_radius_m = slow.base_radius_m = 0.2;
  slow.max_speed_m_per_s = 0.1;
  for (const plan::Shape& shape : plan::shapes_for(0.2)) {
    const Piece a = drive(shape, fast), b = drive(shape, slow);
    EXPECT_LT((a.end() - b.end()).norm(), 1e-4) << shape.name;
  }
}

TEST(Pieces, AreThoseThatTheBaseCanFollow) {
  const auto sideways = [](const std::vector<Piece>& pieces, const LimitParams& limits) {
    return std::count_if(pieces.begin(), pieces.end(), [&](const Piece& piece) {
      return std::abs(piece.twist(0.5 * (piece.duration_s - limits.pause_s))[1]) > 1e-9;
    });
  };
  const plan::PlanSetup swerve = testing::swerve_plan();
  plan::WheelInformation swerve_wheels(swerve.model, swerve.params);
  const auto of_swerve = make_pieces(swerve_wheels, swerve.params);
  EXPECT_EQ(of_swerve.size(), plan::shapes_for(0.2).size());
  EXPECT_GT(sideways(of_swerve, swerve.params), 50);

  const plan::PlanSetup differential = testing::differential_plan();
  plan::WheelInformation wheels(differential.model, differential.params);
  const auto pieces = make_pieces(wheels, differential.params);
  EXPECT_GT(pieces.size(), 20u);
  EXPECT_LT(pieces.size(), of_swerve.size());
  EXPECT_EQ(sideways(pieces, differential.params), 0);

  const plan::PlanSetup car = testing::differential_plan({"min_turn_radius_m=0.5"});
  const auto wide = make_pieces(wheels, car.params);
  EXPECT_LT(wide.size(), pieces.size());
  for (const Piece& piece : wide) {
    for (double t_s = 0.; t_s < piece.duration_s; t_s += 0.05) {
      const Twist xi = piece.twist(t_s);
      EXPECT_GE(xi.head<2>().norm(), 0.5 * std::abs(xi[2]) * (1. - 1e-9)) << piece.name;
    }
  }
}

TEST(Pieces, StayOnTheFloorOnlyWhereThereIsRoomForTheBase) {
  LimitParams limits;
  limits.base_radius_m = 0.3;
  limits.floor_x_m = 2.;
  limits.floor_y_m = 1.;
  const Piece piece = drive({"", [](double) { return Twist(0.6, 0., 0.); }}, limits);
  EXPECT_TRUE(stays_on_floor(piece, {0., 0., 0.}, limits));
  EXPECT_FALSE(stays_on_floor(piece, {0., 0.2, 0.}, limits));
  EXPECT_TRUE(stays_on_floor(piece, {M_PI, 0.2, 0.}, limits));
  EXPECT_FALSE(stays_on_floor(piece, {M_PI / 2., 0., 0.}, limits));
}

}  // namespace
}  // namespace viwo
