// Landmarks in the state: their geometry and rows.
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "anchored_point.hpp"
#include "landmark_rows.hpp"
#include "test_support.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo::visual {
namespace {

using testing::Random;
using testing::Scene;
using testing::SceneOptions;

/// `errors`: dtheta, dp of the clone, then of the extrinsics.
Anchor moved(const Anchor& anchor, const Eigen::VectorXd& errors) {
  return {exp_so3(-Eigen::Vector3d(errors.segment<3>(0))) * anchor.R_GtoI,
          exp_so3(-Eigen::Vector3d(errors.segment<3>(6))) * anchor.R_ItoC,
          anchor.p_IinG + errors.segment<3>(3), anchor.p_IinC + errors.segment<3>(9)};
}

/// Two poses of one camera that both look along z, more or less.
std::pair<Anchor, Anchor> random_anchors(Random& random) {
  Anchor from{exp_so3(0.2 * testing::normal3(random)), exp_so3(0.2 * testing::normal3(random)),
              testing::normal3(random), 0.1 * testing::normal3(random)};
  Anchor to = from;
  to.R_GtoI = exp_so3(0.1 * testing::normal3(random)) * from.R_GtoI;
  to.p_IinG += 0.5 * testing::normal3(random);
  return {from, to};
}

Eigen::Vector3d random_landmark(Random& random) {
  return {0.4 * testing::normal(random), 0.4 * testing::normal(random),
          1. / testing::uniform(random, 2., 10.)};
}

TEST(AnchoredPoint, IsWhereTheCameraSeesIt) {
  Random random(51);
  for (int i = 0; i < 20; ++i) {
    const auto [anchor, other] = random_anchors(random);
    const Eigen::Vector3d landmark = random_landmark(random);
    const Eigen::Vector3d p_C = anchor.to_camera(AnchoredPoint(anchor, landmark).p_FinG);
    EXPECT_LT((inverse_depth_of_point(p_C) - landmark).norm(), 1e-13);
    EXPECT_LT((point_of_inverse_depth(landmark) - p_C).norm(), 1e-11);
    EXPECT_TRUE(can_be_anchored(p_C));
    EXPECT_FALSE(can_be_anchored(-p_C));
  }
  EXPECT_FALSE(can_be_anchored({1., 0., 0.16}));
}

TEST(AnchoredPoint, JacobiansAreCentralDifferences) {
  Random random(52);
  for (int i = 0; i < 20; ++i) {
    const auto [from, to] = random_anchors(random);
    const Anchor anchor = from;
    const Eigen::Vector3d landmark = random_landmark(random);
    const AnchoredPoint point(anchor, landmark);
    Eigen::MatrixXd J(3, 15);
    J << point.by_landmark, point.by_clone, point.by_extrinsics;
    const auto f = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      return AnchoredPoint(moved(anchor, x.tail<12>()), landmark + x.head<3>()).p_FinG;
    };
    const auto numeric = viwo::testing::central_difference(f, Eigen::VectorXd::Zero(15));
    EXPECT_EQ(viwo::testing::jacobian_mismatch(J, numeric, {}), "");
  }
}

/// J of a new anchor by landmark, old clone, new clone, extrinsics.
Eigen::MatrixXd move_jacobian(const MovedLandmark& moved) {
  Eigen::MatrixXd J(3, 21);
  J << moved.by_landmark, moved.by_old_clone, moved.by_new_clone, moved.by_extrinsics;
  return J;
}

TEST(MovedLandmark, IsTheSamePointAndItsJacobianIsOfCentralDifferences) {
  Random random(53);
  for (int i = 0; i < 20; ++i) {
    const auto anchors = random_anchors(random);
    const Anchor from = anchors.first, to = anchors.second;
    const Eigen::Vector3d landmark = random_landmark(random);
    const MovedLandmark result(from, to, landmark);
    EXPECT_LT(
        (AnchoredPoint(to, result.landmark).p_FinG - AnchoredPoint(from, landmark).p_FinG).norm(),
        1e-11);
    const auto f = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      Eigen::VectorXd old_errors(12), new_errors(12);
      old_errors << x.segment<6>(3), x.tail<6>();
      new_errors << x.segment<6>(9), x.tail<6>();
      return MovedLandmark(moved(from, old_errors), moved(to, new_errors), landmark + x.head<3>())
          .landmark;
    };
    const auto numeric = viwo::testing::central_difference(f, Eigen::VectorXd::Zero(21));
    EXPECT_EQ(viwo::testing::jacobian_mismatch(move_jacobian(result), numeric, {}), "");
  }
}

TEST(MovedLandmark, KeepsTheErrorOfThePointAndNoPartOfItsJacobianCanBeLeftOut) {
  Random random(54);
  for (int i = 0; i < 20; ++i) {
    const auto [from, to] = random_anchors(random);
    const Eigen::Vector3d landmark = random_landmark(random);
    const MovedLandmark result(from, to, landmark);
    const AnchoredPoint before(from, landmark), after(to, result.landmark);
    // Errors of landmark, old clone, new clone, extrinsics: of the point before, and after.
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(3, 21), direct = A;
    A << before.by_landmark, before.by_clone, Eigen::MatrixXd::Zero(3, 6), before.by_extrinsics;
    direct.middleCols<6>(9) = after.by_clone;
    direct.rightCols<6>() = after.by_extrinsics;
    const Eigen::MatrixXd J = move_jacobian(result);
    EXPECT_LT((after.by_landmark * J + direct - A).norm(), 1e-10 * A.norm());
    for (const int first : {0, 3, 9, 15}) {
      Eigen::MatrixXd broken = J;
      broken.middleCols(first, first == 0 ? 3 : 6).setZero();
      EXPECT_GT((after.by_landmark * broken + direct - A).norm(), 0.01 * A.norm());
    }
  }
}

TEST(MovedLandmark, DoesNotSeeAMotionOfTheWholeWorld) {
  Random random(55);
  const auto [from, to] = random_anchors(random);
  const Eigen::MatrixXd J = move_jacobian(MovedLandmark(from, to, random_landmark(random)));
  // Turning G about z by a small angle, and moving it.
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(21, 4);
  int row = 3;
  for (const Anchor& anchor : {from, to}) {
    N.block<3, 1>(row, 0) = anchor.R_GtoI * Eigen::Vector3d::UnitZ();
    N.block<3, 1>(row + 3, 0) = -skew(anchor.p_IinG) * Eigen::Vector3d::UnitZ();
    N.block<3, 3>(row + 3, 1).setIdentity();
    row += 6;
  }
  EXPECT_LT((J * N).norm(), 1e-12 * J.norm() * N.norm());
}

/// A landmark that the clones of a scene have seen; its columns follow those of the scene.
struct Seen {
  Scene scene;
  Window window;
  TrackStore store;
  std::vector<Sight> sights;
  LandmarkState landmark;
  std::size_t anchor_clone = 0;

  Seen(const SceneOptions& options, std::uint64_t seed) {
    Random random(seed);
    scene = testing::make_scene(options, 0, random);
    scene.landmarks = {{0.5, 0.2, 4.}};
    store.start(1, options.n_clones, options.n_cameras);
    store.keep_clones(scene.clones);
    const int track = store.find_or_add(1);
    window.start(options.n_clones, scene.rig().cameras(), scene.camera_blocks);
    window.set(scene.view());
    for (std::size_t i = 0; i < scene.clones.size(); ++i) {
      for (std::size_t j = 0; j < scene.n_cameras(); ++j) {
        Observation seen;
        if (!scene.see(i, j, scene.landmarks[0], seen.uv)) continue;
        seen.uv += Eigen::Vector2d(testing::normals(random, 2));
        const int camera = static_cast<int>(j), slot = scene.clones[i].slot;
        EXPECT_TRUE(window.take_image(camera, scene.stamp_ns(i, j)).has_value());
        store.set(track, slot, camera, seen);
        sights.push_back(
            {window.clone_in_slot(slot), camera, &store.observation(track, slot, camera)});
      }
    }
    window.set_poses();
    anchor_clone = scene.clones.size() - 2;
    landmark.clone = window.clone_in_slot(scene.clones[anchor_clone].slot);
    landmark.camera = options.n_cameras - 1;
    landmark.factor_column = window.size();
    landmark.state_column = static_cast<int>(scene.P.cols());
    landmark.value = inverse_depth_of_point(anchor_of(scene).to_camera(scene.landmarks[0]));
  }

  Anchor anchor_of(Scene& at) const {
    const CameraView camera = at.camera(static_cast<std::size_t>(landmark.camera));
    const CloneState& clone = at.clones[anchor_clone];
    return {clone.R_GtoI, camera.R_ItoC, clone.p_IinG, camera.p_IinC};
  }

  /// Pixels of all sights, at the values of `at` and of the landmark.
  Eigen::VectorXd predicted(Scene at, const Eigen::Vector3d& value) const {
    const Eigen::Vector3d p_FinG = AnchoredPoint(anchor_of(at), value).p_FinG;
    Eigen::VectorXd pixels(2 * static_cast<Eigen::Index>(sights.size()));
    for (std::size_t k = 0; k < sights.size(); ++k) {
      std::size_t clone = 0;
      while (at.clones[clone].slot != window.clone(sights[k].clone).slot) ++clone;
      const auto j = static_cast<std::size_t>(sights[k].camera);
      Eigen::Vector2d uv;
      EXPECT_TRUE(
          at.predict(clone, j, at.stamp_ns(clone, j), sights[k].observation->uv.y(), p_FinG, uv));
      pixels.segment<2>(2 * static_cast<Eigen::Index>(k)) = uv;
    }
    return pixels;
  }

  /// The rows by the whole error state and the landmark.
  Eigen::MatrixXd dense(const LandmarkRows& rows) const {
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(rows.rows(), scene.P.cols() + 3);
    for (std::size_t k = 0; k < rows.columns().size(); ++k) {
      const int column = rows.columns()[k];
      const int state = column < window.size()
                            ? window.state_column(column)
                            : landmark.state_column + column - landmark.factor_column;
      H.col(state) = rows.H().col(static_cast<Eigen::Index>(k));
    }
    return H;
  }
};

const std::vector<SceneOptions> kScenes{
    {.n_clones = 5, .n_cameras = 2, .calibrates = true, .first_estimate_off = 0.005},
    {.n_clones = 4, .n_cameras = 1, .calibrates = true, .image_off_s = 0.001},
    {.n_clones = 5,
     .n_cameras = 2,
     .calibrates = true,
     .first_estimate_off = 0.005,
     .line_delay_s = 5e-5},
    {.n_clones = 6,
     .n_cameras = 2,
     .distortion = CameraDistortion::kEquidistant,
     .first_estimate_off = 0.005}};

LandmarkRows rows_for(const Seen& seen, double sigma_px) {
  LandmarkRows rows;
  const int n_clones = seen.window.n_clones(), n_cameras = seen.window.n_cameras();
  rows.start(n_clones, n_cameras, kPoseSize * n_clones + kCalibrationSize * n_cameras + 3,
             sigma_px);
  return rows;
}

TEST(LandmarkRows, JacobiansAreCentralDifferencesAtTheEstimates) {
  for (const SceneOptions& options : kScenes) {
    Seen seen(options, 61);
    LandmarkRows rows = rows_for(seen, 0.8);
    ASSERT_GE(seen.sights.size(), 4u);
    ASSERT_TRUE(rows.linearize(seen.sights, seen.window, seen.landmark));
    Eigen::VectorXd measured(rows.rows());
    for (std::size_t k = 0; k < seen.sights.size(); ++k) {
      measured.segment<2>(2 * static_cast<Eigen::Index>(k)) = seen.sights[k].observation->uv;
    }
    const Eigen::VectorXd residual =
        (measured - seen.predicted(seen.scene, seen.landmark.value)) / 0.8;
    EXPECT_LT((rows.residual() - residual).norm(), 1e-9);

    const auto n = seen.scene.P.cols();
    const auto f = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      Scene at = seen.scene;
      // What is held does not move.
      const Eigen::VectorXd free = (seen.scene.P.diagonal().array() > 0.).cast<double>();
      at.plus(free.cwiseProduct(x.head(n)));
      return seen.predicted(at, seen.landmark.value + x.tail<3>()) / 0.8;
    };
    const auto numeric = viwo::testing::central_difference(f, Eigen::VectorXd::Zero(n + 3));
    const auto blind = [&](const Eigen::MatrixXd& H) {
      const bool moved = options.first_estimate_off > 0.;
      return moved ? testing::without_verticals(H, seen.scene) : H;
    };
    EXPECT_EQ(viwo::testing::jacobian_mismatch(blind(seen.dense(rows)), blind(numeric), {}, 1e-5),
              "");
  }
}

TEST(LandmarkRows, DoNotSeeAMotionOfTheWholeWorldWhereEstimatesHaveMoved) {
  for (const SceneOptions& options : kScenes) {
    const Seen seen(options, 61);
    LandmarkRows rows = rows_for(seen, 1.);
    ASSERT_TRUE(rows.linearize(seen.sights, seen.window, seen.landmark));
    const Eigen::MatrixXd H = seen.dense(rows);
    const Eigen::MatrixXd N = testing::world_motions(seen.scene, H.cols());
    EXPECT_LT((H * N).norm(), 1e-12 * H.norm() * N.norm());
  }
}

TEST(LandmarkRows, GateIsTheDenseChiSquare) {
  for (const SceneOptions& options : kScenes) {
    Seen seen(options, 62);
    Random random(63);
    const auto n = seen.scene.P.cols() + 3;
    // The landmark is uncertain, too, and not independent of the rest.
    Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n, n);
    A.topLeftCorner(n - 3, n - 3) = seen.scene.P;
    A.bottomRightCorner<3, 3>() *= 1e-4;
    for (int i = 0; i < 3; ++i) A.col(n - 3 + i).head(n - 3) = 0.1 * seen.scene.P.col(20 + i);
    A.bottomLeftCorner(3, n - 3) = A.topRightCorner(n - 3, 3).transpose();
    seen.scene.P = A;
    seen.window.set(seen.scene.view());
    seen.window.set_poses();
    LandmarkRows rows = rows_for(seen, 1.);
    ASSERT_TRUE(rows.linearize(seen.sights, seen.window, seen.landmark));
    const Eigen::MatrixXd H = seen.dense(rows).leftCols(n);  // of which the landmark is a part now
    const Eigen::MatrixXd S =
        H * A * H.transpose() + Eigen::MatrixXd::Identity(rows.rows(), rows.rows());
    const Eigen::VectorXd r = rows.residual();
    const double chi2 = r.dot(S.llt().solve(r));
    ASSERT_LT(chi2, r.squaredNorm());
    EXPECT_TRUE(rows.passes(seen.window, chi2 * (1. + 1e-9)));
    EXPECT_FALSE(rows.passes(seen.window, chi2 * (1. - 1e-9)));
  }
}

TEST(LandmarkRows, RefuseALandmarkBehindACamera) {
  Seen seen(kScenes[0], 64);
  LandmarkRows rows = rows_for(seen, 1.);
  seen.landmark.value.z() = -0.2;
  EXPECT_FALSE(rows.linearize(seen.sights, seen.window, seen.landmark));
  seen.landmark.value.z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(rows.linearize(seen.sights, seen.window, seen.landmark));
}

}  // namespace
}  // namespace viwo::visual
