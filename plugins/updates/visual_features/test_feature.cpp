// Triangulation and Jacobians of one feature.
#include <stdexcept>

#include <gtest/gtest.h>

#include "feature.hpp"
#include "test_support.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo::visual {
namespace {

using testing::Random;
using testing::Scene;
using testing::SceneOptions;

/// Track 0 of a store, with all sights of a landmark.
struct Track {
  TrackStore store;
  Window window;
  Feature feature;

  Track(Scene& truth, Scene& estimate, const Eigen::Vector3d& landmark, double sigma_px,
        double noise_px, Random& random, double min_distance_m = 0.1) {
    const int n_clones = static_cast<int>(truth.clones.size());
    const int n_cameras = static_cast<int>(truth.n_cameras());
    window.start(n_clones, estimate.rig().cameras(), estimate.camera_blocks);
    window.set(estimate.view());
    store.start(4, n_clones, n_cameras);
    store.keep_clones(truth.clones);
    const int track = store.find_or_add(7);
    for (std::size_t i = 0; i < truth.clones.size(); ++i) {
      for (std::size_t j = 0; j < truth.n_cameras(); ++j) {
        Observation seen;
        if (!truth.see(i, j, landmark, seen.uv)) continue;
        seen.uv += noise_px * Eigen::Vector2d(testing::normals(random, 2));
        const int camera = static_cast<int>(j);
        seen.ray = unproject(estimate.camera(j), seen.uv).value();
        Eigen::Vector2d uv;
        EXPECT_TRUE(project(estimate.camera(j), seen.ray, uv, seen.J_ray));
        EXPECT_EQ(window.take_image(camera, truth.stamp_ns(i, j)), truth.clones[i].slot);
        store.set(track, truth.clones[i].slot, camera, seen);
      }
    }
    window.set_poses();
    feature.start(n_clones * n_cameras, sigma_px, min_distance_m);
    feature.collect(store, track, window);
  }
};

std::size_t clone_of(const Scene& scene, const Window& window, const Sight& sight) {
  for (std::size_t i = 0; i < scene.clones.size(); ++i) {
    if (scene.clones[i].slot == window.clone(sight.clone).slot) return i;
  }
  throw std::logic_error("no such clone");
}

/// Pixel that a sight predicts, with everything at the values of `scene`.
Eigen::Vector2d predicted(Scene& scene, const Window& window, const Sight& sight,
                          const Eigen::Vector3d& p_FinG) {
  const std::size_t clone = clone_of(scene, window, sight);
  const auto camera = static_cast<std::size_t>(sight.camera);
  Eigen::Vector2d uv;
  EXPECT_TRUE(scene.predict(clone, camera, scene.stamp_ns(clone, camera), sight.observation->uv.y(),
                            p_FinG, uv));
  return uv;
}

/// The rows of a sight over the whole error state.
Eigen::MatrixXd dense_row(const LinearSight& row, const Sight& sight, const Scene& scene,
                          const Window& window) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(2, scene.P.cols());
  H.middleCols<6>(scene.clones[clone_of(scene, window, sight)].column) = row.H_x;
  for (int k = 0; k < kCalibrationSize; ++k) {
    const int column = window.camera(sight.camera).column[static_cast<std::size_t>(k)];
    if (column >= 0) H.col(window.state_column(column)) = row.calibration.row(k).transpose();
  }
  return H;
}

/// Of a window that is known, where no row is worth less for what is not.
void check_jacobians(SceneOptions options, std::uint64_t seed) {
  options.sigma_theta = options.sigma_p = 1e-6;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Random random(seed);
  Scene scene = testing::make_scene(options, 1, random);
  const double sigma_px = 0.7;
  Track track(scene, scene, scene.landmarks[0], sigma_px, 0.5, random);
  ASSERT_GE(track.feature.sights().size(), 3u);
  ASSERT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
  ASSERT_EQ(track.feature.linearize(track.window), FeatureStatus::kOk);
  const Eigen::Vector3d p_FinG = track.feature.met().point.p_FinG();
  const Eigen::Matrix3d by_point = track.feature.met().by_point();
  const double step = 1e-6;
  for (std::size_t k = 0; k < track.feature.sights().size(); ++k) {
    const Sight& sight = track.feature.sights()[k];
    const LinearSight& row = track.feature.linear()[k];
    const Eigen::Vector2d residual =
        (sight.observation->uv - predicted(scene, track.window, sight, p_FinG)) / sigma_px;
    EXPECT_LT((row.residual - residual).norm(), 1e-9);
    Eigen::MatrixXd numeric(2, scene.P.cols());
    for (int c = 0; c < numeric.cols(); ++c) {
      Eigen::VectorXd dx = Eigen::VectorXd::Zero(numeric.cols());
      Scene plus = scene, minus = scene;
      dx[c] = step;
      plus.plus(dx);
      minus.plus(-dx);
      const Eigen::Vector2d difference = predicted(plus, track.window, sight, p_FinG) -
                                         predicted(minus, track.window, sight, p_FinG);
      // What is held has no column.
      const bool held = scene.P(c, c) == 0.;
      numeric.col(c) = held ? Eigen::Vector2d(0., 0.) : difference / (2. * step * sigma_px);
    }
    const Eigen::MatrixXd H = dense_row(row, sight, scene, track.window);
    if (options.first_estimate_off == 0.) {
      EXPECT_LT((H - numeric).norm(), 1e-6 * numeric.norm()) << H << "\n\n" << numeric;
    }
    EXPECT_LT(testing::without_verticals(H - numeric, scene).norm(), 1e-6 * numeric.norm())
        << H << "\n\n"
        << numeric;
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(c);
      const Eigen::Vector2d column = (predicted(scene, track.window, sight, p_FinG + d) -
                                      predicted(scene, track.window, sight, p_FinG - d)) /
                                     (2. * step * sigma_px);
      const Eigen::Vector2d by_coordinate = row.H_f * by_point.col(c);
      EXPECT_LT((by_coordinate - column).norm(), 1e-6 * (row.H_f * by_point).norm());
    }
  }
}

TEST(Feature, JacobiansAreCentralDifferencesThroughTheErrorState) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    check_jacobians({.n_clones = 5, .n_cameras = 2, .calibrates = true}, seed);
    check_jacobians({.n_clones = 5,
                     .n_cameras = 2,
                     .distortion = CameraDistortion::kEquidistant,
                     .calibrates = true},
                    seed);
  }
}

TEST(Feature, InverseDistanceMovesWithThePosesAsItSays) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Random random(seed);
    Scene scene = testing::make_scene({.n_clones = 5, .n_cameras = 2}, 1, random);
    const auto rho_of = [&](Scene& estimate) {
      Random none(1);
      Track track(scene, estimate, scene.landmarks[0], 0.1, 0., none);
      EXPECT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
      return track.feature.met().point.rho;
    };
    Random none(1);
    Track track(scene, scene, scene.landmarks[0], 0.1, 0., none);
    ASSERT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
    const Eigen::VectorXd by = track.feature.rho_by_poses(track.window);
    Eigen::VectorXd numeric(by.size());
    const double step = 1e-5;
    for (int c = 0; c < by.size(); ++c) {
      Scene plus = scene, minus = scene;
      Eigen::VectorXd dx = Eigen::VectorXd::Zero(scene.P.cols());
      dx[track.window.state_column(c)] = step;
      plus.plus(dx);
      minus.plus(-dx);
      numeric[c] = (rho_of(plus) - rho_of(minus)) / (2. * step);
    }
    EXPECT_LT((by - numeric).norm(), 0.02 * numeric.norm()) << by << "\n\n" << numeric;
  }
}

TEST(Feature, JacobiansAreThoseOfTheEstimates) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    check_jacobians({.n_clones = 5, .n_cameras = 2, .calibrates = true, .first_estimate_off = 0.01},
                    seed);
  }
}

TEST(Feature, RowsDoNotSeeAMotionOfTheWholeWorldWhereEstimatesHaveMoved) {
  // As it is of the first estimates: some motion of the point, one for all rows, goes with it.
  Random random(7);
  const SceneOptions options{.n_clones = 6,
                             .n_cameras = 2,
                             .calibrates = true,
                             .first_estimate_off = 0.03,
                             .sigma_theta = 1e-6,
                             .sigma_p = 1e-6};
  Scene scene = testing::make_scene(options, 1, random);
  Track track(scene, scene, scene.landmarks[0], 1., 0., random);
  ASSERT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
  ASSERT_EQ(track.feature.linearize(track.window), FeatureStatus::kOk);
  const Eigen::MatrixXd N = testing::world_motions(scene, scene.P.cols());
  Scene first = scene;
  first.first_estimates();
  const auto seen = [&](bool blind, const Scene& of) {
    const auto& sights = track.feature.sights();
    const auto n = 2 * static_cast<Eigen::Index>(sights.size());
    Eigen::MatrixXd H(n, scene.P.cols()), H_f(n, 3);
    for (std::size_t k = 0; k < sights.size(); ++k) {
      LinearSight row = track.feature.linear()[k];
      if (!blind) {
        const InversePoint& point = track.feature.met().point;
        EXPECT_TRUE(linearize_sight(track.window, sights[k], point, 1., row));
        row.H_f = (row.H_f * track.feature.met().point.rho).eval();  // by the point
      }
      H.middleRows<2>(2 * static_cast<Eigen::Index>(k)) =
          dense_row(row, sights[k], scene, track.window);
      H_f.middleRows<2>(2 * static_cast<Eigen::Index>(k)) = row.H_f;
    }
    const Eigen::MatrixXd moved = H * testing::world_motions(of, scene.P.cols());
    return (moved + H_f * H_f.householderQr().solve(-moved)).norm() / H.norm();
  };
  EXPECT_LT(seen(true, scene), 1e-12 * N.norm());
  EXPECT_GT(seen(false, scene), 1e-3);              // derivatives at the estimates do see it
  EXPECT_LT(seen(false, first), 1e-12 * N.norm());  // but not that of these
}

TEST(Feature, JacobiansOfAnImageBesideItsCloneAreCentralDifferences) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const double off_s : {0.001, -0.0012}) {
      check_jacobians({.n_clones = 5,
                       .n_cameras = 2,
                       .calibrates = true,
                       .first_estimate_off = 0.01,
                       .image_off_s = off_s},
                      seed);
      check_jacobians(
          {.n_clones = 5, .n_cameras = 2, .first_estimate_off = 0.01, .image_off_s = off_s}, seed);
    }
  }
}

TEST(Feature, JacobiansThroughARollingShutterAreCentralDifferences) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const auto distortion : {CameraDistortion::kRadtan, CameraDistortion::kEquidistant}) {
      check_jacobians({.n_clones = 5,
                       .n_cameras = 2,
                       .distortion = distortion,
                       .calibrates = true,
                       .first_estimate_off = 0.01,
                       .image_off_s = 0.001,
                       .line_delay_s = 5e-5},
                      seed);
    }
  }
}

TEST(Feature, ARollingShutterMovesPointsAndIsTakenIntoAccount) {
  const SceneOptions options{.n_clones = 8, .line_delay_s = 5e-5};
  Random random(3);
  Scene scene = testing::make_scene(options, 50, random);
  random.seed(3);
  Scene global = testing::make_scene({.n_clones = 8}, 50, random);
  int seen = 0, off = 0;
  for (const Eigen::Vector3d& landmark : scene.landmarks) {
    Track track(scene, scene, landmark, 1e-4, 0., random);
    if (track.feature.sights().size() < 4) continue;
    ASSERT_EQ(track.feature.triangulate(track.window), FeatureStatus::kOk);
    EXPECT_LT((track.feature.met().point.p_FinG() - landmark).norm(), 1e-7);
    // The middle row is where a global shutter's image is.
    for (std::size_t i = 0; i < scene.clones.size(); ++i) {
      Eigen::Vector2d rolling, all_rows;
      if (!scene.see(i, 0, landmark, rolling) || !global.see(i, 0, landmark, all_rows)) continue;
      const double rows = rolling.y() - 0.5 * (scene.camera(0).height_px - 1);
      const double moved_px = (rolling - all_rows).norm();
      EXPECT_LT(moved_px, 0.1 * std::abs(rows) + 1e-9);
      ++seen;
      if (moved_px > 2.) ++off;
    }
  }
  EXPECT_GT(seen, 100);
  EXPECT_GT(off, seen / 10);
}

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
