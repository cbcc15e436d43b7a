// Loads, tyres, play: against formulas of their own.
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "allocations.hpp"
#include "test_contact.hpp"

namespace viwo::contact {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kG = 9.81;

Base car(double length_m, double track_m) {
  return make_base({.base = "ackermann",
                    .x_m = {0., 0., length_m, length_m},
                    .y_m = {0.5 * track_m, -0.5 * track_m, 0.5 * track_m, -0.5 * track_m},
                    .radius_m = {0.05}});
}

/// The state of a base that moves like that for a while.
ContactState steady(const Base& base, const Physics& physics, const sim::BodyMotion& body) {
  ContactSolver solver(base, base, physics);
  const Demand demand = demand_of(body, physics);
  solver.stand(demand.xi);
  ContactState state;
  for (int k = 0; k < 100; ++k) EXPECT_TRUE(solver.step(demand, 0.01, state));
  return state;
}

TEST(Contact, WhatTheGroundMustDoIsWhatAcceleratesTheCentreOfMass) {
  Physics physics;
  physics.com_m = {0.03, -0.05, 0.2};
  const auto trajectory = sim::BodyTrajectory::drive(sim::PlanarMotion("icr_sweep"),
                                                     sim::Ground::uneven(0.05, 3.), -0.5, 21.);
  const auto com = [&](double t_s) -> Vector3d {
    const sim::BodyMotion body = trajectory.body(t_s);
    return body.p_BinG + body.R_BtoG * physics.com_m;
  };
  const double h = 1e-3;
  for (double t_s = 0.1; t_s < 20.; t_s += 0.37) {
    const sim::BodyMotion body = trajectory.body(t_s);
    const Demand demand = demand_of(body, physics);
    const Vector3d a = (com(t_s + h) - 2. * com(t_s) + com(t_s - h)) / (h * h);
    const Vector3d force = physics.mass_kg * body.R_BtoG.transpose() * (a + Vector3d(0., 0., kG));
    EXPECT_NEAR((demand.force_n - force).norm(), 0., 1e-3) << t_s;
    // About O: the moment of that force, and what changes the spin, by differences.
    const auto spin = [&](double t) -> Vector3d {
      const sim::BodyMotion at = trajectory.body(t);
      return at.R_BtoG * physics.inertia_kgm2.cwiseProduct(at.w_BwrtG_inB);
    };
    const Vector3d turn = body.R_BtoG.transpose() * (spin(t_s + h) - spin(t_s - h)) / (2. * h);
    EXPECT_NEAR((demand.moment_n_m - physics.com_m.cross(force) - turn).norm(), 0., 1e-3) << t_s;
  }
}

TEST(Contact, ForcesAndLoadsBalanceTheMotionOnUnevenGround) {
  Physics physics = slipping();
  physics.steer_play_rad = 0.003;
  physics.steer_lag_s = 0.02;
  physics.radius_loss_m_per_n = 1e-6;
  const Base base = square_swerve();
  const auto trajectory = sim::BodyTrajectory::drive(sim::PlanarMotion("icr_sweep"),
                                                     sim::Ground::uneven(0.05, 3.), -0.5, 61.);
  ContactSolver solver(base, base, physics);
  solver.stand(trajectory.twist(0.05));
  ContactState state;
  for (int k = 0; k < 6000; ++k) {
    const Demand demand = demand_of(trajectory.body(0.01 * k), physics);
    ASSERT_TRUE(solver.step(demand, 0.01, state)) << k;
    if (demand.xi.norm() < 0.01) continue;  // it stands, or hardly moves
    Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
    for (std::size_t j = 0; j < 4; ++j) {
      const WheelState& wheel = state.wheels[j];
      const Vector3d f(wheel.force_n.x(), wheel.force_n.y(), wheel.load_n);
      force += f;
      moment += Vector3d(wheel.place_m.x(), wheel.place_m.y(), 0.).cross(f);
      EXPECT_LE(wheel.force_n.norm(), physics.friction * wheel.load_n * (1. + 1e-12));
    }
    ASSERT_NEAR((force - demand.force_n).norm(), 0., 1e-4) << k;
    ASSERT_NEAR((moment - demand.moment_n_m).norm(), 0., 1e-4) << k;
  }
}

TEST(Contact, AStepDoesNotAllocate) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const Base base = square_swerve();
  const Physics physics = slipping();
  ContactSolver solver(base, base, physics);
  const Demand demand = demand_of(moving({0.5, 0.2, 0.4}), physics);
  solver.stand(demand.xi);
  ContactState state;
  const long before = testing::allocations();
  for (int k = 0; k < 10; ++k) EXPECT_TRUE(solver.step(demand, 0.01, state));
  EXPECT_EQ(testing::allocations() - before, 0);
}

TEST(Contact, BrakingLoadsTheFrontAndALeftTurnTheRight) {
  const Base base = square_swerve();
  const Physics physics;  // 30 kg, its centre of mass 0.15 m above the middle
  const double share = physics.mass_kg * kG / 4.;
  const Loads braking = wheel_loads(base, demand_of(moving({1., 0., 0.}, {-2., 0.}), physics));
  // m a h / (2 length) on each of the two wheels of an axle
  const double by_brake = 30. * 2. * 0.15 / (2. * 0.4);
  for (const std::size_t front : {0U, 3U}) EXPECT_NEAR(braking[front], share + by_brake, 1e-9);
  for (const std::size_t rear : {1U, 2U}) EXPECT_NEAR(braking[rear], share - by_brake, 1e-9);
  const Loads turning = wheel_loads(base, demand_of(moving({1., 0., 0.8}), physics));
  const double by_turn = 30. * 0.8 * 0.15 / (2. * 0.3);
  for (const std::size_t left : {0U, 1U}) EXPECT_NEAR(turning[left], share - by_turn, 1e-9);
  for (const std::size_t right : {2U, 3U}) EXPECT_NEAR(turning[right], share + by_turn, 1e-9);
}

TEST(Contact, AWheelThatWouldPullIsLifted) {
  Physics physics;
  physics.com_m = {0., 0., 1.};
  const Loads loads = wheel_loads(square_swerve(), demand_of(moving({2., 0., 0.9}), physics));
  EXPECT_EQ(loads[0], 0.);
  EXPECT_EQ(loads[1], 0.);
  EXPECT_NEAR(loads[2] + loads[3], 30. * kG, 1e-9);
}

TEST(Contact, ASteadyStraightLineReadsTheSpeedOverTheRadiusUnderItsLoad) {
  Physics physics = slipping();
  physics.com_m = {0.05, -0.03, 0.15};
  physics.radius_loss_m_per_n = 1e-5;
  const ContactState state = steady(square_swerve(), physics, moving({0.7, 0., 0.}));
  for (std::size_t j = 0; j < 4; ++j) {
    // Of a plate on four springs, 0.4 m by 0.3 m.
    const double load =
        30. * kG / 4. *
        (1. + (j == 0 || j == 3 ? 1. : -1.) * 0.05 / 0.2 + (j < 2 ? 1. : -1.) * -0.03 / 0.15);
    EXPECT_NEAR(state.wheels[j].load_n, load, 1e-9);
    EXPECT_NEAR(state.wheels[j].rate_rad_per_s, 0.7 / (0.05 - 1e-5 * load), 1e-9);
  }
}

TEST(Contact, ABaseThatGainsSpeedTurnsItsWheelsFasterAndOneThatBrakesSlower) {
  const Physics physics = slipping();
  for (const double a : {0.5, -0.5}) {
    const ContactState state = steady(square_swerve(), physics, moving({1., 0., 0.}, {a, 0.}));
    double mean = 0.;
    for (std::size_t j = 0; j < 4; ++j) mean += 0.25 * 0.05 * state.wheels[j].rate_rad_per_s;
    // Slip of 0.05 for a pull of the load; the brush gives way by a / (3 mu g) more.
    EXPECT_NEAR((mean - 1.) / (0.05 * a / kG), 1. + 0.5 / (3. * 0.8 * kG), 0.01);
  }
}

/// Steering of a car beyond what its geometry asks for, rad, on a circle of 100 m to the left.
double understeer(double com_x_m, double& sideways_m_per_s) {
  Physics physics = slipping();
  physics.com_m = {com_x_m, 0., 0.};
  physics.load_exponent = 0.8;
  physics.friction = 1e3;
  const ContactState state = steady(car(1., 0.02), physics, moving({2., 0., 0.02}));
  sideways_m_per_s = state.xi[1];
  return state.steer_rad[0] - std::atan(0.01);
}

TEST(Contact, ACarUndersteersAsTheBicycleModelSays) {
  // An axle with a share of the load carries that share of the lateral force: its slip angle is
  // 0.1 a/g (load / mean load)^0.2. What is left out is of the order of 0.01^2 (the steering angle
  // squared) of that, several times.
  const double a = 0.04;
  for (const double b : {0.7, 0.5, 0.3}) {
    const double front = 0.1 * a / kG * std::pow(2. * b, 0.2);
    const double rear = 0.1 * a / kG * std::pow(2. * (1. - b), 0.2);
    double v_y = 0.;
    EXPECT_NEAR(understeer(b, v_y), front - rear, 2e-7) << b;
    // The rear axle drifts outwards, to the right.
    EXPECT_NEAR(v_y, -2. * rear, 4e-7) << b;
  }
  double v_y = 0.;
  EXPECT_GT(understeer(0.7, v_y), 5e-5);
  EXPECT_LT(understeer(0.3, v_y), -5e-5);
}

TEST(Contact, ASkidSteeredBaseTurnsAboutPointsOutsideOfItsWheelsAndBehindALightFront) {
  const Base base = make_base({.base = "skid_steer",
                               .x_m = {0.2, -0.2, 0.2, -0.2},
                               .y_m = {0.2, 0.2, -0.2, -0.2},
                               .radius_m = {0.1}});
  Physics physics = slipping();
  physics.com_m = {-0.05, 0., 0.1};
  for (const double omega : {0.4, -0.4}) {
    const ContactState state = steady(base, physics, moving({0.3, 0., omega}));
    const double y_left = (0.3 - 0.1 * state.wheels[0].rate_rad_per_s) / omega;
    const double y_right = (0.3 - 0.1 * state.wheels[2].rate_rad_per_s) / omega;
    EXPECT_EQ(state.wheels[0].rate_rad_per_s, state.wheels[1].rate_rad_per_s);
    EXPECT_GT(y_left, 0.21);
    EXPECT_LT(y_right, -0.21);
    EXPECT_LT(-state.xi[1] / omega, -0.01);  // x_icr: towards the heavy rear
  }
}

TEST(Contact, PlayIsAHysteresisOfItsWidth) {
  Physics physics = slipping();
  physics.slip_per_load = physics.slip_angle_per_load_rad = 5e-3;
  physics.steer_play_rad = 0.01;
  const Base base = square_swerve();
  ContactSolver solver(base, base, physics);
  const auto direction_at = [](double t_s) { return 0.5 * std::sin(t_s); };
  solver.stand({1., 0., 0.});
  ContactState state;
  for (double t_s = 0.; t_s < 20.; t_s += 0.01) {
    const double angle = direction_at(t_s), rate = 0.5 * std::cos(t_s);
    sim::BodyMotion body = moving({std::cos(angle), std::sin(angle), 0.},
                                  rate * Vector2d(-std::sin(angle), std::cos(angle)));
    ASSERT_TRUE(solver.step(demand_of(body, physics), 0.01, state)) << t_s;
    for (std::size_t j = 0; j < 4; ++j) {
      const double ahead = state.steer_rad[j] - state.wheels[j].angle_rad;
      EXPECT_LE(std::abs(ahead), 0.005 + 1e-12);
      // The encoder leads by half the play in the direction in which it turns.
      if (t_s > 0.5 && std::abs(rate) > 0.1) {
        EXPECT_NEAR(ahead, std::copysign(0.005, rate), 1e-12) << t_s;
      }
      EXPECT_NEAR(state.wheels[j].angle_rad, angle, 5e-4) << t_s;
    }
  }
}

TEST(Contact, ASteeringThatLagsIsToldMore) {
  Physics physics = slipping();
  physics.slip_per_load = physics.slip_angle_per_load_rad = 5e-3;
  physics.steer_lag_s = 0.05;
  const Base base = square_swerve();
  ContactSolver solver(base, base, physics);
  solver.stand({1., 0., 0.});
  ContactState state;
  double angle = 0.;
  for (int k = 1; k <= 100; ++k) {
    angle = 0.2 * 0.01 * k;
    const sim::BodyMotion body = moving({std::cos(angle), std::sin(angle), 0.},
                                        0.2 * Vector2d(-std::sin(angle), std::cos(angle)));
    ASSERT_TRUE(solver.step(demand_of(body, physics), 0.01, state)) << k;
  }
  // A lag of first order, driven at a rate: behind by rate times lag (and half a step).
  const double told = std::atan2(state.commanded[1], state.commanded[0]);
  EXPECT_NEAR(told - angle, 0.2 * 0.05, 0.2 * 0.01);
  for (std::size_t j = 0; j < 4; ++j) EXPECT_NEAR(state.steer_rad[j], angle, 2e-4);
}

TEST(Contact, ReadingsWithLittleSlipAreTheIdealOnesAndSlipIsProportional) {
  const Base base = square_swerve();
  const sim::BodyMotion body = moving({0.8, 0.3, 0.4}, {0.3, -0.2});
  const ContactState ideal = steady(base, Physics{}, body);
  std::array<double, 2> off{};
  for (std::size_t i = 0; i < 2; ++i) {
    Physics physics = slipping();
    physics.slip_per_load = physics.slip_angle_per_load_rad = i == 0 ? 1e-4 : 0.5e-4;
    const ContactState state = steady(base, physics, body);
    for (std::size_t j = 0; j < 4; ++j) {
      off[i] += std::abs(state.wheels[j].rate_rad_per_s - ideal.wheels[j].rate_rad_per_s) +
                std::abs(state.steer_rad[j] - ideal.steer_rad[j]);
    }
  }
  EXPECT_LT(off[0], 1e-3);
  EXPECT_GT(off[0], 1e-5);
  EXPECT_NEAR(off[0] / off[1], 2., 1e-3);
}

TEST(Contact, ThereIsNoMoreForceThanFriction) {
  EXPECT_NEAR(brush_force({1e-3, 0.}, 10.).x(), 1e-3, 1e-7);
  EXPECT_NEAR(brush_force({0., -1e6}, 10.).y(), -10., 1e-9);
  // The part of the tread that holds shrinks linearly, down to none at three times the limit.
  EXPECT_NEAR(brush_force({0., 10.}, 10.).y(), 10. * (1. - std::pow(2. / 3., 3)), 1e-12);
  EXPECT_NEAR(brush_force({30., 0.}, 10.).x(), 10., 1e-12);
  const Base base = square_swerve();
  ContactSolver solver(base, base, slipping());
  solver.stand({1., 0., 0.});
  ContactState state;
  const auto at = [&](double a) {
    return solver.step(demand_of(moving({1., 0., 0.}, {a, 0.}), slipping()), 0.01, state);
  };
  EXPECT_TRUE(at(0.7 * kG));
  EXPECT_FALSE(at(0.9 * kG));
}

TEST(Contact, ServosThatHoldWhatAWrongControllerSaysHideItsErrorFromTheEncoders) {
  // Offsets that the controller does not know: the wheels fight each other, and what the encoders
  // read still fits the controller's base, not the true one.
  Base truth = square_swerve();
  const double errors[] = {0., 0.02, -0.01, 0.015};
  for (std::size_t k = 0; k < 4; ++k) truth.steerings[k].offset_rad = errors[k];
  const Physics physics = slipping();
  ContactSolver solver(truth, square_swerve(), physics);
  const Demand demand = demand_of(moving({1., 0., 0.}), physics);
  solver.stand(demand.xi);
  ContactState state;
  ASSERT_TRUE(solver.step(demand, 0.01, state));
  for (std::size_t j = 0; j < 4; ++j) {
    const Vector2d told = velocity_at(state.commanded, truth.wheels[j].place_m);
    EXPECT_NEAR(state.steer_rad[j], std::atan2(told.y(), told.x()), 1e-12);
    EXPECT_NEAR(state.wheels[j].rate_rad_per_s, told.norm() / 0.05, 1e-9);
    EXPECT_NEAR(state.wheels[j].angle_rad, state.steer_rad[j] - errors[j], 1e-12);
    EXPECT_GT(state.wheels[j].force_n.norm(), 1.);  // nothing pulls at the base, but they do
  }
}

}  // namespace
}  // namespace viwo::contact
