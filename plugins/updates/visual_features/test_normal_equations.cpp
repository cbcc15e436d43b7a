// Elimination and gate against a dense null-space projection.
#include <Eigen/QR>
#include <gtest/gtest.h>

#include "chi2_gate.hpp"
#include "normal_equations.hpp"
#include "test_support.hpp"

namespace viwo::visual {
namespace {

using testing::Random;
using testing::Scene;
using testing::SceneOptions;

/// All features of a scene, each linearised, with its rows over the whole error state projected on
/// the left null space of H_f.
struct Batch {
  Scene truth, estimate;
  TrackStore store;
  Window window;
  Feature feature;

  Batch(const SceneOptions& options, int n_landmarks, Random& random)
      : truth(testing::make_scene(options, n_landmarks, random)), estimate(truth) {
    const int n_clones = options.n_clones;
    store.start(n_landmarks, n_clones, options.n_cameras);
    store.keep_clones(truth.clones);
    window.start(n_clones, estimate.rig().cameras(), estimate.camera_blocks);
    window.set(estimate.view());
    for (std::size_t k = 0; k < truth.clones.size(); ++k) {
      for (const FeatureSample& image : testing::images(truth, k, 1., random)) {
        EXPECT_TRUE(window.take_image(image.camera, image.t_ns).has_value());
        for (const FeaturePoint& point : image.points) {
          Observation seen;
          seen.uv << point.u_px, point.v_px;
          const CameraView camera = truth.camera(static_cast<std::size_t>(image.camera));
          seen.ray = unproject(camera, seen.uv).value();
          Eigen::Vector2d uv;
          EXPECT_TRUE(project(camera, seen.ray, uv, seen.J_ray));
          store.set(store.find_or_add(point.id), truth.clones[k].slot, image.camera, seen);
        }
      }
    }
    window.set_poses();
    feature.start(n_clones * options.n_cameras, 1., 0.1);
  }

  bool linearize(int track) {
    return feature.collect(store, track, window) >= 3 &&
           feature.triangulate(window) == FeatureStatus::kOk &&
           feature.linearize(window) == FeatureStatus::kOk;
  }

  /// Rows of the feature at hand without the point: N^T H_x, N^T r; and by its velocity.
  void project_out(Eigen::MatrixXd& H, Eigen::VectorXd& r, Eigen::MatrixXd* H_v = nullptr) const {
    const auto& rows = feature.linear();
    const int n = 2 * static_cast<int>(rows.size());
    Eigen::MatrixXd H_x = Eigen::MatrixXd::Zero(n, truth.P.cols()), H_f(n, 3);
    Eigen::VectorXd residual(n);
    for (int i = 0; i < n / 2; ++i) {
      const LinearSight& row = rows[static_cast<std::size_t>(i)];
      const Sight& sight = feature.sights()[static_cast<std::size_t>(i)];
      for (const CloneState& clone : estimate.clones) {
        if (clone.slot != window.clone(sight.clone).slot) continue;
        H_x.block<2, 6>(2 * i, clone.column) = row.H_x;
      }
      for (int k = 0; k < kCalibrationSize; ++k) {
        const int column = window.camera(sight.camera).column[static_cast<std::size_t>(k)];
        if (column < 0) continue;
        H_x.block<2, 1>(2 * i, window.state_column(column)) = row.calibration.row(k).transpose();
      }
      H_f.middleRows<2>(2 * i) = row.H_f;
      residual.segment<2>(2 * i) = row.residual;
    }
    const Eigen::MatrixXd Q = H_f.householderQr().householderQ();
    if (H_v != nullptr) {
      for (int i = 0; i < n / 2; ++i) {
        const WindowClone& clone =
            window.clone(feature.sights()[static_cast<std::size_t>(i)].clone);
        H_f.middleRows<2>(2 * i) *=
            1e-9 * static_cast<double>(clone.t_ns) * feature.met().by_point();
      }
      *H_v = Q.rightCols(n - 3).transpose() * H_f;
    }
    H = Q.rightCols(n - 3).transpose() * H_x;
    r = Q.rightCols(n - 3).transpose() * residual;
  }
};

NormalEquations equations_for(const SceneOptions& options) {
  NormalEquations equations;
  equations.start(options.n_clones, options.n_cameras);
  return equations;
}

const std::vector<SceneOptions> kCases{
    {.n_clones = 12},
    {.n_clones = 7, .n_cameras = 2, .distortion = CameraDistortion::kEquidistant},
    {.n_clones = 6, .n_cameras = 2, .calibrates = true, .first_estimate_off = 0.005},
    {.n_clones = 7, .n_cameras = 3, .calibrates = true, .image_off_s = 0.0005},
    {.n_clones = 12, .n_cameras = 1, .first_estimate_off = 0.005}};

TEST(NormalEquations, EqualTheDenseProjectionOnTheNullSpace) {
  for (const SceneOptions& options : kCases) {
    Random random(11);
    Batch batch(options, 120, random);
    NormalEquations equations = equations_for(options);
    FactorSink sink(1, static_cast<int>(batch.truth.P.cols()));
    InformationFactor& factor = sink.add_information();
    equations.begin(batch.window, factor);
    const auto size = batch.truth.P.cols();
    Eigen::MatrixXd Lambda = Eigen::MatrixXd::Zero(size, size), H;
    Eigen::VectorXd eta = Eigen::VectorXd::Zero(size), r;
    int used = 0;
    for (const int track : batch.store.active()) {
      if (!batch.linearize(track)) continue;
      ASSERT_TRUE(equations.prepare(batch.feature));
      equations.add(batch.feature, batch.window, factor);
      batch.project_out(H, r);
      Lambda += H.transpose() * H;
      eta += H.transpose() * r;
      ++used;
    }
    equations.finish(batch.window, factor);
    EXPECT_GT(used, 60);
    Eigen::MatrixXd Lambda_sum = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd eta_sum = Eigen::VectorXd::Zero(size);
    testing::scatter(factor, Lambda_sum, eta_sum);
    EXPECT_LT((Lambda_sum - Lambda).norm(), 1e-10 * Lambda.norm());
    EXPECT_LT((eta_sum - eta).norm(), 1e-9 * eta.norm());
  }
}

TEST(NormalEquations, KeepTheirPrecisionWhenTheParallaxIsWeak) {
  // Half a millimetre between clones, points several metres away.
  Random random(12);
  const SceneOptions options{.n_clones = 8};
  Batch batch(options, 40, random);
  for (CloneState& clone : batch.estimate.clones) {
    clone.p_IinG = clone.p_IinG_fej = 0.0005 * testing::normal3(random);
  }
  batch.estimate.numbers(batch.estimate.camera_blocks[0].extrinsics).setZero();
  batch.window.set(batch.estimate.view());
  batch.window.set_poses();
  NormalEquations equations = equations_for(options);
  Eigen::MatrixXd H;
  Eigen::VectorXd r;
  int used = 0;
  for (const int track : batch.store.active()) {
    if (batch.feature.collect(batch.store, track, batch.window) < 3) continue;
    batch.feature.set_point(
        batch.truth.landmarks[static_cast<std::size_t>(batch.store.id(track) - 100)]);
    if (batch.feature.linearize(batch.window) != FeatureStatus::kOk) continue;
    ASSERT_TRUE(equations.prepare(batch.feature));
    FactorSink sink(1, static_cast<int>(batch.truth.P.cols()));
    InformationFactor& factor = sink.add_information();
    equations.begin(batch.window, factor);
    equations.add(batch.feature, batch.window, factor);
    equations.finish(batch.window, factor);
    batch.project_out(H, r);
    const auto size = batch.truth.P.cols();
    Eigen::MatrixXd Lambda = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd eta = Eigen::VectorXd::Zero(size);
    testing::scatter(factor, Lambda, eta);
    EXPECT_LT((Lambda - H.transpose() * H).norm(), 1e-7 * Lambda.norm());
    EXPECT_NEAR(equations.chi2_bound(), r.squaredNorm(), 1e-7 * r.squaredNorm());
    ++used;
  }
  EXPECT_GT(used, 20);
}

TEST(NormalEquations, Chi2IsThatOfTheProjectedResidualAndItsBoundHolds) {
  for (const SceneOptions& options : kCases) {
    Random random(13);
    Batch batch(options, 60, random);
    NormalEquations equations = equations_for(options);
    Chi2Gate gate;
    gate.start(options.n_clones, options.n_cameras);
    Eigen::MatrixXd H, H_v;
    Eigen::VectorXd r;
    int used = 0;
    // What a velocity takes off r^T W r; in each direction 10 m/s is a sigma of it.
    const auto by_velocity = [&](const Eigen::MatrixXd& W) -> double {
      const Eigen::Vector3d b = H_v.transpose() * W * r;
      const Eigen::Matrix3d A = H_v.transpose() * W * H_v + 0.01 * Eigen::Matrix3d::Identity();
      return b.dot(A.ldlt().solve(b));
    };
    for (const int track : batch.store.active()) {
      if (!batch.linearize(track)) continue;
      ASSERT_TRUE(equations.prepare(batch.feature));
      batch.project_out(H, r, &H_v);
      const Eigen::MatrixXd S =
          H * batch.truth.P * H.transpose() + Eigen::MatrixXd::Identity(r.size(), r.size());
      const double expected = r.dot(S.llt().solve(r));
      const double chi2 = gate.chi2(batch.feature, batch.window);
      EXPECT_NEAR(chi2, expected, 1e-8 * expected);
      EXPECT_NEAR(equations.chi2_bound(), r.squaredNorm(), 1e-8 * r.squaredNorm());
      EXPECT_LE(chi2, equations.chi2_bound());
      EXPECT_NEAR(gate.chi2_of_motion(), by_velocity(S.inverse()), 1e-7 * expected);
      EXPECT_NEAR(equations.motion_bound(),
                  by_velocity(Eigen::MatrixXd::Identity(r.size(), r.size())), 1e-7 * expected);
      ++used;
    }
    EXPECT_GT(used, 30);
  }
}

TEST(NormalEquations, ReadOnlyTheLowerTriangleOfTheCovariance) {
  Random random(14);
  Batch batch({.n_clones = 6, .n_cameras = 2, .calibrates = true}, 5, random);
  batch.window.set(batch.estimate.view());
  const Eigen::MatrixXd whole = batch.window.covariance();
  const int size = batch.window.size();
  EXPECT_EQ(whole.topLeftCorner(size, size),
            Eigen::MatrixXd(whole.topLeftCorner(size, size).transpose()));
  batch.estimate.P.triangularView<Eigen::StrictlyUpper>().setConstant(1e9);
  batch.window.set(batch.estimate.view());
  EXPECT_EQ(batch.window.covariance(), whole);
  // By name: the extrinsics of the first camera stand before the clones in the state, after them
  // in the factor.
  const CloneState& clone = batch.estimate.clones[3];
  const int row = batch.window.camera(0).column[0];
  EXPECT_GE(row, batch.window.clone_columns());
  const int column = batch.window.clone(batch.window.clone_in_slot(clone.slot)).column;
  EXPECT_EQ((whole.block<6, 6>(row, column)),
            (batch.truth.P.block<6, 6>(batch.estimate.extrinsics_column(0), clone.column)));
}

TEST(NormalEquations, RefuseAPointThatTheRowsDoNotDetermine) {
  Random random(15);
  Batch batch({.n_clones = 5}, 30, random);
  for (CloneState& clone : batch.estimate.clones) {
    clone.p_IinG = clone.p_IinG_fej = Eigen::Vector3d::Zero();
  }
  batch.estimate.numbers(batch.estimate.camera_blocks[0].extrinsics).setZero();
  batch.window.set(batch.estimate.view());
  batch.window.set_poses();
  NormalEquations equations = equations_for({.n_clones = 5});
  int used = 0;
  for (const int track : batch.store.active()) {
    if (batch.feature.collect(batch.store, track, batch.window) < 3) continue;
    batch.feature.set_point({0.1, 0.1, 5.});
    if (batch.feature.linearize(batch.window) != FeatureStatus::kOk) continue;
    EXPECT_FALSE(equations.prepare(batch.feature));
    ++used;
  }
  EXPECT_GT(used, 10);
}

}  // namespace
}  // namespace viwo::visual
