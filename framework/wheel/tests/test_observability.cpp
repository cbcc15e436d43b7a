// What the wheels can tell about the intrinsics: the null spaces of the accumulated Jacobians per
// motion and model, and invariance under the choice of the odometry frame.
#include <cmath>
#include <functional>
#include <sstream>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "viwo/math/se2.hpp"
#include "viwo/wheel/preintegration.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::follow;
using testing::load_model;
using testing::swerve;

Twist general(double t) {
  return {0.4 * std::cos(0.9 * t), 0.3 * std::sin(1.3 * t), 0.7 * std::sin(0.8 * t) + 0.1};
}
Twist figure_eight(double t) { return {0.5, 0., 0.8 * std::sin(t)}; }
Twist constant_steering(double t) { return (0.6 + 0.4 * std::sin(t)) * Twist(0.5, 0.2, 0.6); }
Twist spin(double t) { return {0., 0., 0.5 + 0.3 * std::sin(t)}; }
Twist straight(double t) { return {0.4 + 0.2 * std::sin(t), 0., 0.}; }
Twist crab_varying(double t) { return {0.5 * std::cos(0.7 * t), 0.5 * std::sin(0.7 * t), 0.}; }

enum class Information { kTwist, kTwistAndParity };

/// Dimension of the null space of the rows d xi/d x_WI (and of the parity Jacobian), accumulated
/// over the motion, columns scaled by the prior sigmas. Fails unless the singular values leave no
/// doubt.
int null_dimension(const std::string& yaml, const std::function<Twist(double)>& motion,
                   Information information) {
  const auto model = load_model(yaml);
  TwistSolver solver(model, {.rank_tolerance = 1e-6});
  const int n = model->n_intrinsics();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  ParityInformation parity;
  parity.reset(n);
  EncoderSample y;
  for (int i = 0; i < 400; ++i) {
    follow(*model, motion(0.02 * i), y);
    TwistSolution solution;
    EXPECT_EQ(solver.solve(y, solution), Status::kOk);
    normal += 1e6 * solution.J_xi_WI.transpose() * solution.J_xi_WI;  // 1 mm/s, 1 mrad/s
    if (information == Information::kTwistAndParity) {
      solver.add_parity(solver.parity(), 1., parity);
    }
  }
  normal += parity.Lambda;
  Eigen::VectorXd sigma(n);
  for (int i = 0; i < n; ++i)
    sigma[i] = model->description().intrinsics[static_cast<std::size_t>(i)].prior_sigma;
  normal = sigma.asDiagonal() * normal * sigma.asDiagonal();
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(normal).eigenvalues();
  const double threshold = 1e-13 * eigenvalues[n - 1];
  int null = 0;
  while (null < n && eigenvalues[null] < threshold) ++null;
  if (null > 0 && null < n) {
    EXPECT_GT(eigenvalues[null], 30. * std::abs(eigenvalues[null - 1]))
        << "no gap: " << eigenvalues.transpose();
  }
  return null;
}

struct Row {
  const char* name;
  Twist (*motion)(double);
  int drive_only_twist, drive_only_twist_square, redundant_twist, redundant_full;
};

// The table of what wheels alone tell with the twist of O known (docs/math/wheel_odometry.md). A
// square base with equal wheels hides one direction more from its rolling rows than an uneven one;
// where all wheels are parallel, rolling rows do not tell the velocity across at all.
const Row kRows[] = {{"general", general, 4, 5, 9, 0},
                     {"figure eight", figure_eight, 4, 5, 10, 0},
                     {"constant steering", constant_steering, 13, 13, 13, 8},
                     {"spin in place", spin, 13, 13, 13, 8},
                     {"straight", straight, 14, 14, 13, 8},
                     {"crab, direction varying", crab_varying, 13, 13, 12, 8}};

TEST(Observability, TwistOfTheDriveOnlyModelLeavesTheSteeringOffsetsAndMore) {
  for (const Row& row : kRows) {
    EXPECT_EQ(null_dimension(swerve("four_wis_wid_drive_only"), row.motion, Information::kTwist),
              row.drive_only_twist)
        << row.name;
    EXPECT_EQ(null_dimension("{type: four_wis_wid_drive_only, radius_m: 0.0255, "
                             "x_m: [0.1125, -0.1125, -0.1125, 0.1125], "
                             "y_m: [0.1125, 0.1125, -0.1125, -0.1125]}",
                             row.motion, Information::kTwist),
              row.drive_only_twist_square)
        << row.name;
  }
}

TEST(Observability, TwistOfTheRedundantModelTellsOnlySevenNumbers) {
  for (const Row& row : kRows) {
    EXPECT_EQ(null_dimension(swerve("four_wis_wid"), row.motion, Information::kTwist),
              row.redundant_twist)
        << row.name;
  }
}

TEST(Observability, TwistAndParityTellEverythingUnderGeneralMotion) {
  for (const Row& row : kRows) {
    EXPECT_EQ(null_dimension(swerve("four_wis_wid"), row.motion, Information::kTwistAndParity),
              row.redundant_full)
        << row.name;
  }
}

/// Null space of the twist's Jacobians, accumulated over a general motion with noisy encoders.
int null_dimension_with_noise(const std::string& yaml, bool fitted_jacobian) {
  const auto model = load_model(yaml);
  TwistSolver solver(model, {.fitted_jacobian = fitted_jacobian, .rank_tolerance = 1e-6});
  const int n = model->n_intrinsics();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  std::mt19937_64 rng(5);
  EncoderSample clean;
  for (int i = 0; i < 400; ++i) {
    const Twist xi = general(0.02 * i);
    follow(*model, xi, clean);
    const EncoderSample y = testing::with_noise(*model, xi, clean, 1., rng);
    TwistSolution solution;
    EXPECT_EQ(solver.solve(y, solution), Status::kOk);
    normal += solution.J_xi_WI.transpose() * solution.J_xi_WI;
  }
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(normal).eigenvalues();
  int null = 0;
  while (null < n && eigenvalues[null] < 1e-13 * eigenvalues[n - 1]) ++null;
  return null;
}

TEST(Observability, NoiseIsNoInformationWhenTheTwistIsDifferentiatedAtItsOwnSignal) {
  EXPECT_EQ(null_dimension_with_noise(swerve("four_wis_wid"), true), 9);
  EXPECT_EQ(null_dimension_with_noise(swerve("four_wis_wid_drive_only"), true), 4);
  EXPECT_LT(null_dimension_with_noise(swerve("four_wis_wid"), false), 9);
  EXPECT_LT(null_dimension_with_noise(swerve("four_wis_wid_drive_only"), false), 4);
  // The steering angle as it was read, not as the twist predicts it, brings the noise back.
  EXPECT_LT(null_dimension_with_noise(
                swerve("four_wis_wid_drive_only", ", offset_derivative: measured"), true),
            4);
}

/// x_WI of the same robot with O moved to `o` = [theta, x, y], given in the old O.
Intrinsics seen_from(const Intrinsics& x, const Eigen::Vector3d& o) {
  Intrinsics moved = x;
  for (int j = 0; j < 4; ++j) {
    const Eigen::Vector2d p(x[4 + j] - o[1], x[8 + j] - o[2]);
    const Eigen::Vector2d q = R2(o[0]).transpose() * p;
    moved[4 + j] = q.x();
    moved[8 + j] = q.y();
    moved[12 + j] = x[12 + j] + o[0];  // delta = delta_m - delta_o turns by -theta
  }
  return moved;
}

TEST(Gauge, MovingTheOdometryFrameMovesThePoseAndLeavesTheParityResidual) {
  const auto model = load_model(swerve("four_wis_wid"));
  std::mt19937_64 rng(11);
  auto samples = testing::sample_motion(*model, general, 2., 50.);
  for (auto& sample : samples) {
    sample = testing::with_noise(*model, general(1e-9 * static_cast<double>(sample.t_ns)), sample,
                                 3., rng);
  }
  const Eigen::Vector3d o(0.3, 0.05, -0.08);
  const Intrinsics x = seen_from(model->nominal(), o);
  std::ostringstream yaml;
  yaml.precision(17);
  const auto list = [&](const char* key, int first) {
    yaml << ", " << key << ": [" << x[first] << ", " << x[first + 1] << ", " << x[first + 2] << ", "
         << x[first + 3] << "]";
  };
  yaml << "{type: four_wis_wid";
  list("radius_m", 0);
  list("x_m", 4);
  list("y_m", 8);
  list("steer_offset_rad", 12);
  yaml << "}";
  const auto moved_model = load_model(yaml.str());
  for (const bool weighted : {false, true}) {
    const PreintegrationOptions options{.twist = {.noise_weighted = weighted}};
    PreintegratedPose here, there;
    Preintegrator(model, options).integrate(samples, 0, 2'000'000'000, here);
    Preintegrator(moved_model, options).integrate(samples, 0, 2'000'000'000, there);
    // g_there = o^-1 (+) g_here (+) o, and the parity residual does not know of O at all.
    const Eigen::Vector3d expected = between(o, compose(here.g, o));
    EXPECT_LT((there.g - expected).norm(), 1e-11);
    EXPECT_NEAR(there.parity.chi2, here.parity.chi2, 1e-8 * here.parity.chi2);
  }
}

TEST(Gauge, TheParityInformationIsBlindToIt) {
  const auto model = load_model(swerve("four_wis_wid"));
  const auto samples = testing::sample_motion(*model, general, 4., 50.);
  Preintegrator preintegrator(model, {});
  PreintegratedPose pose;
  preintegrator.integrate(samples, 0, 4'000'000'000, pose);
  const Intrinsics x = model->nominal();
  for (int k = 0; k < 3; ++k) {
    const double h = 1e-6;
    const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(k);
    const Intrinsics direction = (seen_from(x, step) - seen_from(x, -step)) / (2. * h);
    EXPECT_LT((pose.parity.Lambda * direction).norm(),
              1e-7 * pose.parity.Lambda.norm() * direction.norm())
        << k;
  }
}

}  // namespace
}  // namespace viwo
