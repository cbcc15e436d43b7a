// Camera models: values against the formulas of Kalibr, derivatives against central differences,
// directions there and back.
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "viwo/camera/camera_model.hpp"

namespace viwo {
namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

CameraView radtan_camera() {
  CameraView camera;
  camera.distortion = CameraDistortion::kRadtan;
  camera.width_px = 752;
  camera.height_px = 480;
  camera.intrinsics << 458.7, 457.3, 367.2, 248.4, -0.283, 0.0739, 1.9e-3, -1.8e-3;
  return camera;
}

CameraView fisheye_camera() {
  CameraView camera;
  camera.distortion = CameraDistortion::kEquidistant;
  camera.width_px = 848;
  camera.height_px = 800;
  camera.intrinsics << 286.2, 286.4, 423.1, 397.7, -8e-3, 4.4e-2, -4.2e-2, 7.6e-3;
  return camera;
}

/// A point at a random distance, `angle` off the axis.
Eigen::Vector3d point_at(double angle, Random& random) {
  const double azimuth = uniform(random, -M_PI, M_PI);
  return uniform(random, 0.3, 20.) * Eigen::Vector3d(std::sin(angle) * std::cos(azimuth),
                                                     std::sin(angle) * std::sin(azimuth),
                                                     std::cos(angle));
}

struct Case {
  CameraView camera;
  double max_angle;
};

std::vector<Case> cases() { return {{radtan_camera(), 0.6}, {fisheye_camera(), 1.65}}; }

TEST(CameraModel, RadtanIsTheFormulaOfKalibr) {
  const CameraView camera = radtan_camera();
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d p_C = point_at(uniform(random, 0., 0.6), random);
    const double x = p_C.x() / p_C.z(), y = p_C.y() / p_C.z();
    const double r2 = std::pow(std::hypot(x, y), 2);
    const double k1 = -0.283, k2 = 0.0739, p1 = 1.9e-3, p2 = -1.8e-3;
    const double radial = 1. + k1 * r2 + k2 * std::pow(r2, 2);
    const double xd = x * radial + 2. * p1 * x * y + p2 * (r2 + 2. * x * x);
    const double yd = y * radial + 2. * p2 * x * y + p1 * (r2 + 2. * y * y);
    Eigen::Vector2d uv;
    ASSERT_TRUE(project(camera, p_C, uv));
    EXPECT_NEAR(uv.x(), 458.7 * xd + 367.2, 1e-10);
    EXPECT_NEAR(uv.y(), 457.3 * yd + 248.4, 1e-10);
  }
}

TEST(CameraModel, EquidistantIsTheFormulaOfKalibr) {
  const CameraView camera = fisheye_camera();
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const double theta = uniform(random, 0.01, 1.65);
    const double azimuth = uniform(random, -M_PI, M_PI);
    const Eigen::Vector3d p_C(3. * std::sin(theta) * std::cos(azimuth),
                              3. * std::sin(theta) * std::sin(azimuth), 3. * std::cos(theta));
    const double distorted = theta - 8e-3 * std::pow(theta, 3) + 4.4e-2 * std::pow(theta, 5) -
                             4.2e-2 * std::pow(theta, 7) + 7.6e-3 * std::pow(theta, 9);
    Eigen::Vector2d uv;
    ASSERT_TRUE(project(camera, p_C, uv));
    EXPECT_NEAR(uv.x(), 286.2 * distorted * std::cos(azimuth) + 423.1, 1e-9);
    EXPECT_NEAR(uv.y(), 286.4 * distorted * std::sin(azimuth) + 397.7, 1e-9);
  }
}

TEST(CameraModel, JacobiansAreCentralDifferences) {
  for (const Case& c : cases()) {
    Random random(3);
    for (int i = 0; i < 200; ++i) {
      // The second half near the edge: beyond 80 degrees for the fisheye.
      const double angle = i < 100 ? uniform(random, 0., c.max_angle)
                                   : uniform(random, 0.86 * c.max_angle, c.max_angle);
      const Eigen::Vector3d p_C = point_at(angle, random);
      Eigen::Vector2d uv, plain;
      PixelJacobian J;
      IntrinsicsJacobian J_intrinsics;
      ASSERT_TRUE(project(c.camera, p_C, uv, J, &J_intrinsics));
      ASSERT_TRUE(project(c.camera, p_C, plain));
      EXPECT_LT((uv - plain).norm(), 1e-10);
      for (int k = 0; k < 3; ++k) {
        const double step = 1e-6 * p_C.norm();
        const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(k);
        Eigen::Vector2d plus, minus;
        ASSERT_TRUE(project(c.camera, p_C + d, plus) && project(c.camera, p_C - d, minus));
        EXPECT_LT((J.col(k) - (plus - minus) / (2. * step)).norm(), 1e-6 * J.norm());
      }
      for (int k = 0; k < 8; ++k) {
        CameraView changed = c.camera;
        const double step = 1e-6 * std::max(1., std::abs(c.camera.intrinsics[k]));
        Eigen::Vector2d plus, minus;
        changed.intrinsics[k] = c.camera.intrinsics[k] + step;
        ASSERT_TRUE(project(changed, p_C, plus));
        changed.intrinsics[k] = c.camera.intrinsics[k] - step;
        ASSERT_TRUE(project(changed, p_C, minus));
        EXPECT_LT((J_intrinsics.col(k) - (plus - minus) / (2. * step)).norm(),
                  1e-6 * (1. + J_intrinsics.col(k).norm()));
      }
    }
  }
}

TEST(CameraModel, JacobianOnTheAxisIsThatBesideIt) {
  for (const Case& c : cases()) {
    Eigen::Vector2d on, beside;
    PixelJacobian J_on, J_beside;
    IntrinsicsJacobian I_on, I_beside;
    ASSERT_TRUE(project(c.camera, {0., 0., 2.}, on, J_on, &I_on));
    ASSERT_TRUE(project(c.camera, {1e-7, -2e-7, 2.}, beside, J_beside, &I_beside));
    EXPECT_EQ(on, Eigen::Vector2d(c.camera.intrinsics.segment<2>(2)));
    EXPECT_LT((J_on - J_beside).norm(), 1e-4);
    EXPECT_LT((I_on - I_beside).norm(), 1e-4);
  }
}

TEST(CameraModel, UnprojectLeadsBackToTheDirection) {
  for (const Case& c : cases()) {
    Random random(4);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d p_C = point_at(uniform(random, 0., c.max_angle), random);
      Eigen::Vector2d uv;
      ASSERT_TRUE(project(c.camera, p_C, uv));
      PixelJacobian J_ray, J;
      const auto direction = unproject(c.camera, uv, &J_ray);
      ASSERT_TRUE(direction.has_value());
      EXPECT_NEAR(direction->norm(), 1., 1e-12);
      EXPECT_LT((*direction - p_C.normalized()).norm(), 1e-10);
      ASSERT_TRUE(project(c.camera, *direction, uv, J));
      EXPECT_LT((J_ray - J).norm(), 1e-6 * J.norm());
    }
    EXPECT_EQ(unproject(c.camera, c.camera.intrinsics.segment<2>(2)), Eigen::Vector3d::UnitZ());
  }
}

TEST(CameraModel, HasNoImageOfWhatIsBehindOrFoldedBack) {
  Eigen::Vector2d uv;
  EXPECT_FALSE(project(radtan_camera(), {0.1, 0.1, -1.}, uv));
  EXPECT_FALSE(project(radtan_camera(), {0.1, 0.1, 0.}, uv));
  EXPECT_FALSE(project(fisheye_camera(), {0., 0., -1.}, uv));
  // x (1 - 0.4 x^2) turns back at x = 0.913.
  CameraView folding = radtan_camera();
  folding.intrinsics.tail<4>() << -0.4, 0., 0., 0.;
  EXPECT_TRUE(project(folding, {0.90, 0., 1.}, uv));
  EXPECT_FALSE(project(folding, {0.92, 0., 1.}, uv));
  // Its largest image is 0.6086 of the focal length: beyond that no direction.
  const Eigen::Vector2d centre = folding.intrinsics.segment<2>(2);
  EXPECT_TRUE(unproject(folding, centre + Eigen::Vector2d(0.60 * 458.7, 0.)).has_value());
  EXPECT_FALSE(unproject(folding, centre + Eigen::Vector2d(0.62 * 458.7, 0.)).has_value());
  // x (1 - 0.28 x^2 + 0.03 x^4) turns back at x = 1.311 and out again at 1.970: the same pixels
  // once more.
  folding.intrinsics.tail<4>() << -0.28, 0.03, 0., 0.;
  EXPECT_TRUE(project(folding, {1.30, 0., 1.}, uv));
  for (const double x : {1.32, 1.9, 1.98, 2.5, 9.}) EXPECT_FALSE(project(folding, {x, 0., 1.}, uv));
  for (double off = 0.; off < 0.9; off += 0.01) {  // of the focal length; the largest is 0.796
    const auto direction = unproject(folding, centre + Eigen::Vector2d(off * 458.7, 0.));
    ASSERT_EQ(direction.has_value(), off < 0.796) << off;
    if (direction) {
      EXPECT_LT(direction->x() / direction->z(), 1.312);
    }
  }
  // theta (1 - 0.2 theta^2) turns back at 1.291 rad.
  CameraView fisheye = fisheye_camera();
  fisheye.intrinsics.tail<4>() << -0.2, 0., 0., 0.;
  EXPECT_TRUE(project(fisheye, {std::sin(1.28), 0., std::cos(1.28)}, uv));
  EXPECT_FALSE(project(fisheye, {std::sin(1.30), 0., std::cos(1.30)}, uv));
}

// Fisheyes of which the distance from the centre falls beyond some angle, and grows again.
TEST(CameraModel, HasNoImageBehindTheFirstFoldOfAFisheye) {
  Eigen::Vector4d grows_again, late;
  grows_again << -0.00109, 0.0379, -0.0363, 0.00562;
  late << 0.2, -0.07, 0., 0.;
  for (const Eigen::Vector4d& k : {grows_again, late}) {
    CameraView fisheye = fisheye_camera();
    fisheye.intrinsics.tail<4>() = k;
    bool was_seen = true;
    double last = 0.;
    for (double theta = 0.01; theta < 3.1; theta += 0.005) {
      const Eigen::Vector3d ray(std::sin(theta), 0., std::cos(theta));
      Eigen::Vector2d uv;
      const bool is_seen = project(fisheye, ray, uv);
      EXPECT_TRUE(was_seen || !is_seen) << theta;
      was_seen = is_seen;
      if (!is_seen) continue;
      last = theta;
      const auto direction = unproject(fisheye, uv);
      ASSERT_TRUE(direction.has_value()) << theta;
      EXPECT_LT((*direction - ray).norm(), 1e-6) << theta;
    }
    EXPECT_GT(last, 1.5);
    EXPECT_LT(last, 2.);
  }
}

TEST(CameraModel, RefusesWhatIsNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Case& c : cases()) {
    Eigen::Vector2d uv;
    EXPECT_FALSE(project(c.camera, {nan, 0., 1.}, uv));
    EXPECT_FALSE(project(c.camera, {0., 0., nan}, uv));
    EXPECT_FALSE(unproject(c.camera, {nan, 3.}).has_value());
    EXPECT_FALSE(unproject(c.camera, {3., infinity}).has_value());
  }
}

TEST(CameraModel, TheImageEndsAtTheCentresOfItsLastPixels) {
  const CameraView camera = radtan_camera();
  EXPECT_TRUE(in_image(camera, {0., 0.}));
  EXPECT_TRUE(in_image(camera, {751., 479.}));
  EXPECT_FALSE(in_image(camera, {751.1, 0.}));
  EXPECT_FALSE(in_image(camera, {0., -0.1}));
}

}  // namespace
}  // namespace viwo
