// How landmarks begin in the state.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "anchored_point.hpp"
#include "test_support.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo::visual {
namespace {

using testing::Random;
using testing::Scene;
using testing::SceneOptions;

/// What one batch gives when the tracks that all clones have seen become landmarks.
struct Begun {
  Scene truth, estimate;
  Eigen::VectorXd error;  ///< truth = estimate [+] error
  FactorSink sink;
  Eigen::MatrixXd Lambda;
  Eigen::VectorXd eta;

  Begun(const SceneOptions& options, Random& random) : sink(1, 1) {
    truth = testing::make_scene(options, 12, random);
    const auto n = truth.P.cols();
    const Eigen::VectorXd sigma = truth.P.diagonal().cwiseSqrt();
    const Eigen::MatrixXd L = truth.P.llt().matrixL();
    error = L * testing::normals(random, static_cast<int>(n));
    estimate = truth;
    estimate.plus(-error);
    estimate.first_estimates();
    Params params = testing::default_params();
    params.max_landmarks = 5;
    params.gate_probability = 0.;
    VisualFeatures update(params, HostServices{});
    estimate.start(update);
    sink = estimate.sink();
    for (std::size_t k = 0; k < truth.clones.size(); ++k) {
      testing::epoch(update, estimate, k + 1, testing::images(truth, k, 1., random), sink,
                     k + 1 == truth.clones.size());
    }
    Lambda = Eigen::MatrixXd::Zero(estimate.P.rows(), estimate.P.cols());
    eta = Eigen::VectorXd::Zero(estimate.P.rows());
    if (sink.information() != nullptr) testing::scatter(*sink.information(), Lambda, eta);
  }
};

TEST(Landmarks, BeginWithAllTheirSightsAndEstimateThemselvesConsistently) {
  // Two-sided, over runs: clones, calibration and landmarks together. Half the noise or a landmark
  // that has none of the uncertainty of its anchor must show.
  const SceneOptions options{.n_clones = 8, .n_cameras = 1, .sigma_theta = 0.002, .sigma_p = 0.01};
  Random random(65);
  double nees = 0., broken = 0.;
  int n_total = 0;
  for (int run = 0; run < 40; ++run) {
    const Begun begun(options, random);
    const auto n = begun.truth.P.cols();
    const auto n_new = 3 * static_cast<Eigen::Index>(begun.sink.added().size());
    if (n_new == 0) continue;
    Eigen::VectorXd error(n + n_new);
    error.head(n) = begun.error;
    const CloneState& newest = begun.truth.clones.back();
    Scene truth = begun.truth;
    const CameraView camera = truth.camera(0);
    const Anchor anchor{newest.R_GtoI, camera.R_ItoC, newest.p_IinG, camera.p_IinC};
    for (std::size_t k = 0; k < begun.sink.added().size(); ++k) {
      const AddedBlock& added = begun.sink.added()[k];
      const Eigen::Vector3d value = Eigen::Map<const Eigen::Vector3d>(added.value.data());
      // The landmark next to it is its own.
      Eigen::Vector3d nearest = Eigen::Vector3d::Constant(1e9);
      for (const Eigen::Vector3d& p_FinG : truth.landmarks) {
        const Eigen::Vector3d off = inverse_depth_of_point(anchor.to_camera(p_FinG)) - value;
        if (off.norm() < nearest.norm()) nearest = off;
      }
      ASSERT_EQ(begun.estimate.column(added.id), n + 3 * static_cast<int>(k));
      error.segment<3>(n + 3 * static_cast<Eigen::Index>(k)) = nearest;
    }
    const auto size = n + n_new;
    Eigen::MatrixXd Lambda = begun.Lambda.topLeftCorner(size, size);
    Lambda.topLeftCorner(n, n) += begun.truth.P.inverse();
    const Eigen::VectorXd left = error - Lambda.llt().solve(begun.eta.head(size));
    nees += left.dot(Lambda * left);
    Eigen::MatrixXd wrong = Lambda;
    const int column = newest.column;
    wrong.block(n, column, n_new, kPoseSize).setZero();
    wrong.block(column, n, kPoseSize, n_new).setZero();
    broken += left.dot(wrong * left);
    n_total += static_cast<int>(size);
  }
  EXPECT_GT(n_total, 1500);
  const double low = chi2_quantile(0.0005, n_total), high = chi2_quantile(0.9995, n_total);
  EXPECT_GT(nees, low);
  EXPECT_LT(nees, high);
  EXPECT_TRUE(broken < low || broken > high) << broken << " in " << low << " .. " << high;
}

/// What a factor says of the first `n` states when the landmarks behind them are eliminated.
std::pair<Eigen::MatrixXd, Eigen::VectorXd> without_landmarks(const FactorSink& sink,
                                                              Eigen::Index n, Eigen::Index size) {
  Eigen::MatrixXd Lambda = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd eta = Eigen::VectorXd::Zero(size);
  testing::scatter(*sink.information(), Lambda, eta);
  const Eigen::Index n_new = size - n;
  for (Eigen::Index i = n; i < size; ++i) {
    if (Lambda(i, i) == 0.) Lambda(i, i) = 1.;  // room that no landmark has taken
  }
  if (n_new > 0) {
    const Eigen::MatrixXd F = Lambda.bottomRightCorner(n_new, n_new).inverse();
    const Eigen::MatrixXd G = Lambda.topRightCorner(n, n_new);
    Lambda.topLeftCorner(n, n) -= G * F * G.transpose();
    eta.head(n) -= G * F * eta.tail(n_new);
  }
  return {Lambda.topLeftCorner(n, n), eta.head(n)};
}

TEST(Landmarks, BeginWithTheRowsThatTheEliminatedTracksWouldHave) {
  // Eliminating the landmarks from their factor gives the factor of the same tracks without them.
  Random random(66);
  const SceneOptions options{
      .n_clones = 6, .n_cameras = 2, .calibrates = true, .sigma_theta = 1e-3, .sigma_p = 1e-3};
  Scene scene = testing::make_scene(options, 0, random);
  scene.landmarks = {{0.4, 0.1, 4.}, {0.7, -0.2, 5.}, {0.2, 0.3, 3.5}};
  std::vector<Eigen::MatrixXd> Lambdas;
  std::vector<Eigen::VectorXd> etas;
  const auto n = scene.P.cols();
  for (const int most : {0, 3}) {
    Random noise(67);
    Scene estimate = scene;
    Params params = testing::default_params();
    params.max_landmarks = most;
    params.gate_probability = 0.;
    VisualFeatures update(params, HostServices{});
    estimate.start(update);
    FactorSink sink = estimate.sink();
    for (std::size_t k = 0; k < 6; ++k) {
      testing::epoch(update, estimate, k + 1, testing::images(scene, k, 1., noise), sink, k == 5);
    }
    ASSERT_EQ(sink.applied(), 3);
    ASSERT_EQ(sink.added().size(), most == 0 ? 0u : 3u);
    const auto [Lambda, eta] = without_landmarks(sink, n, estimate.P.cols());
    Lambdas.push_back(Lambda);
    etas.push_back(eta);
  }
  EXPECT_LT((Lambdas[0] - Lambdas[1]).norm(), 1e-9 * Lambdas[0].norm());
  EXPECT_LT((etas[0] - etas[1]).norm(), 1e-8 * etas[0].norm());
}

/// A false match that is left out of a track stays out of its landmark.
TEST(Landmarks, DoNotBeginWithStrays) {
  Random random(66);
  const SceneOptions options{
      .n_clones = 8, .n_cameras = 1, .calibrates = false, .sigma_theta = 1e-3, .sigma_p = 1e-2};
  Scene scene = testing::make_scene(options, 0, random);
  scene.landmarks = {{0.4, 0.1, 4.}, {0.7, -0.2, 5.}, {0.2, 0.3, 3.5}};
  const auto n = scene.P.cols();
  for (const int most : {0, 3}) {
    Random noise(67);
    Scene estimate = scene;
    Params params = testing::default_params();
    params.max_landmarks = most;
    VisualFeatures update(params, HostServices{});
    estimate.start(update);
    FactorSink sink = estimate.sink();
    for (std::size_t k = 0; k < 8; ++k) {
      auto images = testing::images(scene, k, 1., noise);
      for (FeaturePoint& point : images[0].points) {
        if (k == 3 && point.id == 100) point.u_px += 60.;
      }
      testing::epoch(update, estimate, k + 1, images, sink, k == 7);
    }
    EXPECT_EQ(sink.applied(), 3);
    EXPECT_EQ(sink.added().size(), most == 0 ? 0u : 2u);
    const auto [Lambda, eta] = without_landmarks(sink, n, estimate.P.cols());
    const Eigen::MatrixXd known = scene.P.inverse();
    const Eigen::VectorXd dx = (Lambda + known).llt().solve(eta);
    EXPECT_LT(dx.dot(known * dx), 10.) << most;
  }
}

/// When a point that moves on as from one image to another leaves an image of make_camera().
double time_in_sight(const FeaturePoint& before, const FeaturePoint& now, double dt_s) {
  const CameraView camera = testing::make_camera(CameraDistortion::kRadtan);
  double t_s = 0.;
  for (; t_s < 1000.; t_s += 1e-4) {
    const double u = now.u_px + t_s / dt_s * (now.u_px - before.u_px);
    const double v = now.v_px + t_s / dt_s * (now.v_px - before.v_px);
    if (u < 0. || v < 0. || u > camera.width_px || v > camera.height_px) break;
  }
  return t_s;
}

TEST(Landmarks, AreThoseThatWillBeSeenLongest) {
  Random random(68);
  const SceneOptions options{.n_clones = 8, .n_cameras = 1};
  Scene scene = testing::make_scene(options, 0, random);
  scene.landmarks = {
      {0.4, 0.1, 4.}, {0.7, -0.2, 5.}, {0.2, 0.3, 3.5}, {1., 0.5, 6.}, {0.5, 0., 3.}};
  for (std::size_t most = 1; most <= 5; ++most) {
    Random noise(69);
    Scene estimate = scene;
    Params params = testing::default_params();
    params.max_landmarks = static_cast<int>(most);
    params.gate_probability = 0.;
    VisualFeatures update(params, HostServices{});
    estimate.start(update);
    FactorSink sink = estimate.sink();
    std::vector<std::vector<FeaturePoint>> seen;
    for (std::size_t k = 0; k < 8; ++k) {
      const auto images = testing::images(scene, k, 1., noise);
      ASSERT_EQ(images[0].points.size(), 5u);
      seen.push_back(images[0].points);
      testing::epoch(update, estimate, k + 1, images, sink, k == 7);
    }
    std::vector<std::pair<double, std::int64_t>> expected;
    for (std::size_t i = 0; i < 5; ++i) {
      const FeaturePoint &before = seen[4][i], &now = seen[7][i];
      expected.emplace_back(-time_in_sight(before, now, 0.3), now.id);
    }
    std::sort(expected.begin(), expected.end());
    std::vector<std::int64_t> longest, chosen;
    for (std::size_t i = 0; i < most; ++i) longest.push_back(expected[i].second);
    for (const Landmark& landmark : update.landmarks()) chosen.push_back(landmark.id);
    EXPECT_THAT(chosen, ::testing::UnorderedElementsAreArray(longest)) << most;
    EXPECT_EQ(sink.applied(), 5);  // the others are used up
  }
}

}  // namespace
}  // namespace viwo::visual
