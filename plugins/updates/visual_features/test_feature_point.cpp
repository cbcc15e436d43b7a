// Triangulation of one feature, and which features are refused.
#include <gtest/gtest.h>

#include "feature_track.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo::visual {
namespace {

using testing::Random;
using testing::Scene;
using testing::SceneOptions;

TEST(Feature, TriangulationRecoversExactPoints) {
  for (const auto distortion : {CameraDistortion::kRadtan, CameraDistortion::kEquidistant}) {
    Random random(3);
    Scene scene = testing::make_scene({.n_clones = 8, .distortion = distortion}, 50, random);
    for (const Eigen::Vector3d& landmark : scene.landmarks) {
      Track track(scene, scene, landmark, 1e-4, 0., random);
      if (track.feature.sights().size() < 4) continue;
      ASSERT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
      EXPECT_LT((track.feature.met().point.p_FinG() - landmark).norm(), 1e-7);
    }
  }
}

TEST(Feature, TriangulationIsUnbiasedAndAsPreciseAsItsNormalMatrixSays) {
  Random random(4);
  Scene scene = testing::make_scene({.n_clones = 10}, 0, random);
  const Eigen::Vector3d landmark(0.6, 0.3, 3.);
  const int n = 2000;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  double nees = 0.;
  for (int i = 0; i < n; ++i) {
    Track track(scene, scene, landmark, 0.5, 0.5, random);
    ASSERT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
    ASSERT_EQ(track.feature.linearize(track.window), FeatureStatus::kOk);
    information.setZero();
    for (const LinearSight& row : track.feature.linear()) {
      information += row.H_f.transpose() * row.H_f;
    }
    const Eigen::Matrix3d by_point = track.feature.met().by_point();
    information = (by_point.transpose() * information * by_point).eval();
    const Eigen::Vector3d error = track.feature.met().point.p_FinG() - landmark;
    mean += error / n;
    nees += error.dot(information * error);
  }
  EXPECT_LT(n * mean.dot(information * mean), chi2_quantile(0.999, 3.));
  EXPECT_GT(nees, chi2_quantile(0.005, 3. * n));
  EXPECT_LT(nees, chi2_quantile(0.995, 3. * n));
}

TEST(Feature, TriangulationIsTheMinimumOfThePixelResiduals) {
  Random random(5);
  Scene scene = testing::make_scene(
      {.n_clones = 6, .n_cameras = 2, .distortion = CameraDistortion::kEquidistant}, 20, random);
  for (const Eigen::Vector3d& landmark : scene.landmarks) {
    Track track(scene, scene, landmark, 1., 1., random);
    if (track.feature.sights().size() < 4) continue;
    ASSERT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
    ASSERT_EQ(track.feature.linearize(track.window), FeatureStatus::kOk);
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const LinearSight& row : track.feature.linear()) {
      A += row.H_f.transpose() * row.H_f;
      b += row.H_f.transpose() * row.residual;
    }
    // What is left of the gradient, in standard deviations of the point.
    EXPECT_LT(std::sqrt(b.dot(A.llt().solve(b))), 0.05);
  }
}

TEST(Feature, APointWithoutParallaxIsInfinitelyFarAndTellsOrientationsOnly) {
  Random random(6);
  Scene scene = testing::make_scene({.n_clones = 6, .sigma_p = 1e-6}, 0, random);
  for (int i = 0; i < 6; ++i) {  // a millimetre from each other, as it is known
    scene.clones[static_cast<std::size_t>(i)].p_IinG = {1e-3 * i, 0., 0.};
  }
  Track track(scene, scene, {3000., 1000., 9000.}, 1., 0.3, random);
  ASSERT_EQ(track.feature.sights().size(), 6u);
  ASSERT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
  EXPECT_FALSE(track.feature.met().has_distance);
  EXPECT_EQ(track.feature.met().point.rho, 0.);
  EXPECT_LT(
      (track.feature.met().point.direction - Eigen::Vector3d(3000., 1000., 9000.).normalized())
          .norm(),
      2e-3);
  ASSERT_EQ(track.feature.linearize(track.window), FeatureStatus::kOk);
  for (const LinearSight& row : track.feature.linear()) {
    EXPECT_EQ(row.H_x.rightCols<3>().norm(), 0.);
    EXPECT_GT(row.H_x.leftCols<3>().norm(), 100.);
  }
}

TEST(Feature, WhatNeitherDistanceNorWayAreKnownOfIsNoise) {
  // A quarter of a metre of way that may be off by 10 cm, and points whose distance a millimetre of
  // parallax tells: rows are worth less than a pixel.
  Random random(6);
  const auto worth = [&random](double way_m, double sigma_p_m) {
    Scene scene = testing::make_scene({.n_clones = 6, .sigma_p = sigma_p_m}, 0, random);
    for (int i = 0; i < 6; ++i) {
      scene.clones[static_cast<std::size_t>(i)].p_IinG = {way_m / 5. * i, 0., 0.};
    }
    Track track(scene, scene, {0.3, 0.1, 4.}, 1., 0.3, random);
    EXPECT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
    EXPECT_EQ(track.feature.linearize(track.window), FeatureStatus::kOk);
    return track.feature.linear().front().H_x.leftCols<3>().norm();
  };
  const double whole = worth(0.25, 1e-6);
  EXPECT_NEAR(worth(0.25, 1e-4), whole, 0.1 * whole);
  EXPECT_NEAR(worth(1e-3, 1e-7), whole, 0.1 * whole);
  EXPECT_LT(worth(1e-3, 0.1), 0.1 * whole);
}

TEST(Feature, PointsOfAnyDistanceAreTakenWhateverTheirNoise) {
  // Those whose noise has them nearer must not be chosen: they would all say that the way was
  // longer than it was.
  Random random(8);
  const SceneOptions options{.n_clones = 8, .sigma_p = 1e-3};
  for (const double distance_m : {20., 200., 2000., 20000.}) {
    int taken = 0, infinite = 0;
    const int n = 300;
    for (int i = 0; i < n; ++i) {
      Scene scene = testing::make_scene(options, 0, random);
      const Eigen::Vector3d landmark =
          distance_m * Eigen::Vector3d(testing::uniform(random, -0.2, 0.3),
                                       testing::uniform(random, -0.2, 0.2), 1.);
      Track track(scene, scene, landmark, 1., 1., random);
      if (track.feature.sights().size() < 4) continue;
      if (track.feature.triangulate(track.window) != FeatureStatus::kOk) continue;
      ++taken;
      infinite += track.feature.met().has_distance ? 0 : 1;
    }
    EXPECT_GT(taken, 0.97 * n) << distance_m;
    EXPECT_EQ(infinite > n / 2, distance_m > 150.) << distance_m << " m: " << infinite;
  }
}

TEST(Feature, RefusesPointsThatAreTooNearAndBehind) {
  Random random(6);
  Scene scene = testing::make_scene({.n_clones = 6}, 0, random);
  Track near(scene, scene, {0.4, 0.1, 5.}, 1., 0.1, random, 5.5);
  EXPECT_EQ(near.feature.triangulate(near.window), FeatureStatus::kNear);

  Scene backwards = scene;  // the same bearings from a mirrored path meet behind the cameras
  for (CloneState& clone : backwards.clones) clone.p_IinG *= -1.;
  Track behind(scene, backwards, {0.4, 0.1, 5.}, 1., 0.1, random);
  EXPECT_EQ(behind.feature.triangulate(behind.window), FeatureStatus::kNotVisible);

  Scene broken = scene;
  broken.clones[2].p_IinG.x() = std::numeric_limits<double>::quiet_NaN();
  Track nan(scene, broken, {0.4, 0.1, 5.}, 1., 0.1, random);
  EXPECT_NE(nan.feature.triangulate(nan.window), FeatureStatus::kOk);
}

TEST(Feature, LeavesOutObservationsOfSomethingElse) {
  Random random(21);
  SceneOptions options;
  Scene scene = testing::make_scene(options, 1, random);
  Track track(scene, scene, scene.landmarks[0], 1., 0.3, random);
  const std::size_t n = track.feature.sights().size();
  ASSERT_GE(n, 7u);
  EXPECT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
  EXPECT_EQ(track.feature.leave_out_strays(), 0) << "all see the point";
  // Two matches of another thing.
  for (const std::size_t i : {std::size_t{1}, n - 2}) {
    const Sight& sight = track.feature.sights()[i];
    auto& seen = const_cast<Observation&>(*sight.observation);
    seen.uv += Eigen::Vector2d(90., -60.);
    const auto& camera = scene.camera(static_cast<std::size_t>(sight.camera));
    seen.ray = unproject(camera, seen.uv).value();
    Eigen::Vector2d uv;
    ASSERT_TRUE(project(camera, seen.ray, uv, seen.J_ray));
  }
  track.feature.triangulate(track.window);
  EXPECT_EQ(track.feature.leave_out_strays(), 2);
  EXPECT_EQ(track.feature.sights().size(), n - 2);
  ASSERT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
  ASSERT_EQ(track.feature.linearize(track.window), FeatureStatus::kOk);
  double chi2 = 0.;
  for (const LinearSight& row : track.feature.linear()) chi2 += row.residual.squaredNorm();
  EXPECT_LT(chi2, chi2_quantile(0.999, 2. * static_cast<double>(n - 2) - 3.));
}

}  // namespace
}  // namespace viwo::visual
