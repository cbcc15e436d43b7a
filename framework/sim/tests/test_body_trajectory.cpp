// Splines, grounds and trajectories against polynomials, geometry and numerical differentiation.
#include <cmath>
#include <filesystem>
#include <random>

#include <gtest/gtest.h>

#include "viwo/api/status.hpp"
#include "viwo/log/ros_text.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/body_trajectory.hpp"

namespace viwo::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Mounting kTilted{rotation_from_euler(0.7, -0.4, 1.1), {0.3, -0.2, 0.5}};

BodyTrajectory uneven(const std::string& motion, double end_s = 30.) {
  return BodyTrajectory::drive(PlanarMotion(motion), Ground::uneven(0.05, 3.), -0.5, end_s);
}

/// Angular velocity in the body from rotations h before and after.
Vector3d numeric_rate(const Matrix3d& before, const Matrix3d& after, double h) {
  return log_so3(before.transpose() * after) / (2. * h);
}

TEST(QuinticSpline, ReproducesAPolynomialOfDegreeFiveAndItsDerivatives) {
  const auto f = [](double t) { return 1. - 2. * t + std::pow(t, 3) - 0.1 * std::pow(t, 5); };
  std::vector<double> times;
  Eigen::Matrix<double, 6, Eigen::Dynamic> values(6, 61);
  for (int k = 0; k <= 60; ++k) {
    times.push_back(-1. + 0.05 * k);
    for (int i = 0; i < 6; ++i) values(i, k) = (i + 1.) * f(times.back());
  }
  const auto spline = QuinticSpline::fit(times, values, {-1., 2., 0.3, 0.});
  for (const double t : {-1., -0.33, 0., 0.9, 1.999, 2.}) {
    const auto at = spline.at(t);
    for (int i = 0; i < 6; ++i) {
      EXPECT_NEAR(at.value[i], (i + 1.) * f(t), 1e-10) << t;
      EXPECT_NEAR(at.rate[i], (i + 1.) * (-2. + 3. * t * t - 0.5 * std::pow(t, 4)), 1e-8) << t;
      EXPECT_NEAR(at.acceleration[i], (i + 1.) * (6. * t - 2. * std::pow(t, 3)), 1e-6) << t;
    }
  }
  EXPECT_THROW(spline.at(-1.01), std::out_of_range);
  EXPECT_THROW(spline.at(2.01), std::out_of_range);
  EXPECT_THROW(spline.at(NAN), std::out_of_range);
}

TEST(QuinticSpline, RefusesSamplesThatDoNotDetermineIt) {
  const Eigen::Matrix<double, 6, Eigen::Dynamic> two = Eigen::Matrix<double, 6, 2>::Ones();
  EXPECT_THROW(QuinticSpline::fit({0., 1.}, two, {0., 1., 0.1, 0.}), InputError);
  EXPECT_THROW(QuinticSpline::fit({0., 2.}, two, {0., 1., 0.1, 1.}), InputError);
  EXPECT_THROW(QuinticSpline::fit({}, two, {0., 1., 0.1, 1.}), InputError);
  EXPECT_THROW(QuinticSpline::fit({0., 1.}, NAN * two, {0., 1., 0.5, 1.}), InputError);
}

TEST(Ground, GradientIsTheSlopeOfItsHeightAndBothStayWithinTheirBounds) {
  const Ground ground = Ground::uneven(0.05, 3.);
  EXPECT_EQ(ground.height({0., 0.}), 0.);
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> place(-30., 30.);
  constexpr double kH = 1e-5;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d p(place(engine), place(engine));
    const Eigen::Vector2d x(kH, 0.), y(0., kH);
    const Eigen::Vector2d slope = ground.gradient(p);
    EXPECT_NEAR(slope.x(), (ground.height(p + x) - ground.height(p - x)) / (2. * kH), 1e-9);
    EXPECT_NEAR(slope.y(), (ground.height(p + y) - ground.height(p - y)) / (2. * kH), 1e-9);
    EXPECT_LE(std::abs(ground.height(p)), 2. * 0.05);
    EXPECT_LE(slope.norm(), 6.3 * 0.05 / 3.);
  }
}

TEST(BodyTrajectory, FollowsEveryMotionOnAPlane) {
  for (const std::string& name : PlanarMotion::names()) {
    const PlanarMotion motion(name);
    const auto trajectory = BodyTrajectory::drive(motion, Ground(), -0.5, 20.);
    PoseIntegrator integrator(motion);
    for (double t = 0.; t <= 20.; t += 0.0713) {
      const Vector3d g = integrator.advance_to(t);
      const BodyMotion at = trajectory.body(t);
      EXPECT_NEAR((at.p_BinG - Vector3d(g[1], g[2], 0.)).norm(), 0., 1e-6) << name << " " << t;
      EXPECT_NEAR(log_so3(at.R_BtoG.transpose() * rotation_from_euler(g[0], 0., 0.)).norm(), 0.,
                  1e-6);
      EXPECT_NEAR((trajectory.twist(t) - motion.twist(t)).norm(), 0., 5e-5) << name << " " << t;
    }
  }
}

TEST(BodyTrajectory, ARampThatStartsFarBehindStillBeginsAtTheOrigin) {
  const PlanarMotion motion("circle", {0.5, 0.6, 0.});  // moves before 0, too
  const auto trajectory = BodyTrajectory::drive(motion, Ground(), -3.01, 2.);
  EXPECT_NEAR(trajectory.body(0.).p_BinG.norm(), 0., 1e-9);
  const BodyMotion before = trajectory.body(-3.);
  EXPECT_NEAR(before.p_BinG.x(), 0.5 / 0.6 * std::sin(-1.8), 1e-7);
  EXPECT_NEAR(before.p_BinG.y(), 0.5 / 0.6 * (1. - std::cos(-1.8)), 1e-7);
}

TEST(BodyTrajectory, AStationaryBaseStandsStillOnAnyGround) {
  const auto trajectory = uneven("stationary");
  for (const double t : {0., 0.123, 29.}) EXPECT_LT(trajectory.twist(t).norm(), 1e-15);
}

TEST(BodyTrajectory, StandsOnUnevenGroundWithItsAxisNormalToIt) {
  const Ground ground = Ground::uneven(0.05, 3.);
  const auto trajectory = uneven("icr_sweep");
  double largest_tilt = 0.;
  for (double t = 0.; t < 30.; t += 0.0917) {
    const BodyMotion at = trajectory.body(t);
    const Eigen::Vector2d p = at.p_BinG.head<2>();
    EXPECT_NEAR(at.p_BinG.z(), ground.height(p), 1e-6);
    const Eigen::Vector2d slope = ground.gradient(p);
    const Vector3d normal = Vector3d(-slope.x(), -slope.y(), 1.).normalized();
    EXPECT_NEAR((at.R_BtoG.col(2) - normal).norm(), 0., 1e-5) << t;
    EXPECT_NEAR((at.R_BtoG.transpose() * at.v_BinG).z(), 0., 1e-4) << t;  // does not lift off
    largest_tilt = std::max(largest_tilt, std::acos(at.R_BtoG(2, 2)));
  }
  EXPECT_GT(largest_tilt, 3. * M_PI / 180.);
  EXPECT_LT(largest_tilt, 10. * M_PI / 180.);
}

TEST(BodyTrajectory, ABaseThatCannotMoveSidewaysDoesNotSlideOnUnevenGround) {
  for (const char* name : {"straight", "circle", "figure_eight", "constant_steering"}) {
    const auto trajectory = uneven(name);
    for (double t = 0.; t < 30.; t += 0.0917) {
      EXPECT_NEAR(trajectory.twist(t).y(), 0., 2e-5) << name << " " << t;
    }
  }
}

TEST(BodyTrajectory, DerivativesOfBaseAndImuAreThoseOfTheirPoses) {
  const auto trajectory = uneven("icr_sweep");
  constexpr double kH = 1e-4;
  for (double t = 0.2; t < 30.; t += 0.317) {
    for (const bool on_imu : {false, true}) {
      const auto at = [&](double when) {
        return on_imu ? trajectory.imu(when, kTilted) : trajectory.body(when);
      };
      const BodyMotion before = at(t - kH), now = at(t), after = at(t + kH);
      EXPECT_NEAR((now.v_BinG - (after.p_BinG - before.p_BinG) / (2. * kH)).norm(), 0., 1e-7);
      EXPECT_NEAR((now.a_BinG - (after.v_BinG - before.v_BinG) / (2. * kH)).norm(), 0., 1e-6);
      EXPECT_NEAR((now.w_BwrtG_inB - numeric_rate(before.R_BtoG, after.R_BtoG, kH)).norm(), 0.,
                  1e-7);
      EXPECT_NEAR((now.dw_BwrtG_inB - (after.w_BwrtG_inB - before.w_BwrtG_inB) / (2. * kH)).norm(),
                  0., 1e-6);
    }
  }
}

TEST(BodyTrajectory, ImuSitsWhereItIsMounted) {
  const auto trajectory = uneven("figure_eight");
  const BodyMotion base = trajectory.body(11.3), imu = trajectory.imu(11.3, kTilted);
  const Vector3d p_FinI(1., -2., 0.5);
  const Vector3d p_FinO = kTilted.R_ItoO * p_FinI + kTilted.p_IinO;
  EXPECT_NEAR(((imu.R_BtoG * p_FinI + imu.p_BinG) - (base.R_BtoG * p_FinO + base.p_BinG)).norm(),
              0., 1e-12);
}

TEST(BodyTrajectory, TwistIsTheNumericalDerivativeOfThePoseSeenFromTheBase) {
  const auto trajectory = uneven("crab_varying");
  constexpr double kH = 1e-4;
  for (double t = 0.2; t < 30.; t += 0.317) {
    const BodyMotion before = trajectory.body(t - kH), now = trajectory.body(t);
    const BodyMotion after = trajectory.body(t + kH);
    const Vector3d v = now.R_BtoG.transpose() * (after.p_BinG - before.p_BinG) / (2. * kH);
    const Twist numeric(v.x(), v.y(), numeric_rate(before.R_BtoG, after.R_BtoG, kH).z());
    EXPECT_NEAR((trajectory.twist(t) - numeric).norm(), 0., 1e-7) << t;
  }
}

/// Poses of a body that turns more than once around and tilts, at irregular stamps.
std::vector<PoseSample> poses_in_space(double noise_m) {
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> step(0.002, 0.03);
  std::normal_distribution<double> unit;
  const auto noise = [&](auto& random) { return noise_m * unit(random); };
  std::vector<PoseSample> out;
  for (double t = 0.; t < 20.; t += step(engine)) {
    const Eigen::Quaterniond q(rotation_from_euler(0.7 * t, 0.2 * std::sin(t), 0.1 * std::cos(t)));
    out.push_back({1'000'000'007 + std::llround(t * 1e9),
                   {std::sin(0.5 * t) + noise(engine), 0.1 * t, 0.05 * std::sin(t)},
                   {q.x(), q.y(), q.z(), q.w()}});
  }
  return out;
}

TEST(BodyTrajectory, GoesThroughRecordedPosesInSpaceAndOnThePlane) {
  const auto poses = poses_in_space(0.);
  const auto space = BodyTrajectory::through(poses, 1'000'000'007, false, 0.2);
  const auto plane = BodyTrajectory::through(poses, 1'000'000'007, true, 0.2);
  for (const double t : {0.5, 3.3, 12.7, 19.3}) {
    const BodyMotion at = space.body(t);
    EXPECT_NEAR((at.p_BinG - Vector3d(std::sin(0.5 * t), 0.1 * t, 0.05 * std::sin(t))).norm(), 0.,
                1e-6);
    const Matrix3d R = rotation_from_euler(0.7 * t, 0.2 * std::sin(t), 0.1 * std::cos(t));
    EXPECT_NEAR(log_so3(at.R_BtoG.transpose() * R).norm(), 0., 1e-6);
    EXPECT_NEAR(at.v_BinG.x(), 0.5 * std::cos(0.5 * t), 1e-4);
    const BodyMotion flat = plane.body(t);
    EXPECT_EQ(flat.p_BinG.z(), 0.);
    EXPECT_NEAR(log_so3(flat.R_BtoG.transpose() * rotation_from_euler(0.7 * t, 0., 0.)).norm(), 0.,
                1e-6);
  }
  EXPECT_LT(fit_residual(space, poses, 1'000'000'007).max_m, 5e-5);
  EXPECT_THROW(space.body(20.1), std::out_of_range);
  EXPECT_THROW(BodyTrajectory::through({poses[0]}, 0, true, 0.2), InputError);
}

TEST(BodyTrajectory, TheResidualOfAFitIsTheNoiseOfThePoses) {
  const auto poses = poses_in_space(0.01);
  const auto trajectory = BodyTrajectory::through(poses, 1'000'000'007, false, 0.5);
  // 1250 poses, 45 control points: the fit takes little of the noise.
  EXPECT_NEAR(fit_residual(trajectory, poses, 1'000'000'007).rms_m, 0.01, 0.001);
}

TEST(BodyTrajectory, BridgesAGapThatIsLongerThanItsKnots) {
  auto poses = poses_in_space(0.);
  std::erase_if(poses, [](const PoseSample& pose) {
    const double t = static_cast<double>(pose.t_ns - 1'000'000'007) * 1e-9;
    return t > 5. && t < 5.6;
  });
  const auto trajectory = BodyTrajectory::through(poses, 1'000'000'007, false, 0.1);
  EXPECT_NEAR(trajectory.body(5.3).p_BinG.x(), std::sin(2.65), 1e-3);
}

TEST(BodyTrajectory, FitsTheRealRecordingsToWellBelowAMillimetre) {
  const auto folder = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/4wis4wid";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recordings in " << folder;
  double worst_rms_m = 0., worst_rms_rad = 0.;
  for (const int run : {1, 2, 3, 6, 7, 8, 11, 12, 13, 16, 17, 18, 21, 22, 23, 26, 27, 28}) {
    const auto poses =
        log::read_ros_poses(folder / ("abs_" + std::to_string(run) + ".csv.gz"), {}, {}).samples;
    const std::int64_t origin_ns = poses.front().t_ns;
    const auto trajectory = BodyTrajectory::through(poses, origin_ns, true, 0.3);
    const FitResidual residual = fit_residual(trajectory, poses, origin_ns);
    worst_rms_m = std::max(worst_rms_m, residual.rms_m);
    worst_rms_rad = std::max(worst_rms_rad, residual.rms_rad);
  }
  EXPECT_LT(worst_rms_m, 0.7e-3);
  EXPECT_LT(worst_rms_rad, 2e-3);
}

TEST(BodyTrajectory, ABaseThatSlidesKeepsItsHeadingAndMovesSidewaysAsWell) {
  const PlanarMotion motion("circle");
  const auto sideways = [](double t_s) { return 0.02 * std::sin(t_s); };
  const auto straight = BodyTrajectory::drive(motion, Ground(), -0.5, 20.);
  const auto sliding = BodyTrajectory::drive(motion, Ground(), -0.5, 20., 0.05, sideways);
  for (double t_s = 2.; t_s < 19.; t_s += 0.31) {
    const Twist xi = sliding.twist(t_s);
    EXPECT_NEAR(xi[0], 0.5, 1e-6) << t_s;
    EXPECT_NEAR(xi[1], sideways(t_s), 1e-6) << t_s;
    EXPECT_EQ(sliding.body(t_s).R_BtoG, straight.body(t_s).R_BtoG) << t_s;
  }
}

}  // namespace
}  // namespace viwo::sim
