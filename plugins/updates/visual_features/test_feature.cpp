// Jacobians of one feature.
#include <stdexcept>

#include <gtest/gtest.h>

#include "feature_track.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo::visual {
namespace {

using testing::Random;
using testing::Scene;
using testing::SceneOptions;

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

}  // namespace
}  // namespace viwo::visual
