// Simulated tracks against projections written out here, and the bookkeeping of ids.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/sim/feature_simulator.hpp"

namespace viwo::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Looks along x of I, `y_m` to its left.
CameraView camera(CameraDistortion distortion, double y_m) {
  CameraView out;
  out.distortion = distortion;
  const bool wide = distortion == CameraDistortion::kEquidistant;
  out.width_px = wide ? 848 : 640;
  out.height_px = wide ? 800 : 480;
  if (wide) {
    out.intrinsics << 282., 281., 416., 398., -0.003, 0.054, -0.052, 0.011;
  } else {
    out.intrinsics << 460., 458., 318., 242., 0., 0., 0., 0.;
  }
  out.R_ItoC << 0., -1., 0., 0., 0., -1., 1., 0., 0.;
  out.p_IinC = -out.R_ItoC * Vector3d(0.02, y_m, 0.);
  return out;
}

std::vector<CameraView> stereo(CameraDistortion distortion) {
  return {camera(distortion, 0.03), camera(distortion, -0.03)};
}

const Mounting kMounting{rotation_from_euler(0.1, 0.05, -0.02), {0.05, 0.02, 0.15}};

const BodyTrajectory& trajectory() {
  static const auto kTrajectory =
      BodyTrajectory::drive(PlanarMotion("icr_sweep"), Ground::uneven(0.05, 3.), -0.5, 31.);
  return kTrajectory;
}

FeatureSimulation noiseless(double duration_s = 10.) {
  FeatureSimulation options;
  options.duration_s = duration_s;
  options.phase_s = 0.0137;
  options.features = 80;
  options.noise = false;
  return options;
}

Vector2d project_independently(const CameraView& cam, const Vector3d& p) {
  const double fx = cam.intrinsics[0], fy = cam.intrinsics[1];
  const double cx = cam.intrinsics[2], cy = cam.intrinsics[3];
  if (cam.distortion == CameraDistortion::kRadtan) {  // of no distortion here
    return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy};
  }
  const double theta = std::acos(p.z() / p.norm());
  double bent = theta;
  for (int i = 0; i < 4; ++i) bent += cam.intrinsics[4 + i] * std::pow(theta, 3 + 2 * i);
  const double phi = std::atan2(p.y(), p.x());
  return {fx * bent * std::cos(phi) + cx, fy * bent * std::sin(phi) + cy};
}

/// Where the landmark of a point is in its camera.
Vector3d in_camera(const SimulatedFeatures& features, const CameraView& cam, std::int64_t t_ns,
                   std::int64_t id) {
  const BodyMotion imu = trajectory().imu(static_cast<double>(t_ns) * 1e-9, kMounting);
  const Vector3d p_FinI =
      imu.R_BtoG.transpose() * (features.p_FinG[static_cast<std::size_t>(id)] - imu.p_BinG);
  return cam.R_ItoC * p_FinI + cam.p_IinC;
}

class EachCamera : public ::testing::TestWithParam<CameraDistortion> {};

INSTANTIATE_TEST_SUITE_P(RadtanAndEquidistant, EachCamera,
                         ::testing::Values(CameraDistortion::kRadtan,
                                           CameraDistortion::kEquidistant),
                         [](const auto& which) {
                           return which.param == CameraDistortion::kRadtan ? "Radtan"
                                                                           : "Equidistant";
                         });

TEST_P(EachCamera, PointsAreTheProjectionsOfTheirLandmarks) {
  const auto cameras = stereo(GetParam());
  const auto features = simulate_features(trajectory(), kMounting, cameras, noiseless(), 4);
  ASSERT_EQ(features.samples.size(), 200U);
  for (const FeatureSample& sample : features.samples) {
    const CameraView& cam = cameras[static_cast<std::size_t>(sample.camera)];
    for (const FeaturePoint& point : sample.points) {
      const Vector3d p_FinC = in_camera(features, cam, sample.t_ns, point.id);
      const Vector2d uv = project_independently(cam, p_FinC);
      ASSERT_NEAR(point.u_px, uv.x(), 1e-8);
      ASSERT_NEAR(point.v_px, uv.y(), 1e-8);
      ASSERT_GE(p_FinC.norm(), 2.5);
      ASSERT_LE(p_FinC.norm(), 10.5);
      ASSERT_LE(std::acos(p_FinC.z() / p_FinC.norm()), 1.4);
      ASSERT_TRUE(uv.x() >= 0. && uv.y() >= 0. && uv.x() <= cam.width_px - 1. &&
                  uv.y() <= cam.height_px - 1.);
    }
  }
}

TEST_P(EachCamera, EachRowOfARollingShutterHasItsOwnTime) {
  auto cameras = stereo(GetParam());
  for (CameraView& cam : cameras) cam.line_delay_s = 3e-5;
  const auto features = simulate_features(trajectory(), kMounting, cameras, noiseless(), 4);
  double most_off_px = 0.;
  for (const FeatureSample& sample : features.samples) {
    const CameraView& cam = cameras[static_cast<std::size_t>(sample.camera)];
    // Stamps are those of the first row.
    const auto seen_at = [&](double row, std::int64_t id) {
      const std::int64_t t_ns = sample.t_ns + std::llround(3e4 * row);
      return project_independently(cam, in_camera(features, cam, t_ns, id));
    };
    for (const FeaturePoint& point : sample.points) {
      const Vector2d measured(point.u_px, point.v_px);
      ASSERT_LT((measured - seen_at(point.v_px, point.id)).norm(), 1e-5);
      const double middle = 0.5 * (cam.height_px - 1);
      most_off_px = std::max(most_off_px, (measured - seen_at(middle, point.id)).norm());
    }
  }
  EXPECT_GT(most_off_px, 1.);
}

TEST_P(EachCamera, ImagesAreFullAndTheirTimesFallBetweenImuSamples) {
  const auto cameras = stereo(GetParam());
  const auto features = simulate_features(trajectory(), kMounting, cameras, noiseless(), 4);
  for (std::size_t k = 0; k < features.samples.size(); ++k) {
    const FeatureSample& sample = features.samples[k];
    EXPECT_EQ(sample.t_ns, 13'700'000 + 100'000'000 * static_cast<std::int64_t>(k / 2));
    EXPECT_EQ(sample.camera, static_cast<int>(k % 2));
    EXPECT_EQ(sample.points.size(), 80U);
    std::set<std::int64_t> ids;
    for (const FeaturePoint& point : sample.points) ids.insert(point.id);
    EXPECT_EQ(ids.size(), sample.points.size());
  }
}

TEST_P(EachCamera, ATrackHasNoBreaksAndBothCamerasShareIt) {
  const auto cameras = stereo(GetParam());
  const auto features = simulate_features(trajectory(), kMounting, cameras, noiseless(30.), 4);
  std::map<std::int64_t, std::set<std::int64_t>> images_of;
  std::set<std::int64_t> left, right;
  for (const FeatureSample& sample : features.samples) {
    for (const FeaturePoint& point : sample.points) {
      images_of[point.id].insert(sample.t_ns / 100'000'000);
      (sample.camera == 0 ? left : right).insert(point.id);
    }
  }
  std::size_t longest = 0;
  for (const auto& [id, images] : images_of) {
    EXPECT_EQ(*images.rbegin() - *images.begin() + 1, std::int64_t(images.size())) << id;
    longest = std::max(longest, images.size());
  }
  EXPECT_GT(longest, 20U);
  std::vector<std::int64_t> shared;
  std::set_intersection(left.begin(), left.end(), right.begin(), right.end(),
                        std::back_inserter(shared));
  EXPECT_GT(shared.size(), left.size() / 2);
}

TEST(FeatureSimulator, ALandmarkSeenAgainHasANewId) {
  // One turn and a half on the spot: everything is seen twice.
  const auto spin =
      BodyTrajectory::drive(PlanarMotion("spin", {0.5, 0.6, 0.}), Ground(), -0.5, 17.);
  const std::vector<CameraView> cameras{camera(CameraDistortion::kRadtan, 0.)};
  const auto features = simulate_features(spin, kMounting, cameras, noiseless(16.), 4);
  const auto less = [](const Vector3d& a, const Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  const std::set<Vector3d, decltype(less)> places(features.p_FinG.begin(), features.p_FinG.end(),
                                                  less);
  EXPECT_LT(places.size(), features.p_FinG.size() - 50);
}

/// Differences of all points of two runs with the same landmarks.
std::vector<double> differences(const SimulatedFeatures& a, const SimulatedFeatures& b) {
  std::vector<double> out;
  EXPECT_EQ(a.samples.size(), b.samples.size());
  for (std::size_t k = 0; k < a.samples.size(); ++k) {
    EXPECT_EQ(a.samples[k].points.size(), b.samples[k].points.size());
    for (std::size_t i = 0; i < a.samples[k].points.size(); ++i) {
      EXPECT_EQ(a.samples[k].points[i].id, b.samples[k].points[i].id);
      out.push_back(a.samples[k].points[i].u_px - b.samples[k].points[i].u_px);
      out.push_back(a.samples[k].points[i].v_px - b.samples[k].points[i].v_px);
    }
  }
  return out;
}

TEST(FeatureSimulator, PixelNoiseIsWhiteWithItsSigmaAndIndependentOfOutliers) {
  const auto cameras = stereo(CameraDistortion::kEquidistant);
  FeatureSimulation noisy = noiseless(30.);
  noisy.noise = true;
  noisy.sigma_px = 1.5;
  const auto truth = simulate_features(trajectory(), kMounting, cameras, noiseless(30.), 4);
  const auto measured = simulate_features(trajectory(), kMounting, cameras, noisy, 4);
  double sum = 0., squares = 0.;
  const auto errors = differences(measured, truth);
  const double n = static_cast<double>(errors.size());  // 96000
  for (const double e : errors) {
    sum += e / n;
    squares += e * e / n;
  }
  EXPECT_NEAR(sum, 0., 4. * 1.5 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(squares), 1.5, 4. * 1.5 / std::sqrt(2. * n));

  FeatureSimulation with_outliers = noisy;
  with_outliers.outlier_probability = 0.1;
  const auto off =
      differences(simulate_features(trajectory(), kMounting, cameras, with_outliers, 4), measured);
  double hit = 0.;
  for (std::size_t i = 0; i < off.size(); i += 2) {
    if (off[i] != 0. || off[i + 1] != 0.) hit += 1.;
    EXPECT_LE(std::abs(off[i]), 30.);
  }
  EXPECT_NEAR(hit / (0.5 * n), 0.1, 4. * std::sqrt(0.09 / (0.5 * n)));
}

TEST(FeatureSimulator, DropoutsTakePointsAwayAndLeaveTheOthersAsTheyWere) {
  const auto cameras = stereo(CameraDistortion::kEquidistant);
  FeatureSimulation all = noiseless(20.);
  all.noise = true;
  FeatureSimulation some = all;
  some.dropout_probability = 0.2;
  const auto base = simulate_features(trajectory(), kMounting, cameras, all, 4);
  const auto thinned = simulate_features(trajectory(), kMounting, cameras, some, 4);
  double kept = 0., total = 0.;
  for (std::size_t k = 0; k < base.samples.size(); ++k) {
    std::map<std::int64_t, FeaturePoint> points;
    for (const FeaturePoint& point : base.samples[k].points) points[point.id] = point;
    for (const FeaturePoint& point : thinned.samples[k].points) {
      ASSERT_TRUE(points.contains(point.id));
      EXPECT_EQ(points[point.id].u_px, point.u_px);
      EXPECT_EQ(points[point.id].v_px, point.v_px);
    }
    kept += static_cast<double>(thinned.samples[k].points.size());
    total += static_cast<double>(points.size());
  }
  EXPECT_NEAR(kept / total, 0.8, 4. * std::sqrt(0.16 / total));
}

TEST(FeatureSimulator, NoiseDoesNotMoveTheLandmarksAndEqualSeedsGiveEqualBits) {
  const auto cameras = stereo(CameraDistortion::kEquidistant);
  FeatureSimulation noisy = noiseless(3.);
  noisy.noise = true;
  const auto a = simulate_features(trajectory(), kMounting, cameras, noisy, 4);
  const auto b = simulate_features(trajectory(), kMounting, cameras, noisy, 4);
  for (const double difference : differences(a, b)) EXPECT_EQ(difference, 0.);
  EXPECT_EQ(a.p_FinG, simulate_features(trajectory(), kMounting, cameras, noiseless(3.), 4).p_FinG);
  EXPECT_NE(a.p_FinG[0], simulate_features(trajectory(), kMounting, cameras, noisy, 5).p_FinG[0]);
}

TEST(FeatureSimulator, WithoutCamerasThereAreNoImages) {
  EXPECT_TRUE(simulate_features(trajectory(), kMounting, {}, noiseless(1.), 4).samples.empty());
}

}  // namespace
}  // namespace viwo::sim
