// Motions and their poses against closed forms and an independent integration.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "message_of.hpp"
#include "viwo/sim/planar_motion.hpp"

namespace viwo::sim {
namespace {

constexpr double kV = 0.5;
constexpr double kW = 0.6;
const MotionOptions kNoRamp{kV, kW, 0.};
const MotionOptions kRamp{kV, kW, 1.};

Eigen::Vector3d pose(const PlanarMotion& motion, double t, double max_step_s = 1e-3) {
  return PoseIntegrator(motion, max_step_s).advance_to(t);
}

double distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).lpNorm<Eigen::Infinity>();
}

TEST(PlanarMotion, RampTakesHalfItsDurationAndKeepsThePath) {
  const PlanarMotion motion("circle", kRamp);
  EXPECT_EQ(motion.progress(-1.), 0.);
  EXPECT_NEAR(motion.progress(0.5), 0.078125, 1e-15);
  EXPECT_NEAR(motion.progress(1.), 0.5, 1e-15);
  EXPECT_NEAR(motion.progress(7.), 6.5, 1e-14);
  EXPECT_EQ(motion.twist(-1.), Twist::Zero());
  EXPECT_NEAR(motion.twist(0.5)[0], 0.25, 1e-15);
  for (const std::string& name : PlanarMotion::names()) {
    EXPECT_LT(distance(pose(PlanarMotion(name, kRamp), 8.), pose(PlanarMotion(name, kNoRamp), 7.5)),
              1e-11)
        << name;
  }
}

TEST(PlanarMotion, TwistsHaveNoKinks) {
  for (const std::string& name : PlanarMotion::names()) {
    const PlanarMotion motion(name, kRamp);
    const double h = 1e-4;
    for (double t = -0.01; t < 1.5; t += h) {
      const Twist second =
          (motion.twist(t + h) - 2. * motion.twist(t) + motion.twist(t - h)) / (h * h);
      // 5.8 is the largest second derivative of the ramp; a kink would show as 1 / h.
      EXPECT_LT(second.lpNorm<Eigen::Infinity>(), 8.) << name << " at " << t;
    }
  }
}

TEST(PlanarMotion, SimpleMotionsFollowTheirClosedForms) {
  const double t = 13.7;
  EXPECT_LT(distance(pose(PlanarMotion("straight", kRamp), t), {0., kV * (t - 0.5), 0.}), 1e-12);
  EXPECT_LT(distance(pose(PlanarMotion("lateral", kRamp), t), {0., 0., kV * (t - 0.5)}), 1e-12);
  EXPECT_LT(distance(pose(PlanarMotion("spin", kRamp), t), {kW * (t - 0.5), 0., 0.}), 1e-11);
  EXPECT_EQ(pose(PlanarMotion("stationary", kRamp), t), Eigen::Vector3d::Zero());
  const double yaw = kW * (t - 0.5);
  EXPECT_LT(distance(pose(PlanarMotion("circle", kRamp), t),
                     {yaw, kV / kW * std::sin(yaw), kV / kW * (1. - std::cos(yaw))}),
            1e-11);
}

TEST(PlanarMotion, ConstantTwistsAreExactForAnyStep) {
  const double yaw = kW * 9.;
  EXPECT_LT(distance(pose(PlanarMotion("circle", kNoRamp), 9., 9.),
                     {yaw, kV / kW * std::sin(yaw), kV / kW * (1. - std::cos(yaw))}),
            1e-14);
}

TEST(PlanarMotion, FigureEightClosesAfterOnePeriodWithBothTurns) {
  const PlanarMotion motion("figure_eight", kNoRamp);
  const double period = figure_eight_period_s(kNoRamp);
  EXPECT_LT(distance(pose(motion, period), Eigen::Vector3d::Zero()), 1e-10);
  EXPECT_NEAR(pose(motion, 0.5 * period)[0], 2. * 2.404825557695773, 1e-10);
  EXPECT_NEAR(motion.twist(0.25 * period)[2], kW, 1e-12);
  EXPECT_NEAR(motion.twist(0.75 * period)[2], -kW, 1e-12);
  EXPECT_NEAR(motion.twist(0.3 * period)[0], kV, 1e-15);
}

TEST(PlanarMotion, ConstantSteeringStaysOnItsCircleAtVaryingSpeed) {
  PoseIntegrator integrator(PlanarMotion("constant_steering", kRamp));
  const PlanarMotion motion("constant_steering", kRamp);
  double slowest = kV, fastest = kV;
  for (double t = 0.; t < 20.; t += 0.1) {
    const Eigen::Vector3d& g = integrator.advance_to(t);
    EXPECT_NEAR(std::hypot(g[1], g[2] - kV / kW), kV / kW, 1e-11);
    EXPECT_NEAR(motion.twist(t)[2] * kV, motion.twist(t)[0] * kW, 1e-15);
    if (t > 1.) slowest = std::min(slowest, motion.twist(t)[0]);
    fastest = std::max(fastest, motion.twist(t)[0]);
  }
  EXPECT_LT(slowest, 0.6 * kV);
  EXPECT_GT(fastest, 1.4 * kV);
}

TEST(PlanarMotion, CrabVaryingTurnsItsDirectionAndNotTheBase) {
  const PlanarMotion motion("crab_varying", kRamp);
  double largest = 0.;
  for (double t = 1.; t < 20.; t += 0.1) {
    const Twist xi = motion.twist(t);
    EXPECT_EQ(xi[2], 0.);
    EXPECT_NEAR(xi.head<2>().norm(), kV, 1e-15);
    largest = std::max(largest, std::abs(std::atan2(xi[1], xi[0])));
  }
  EXPECT_NEAR(largest, 1.5, 0.01);
}

TEST(PlanarMotion, IcrSweepPutsTheCentreOfRotationOnAllSides) {
  const PlanarMotion motion("icr_sweep", kRamp);
  int quadrants = 0;
  for (double t = 1.; t < 60.; t += 0.05) {
    const Twist xi = motion.twist(t);
    if (std::abs(xi[2]) < 0.1) continue;
    const double x = -xi[1] / xi[2], y = xi[0] / xi[2];  // centre of rotation in O
    quadrants |= 1 << ((x > 0. ? 1 : 0) + (y > 0. ? 2 : 0));
  }
  EXPECT_EQ(quadrants, 0b1111);
}

/// Plain Runge-Kutta on x' = R(yaw) v, yaw' = omega.
Eigen::Vector3d runge_kutta(const PlanarMotion& motion, double t_end, double h) {
  const auto rate = [&](double t, const Eigen::Vector3d& g) -> Eigen::Vector3d {
    const Twist xi = motion.twist(t);
    const double c = std::cos(g[0]), s = std::sin(g[0]);
    return {xi[2], c * xi[0] - s * xi[1], s * xi[0] + c * xi[1]};
  };
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  const int n = static_cast<int>(std::lround(t_end / h));
  for (int i = 0; i < n; ++i) {
    const double t = i * h;
    const Eigen::Vector3d k1 = rate(t, g), k2 = rate(t + h / 2., g + h / 2. * k1);
    const Eigen::Vector3d k3 = rate(t + h / 2., g + h / 2. * k2), k4 = rate(t + h, g + h * k3);
    g += h / 6. * (k1 + 2. * k2 + 2. * k3 + k4);
  }
  return g;
}

TEST(PoseIntegrator, AgreesWithAnIndependentIntegrationForEveryMotion) {
  for (const std::string& name : PlanarMotion::names()) {
    const PlanarMotion motion(name, kRamp);
    EXPECT_LT(distance(pose(motion, 20.), runge_kutta(motion, 20., 1e-3)), 1e-10) << name;
  }
}

TEST(PoseIntegrator, IsAccurateToANanometreOverAMinute) {
  for (const std::string& name : PlanarMotion::names()) {
    const PlanarMotion motion(name, kRamp);
    EXPECT_LT(distance(pose(motion, 60.), pose(motion, 60., 1e-4)), 1e-9) << name;
  }
}

TEST(PoseIntegrator, IsOfFourthOrder) {
  const PlanarMotion motion("icr_sweep", kNoRamp);
  const Eigen::Vector3d exact = pose(motion, 10.);
  const double coarse = distance(pose(motion, 10., 0.2), exact);
  const double fine = distance(pose(motion, 10., 0.1), exact);
  EXPECT_GT(coarse, 1e-8);
  EXPECT_NEAR(coarse / fine, 16., 2.);
}

TEST(PoseIntegrator, GivesTheSamePoseInOneCallOrMany) {
  const PlanarMotion motion("icr_sweep", kRamp);
  PoseIntegrator integrator(motion);
  for (int i = 0; i <= 3000; ++i) integrator.advance_to(0.01 * i);
  EXPECT_LT(distance(integrator.advance_to(30.), pose(motion, 30.)), 1e-12);
  EXPECT_THROW(integrator.advance_to(29.), std::logic_error);
}

TEST(PlanarMotion, ThePivotDoesNotMove) {
  MotionOptions options = kNoRamp;
  options.pivot_m = {0.1125, -0.07};
  const PlanarMotion motion("pivot", options);
  for (const double t : {0., 1.7, 4.2}) {
    const Twist xi = motion.twist(t);
    EXPECT_GT(xi.z(), 0.2);
    EXPECT_NEAR(xi.x() - options.pivot_m.y() * xi.z(), 0., 1e-15);
    EXPECT_NEAR(xi.y() + options.pivot_m.x() * xi.z(), 0., 1e-15);
  }
}

TEST(PlanarMotion, SweepThenStraightIsTheSweepThenAStraightLineAndSmoothBetween) {
  const PlanarMotion motion("sweep_then_straight", kNoRamp), sweep("icr_sweep", kNoRamp);
  for (const double t : {0., 7.3, 20.}) EXPECT_EQ(motion.twist(t), sweep.twist(t));
  for (const double t : {22., 31.7, 60.}) EXPECT_EQ(motion.twist(t), Twist(kV, 0., 0.));
  // Second differences change as little as those of a curve with a third derivative do.
  constexpr double h = 1e-3;
  const auto second = [&](double t) -> Twist {
    return (motion.twist(t + h) - 2. * motion.twist(t) + motion.twist(t - h)) / (h * h);
  };
  for (double t = 19.9; t < 22.1; t += h) {
    EXPECT_LT((second(t + h) - second(t)).norm(), 0.05) << t;
  }
}

TEST(PlanarMotion, MixedIsAllOfThemByTurnsAndSmoothBetween) {
  const PlanarMotion motion("mixed", kNoRamp), sweep("icr_sweep", kNoRamp);
  const auto expect = [&](double t, const Twist& xi) {
    EXPECT_LT((motion.twist(t) - xi).norm(), 1e-12) << t;
  };
  for (const double t : {0., 7.3, 19.9, 125., 245.}) expect(t, sweep.twist(t));
  for (const double t : {22., 39.9, 150.}) expect(t, Twist(kV, 0., 0.));
  for (const double t : {65., 185.}) expect(t, Twist(0., kV, 0.));
  for (const double t : {85., 99., 205.}) expect(t, Twist(0., 0., 0.));
  expect(105., -motion.twist(45.));
  constexpr double h = 1e-3;
  const auto second = [&](double t) -> Twist {
    return (motion.twist(t + h) - 2. * motion.twist(t) + motion.twist(t - h)) / (h * h);
  };
  for (const double change : {20., 40., 60., 80., 100., 120.}) {
    for (double t = change - 0.1; t < change + 2.1; t += h) {
      EXPECT_LT((second(t + h) - second(t)).norm(), 0.1) << t;
    }
  }
}

TEST(PlanarMotion, UnknownNamesAreRefusedWithTheKnownOnes) {
  EXPECT_EQ(testing::error_of([] { PlanarMotion("sideways"); }),
            "no motion 'sideways' - there are: icr_sweep, straight, lateral, circle, stationary, "
            "figure_eight, crab_varying, spin, constant_steering, pivot, "
            "sweep_then_straight, mixed");
}

}  // namespace
}  // namespace viwo::sim
