// A textured room seen by a fisheye stereo pair whose motion is known: images by ray casting, for
// the tests and the benchmark.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "viwo/api/filter_view.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/camera/camera_model.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::klt {

/// The pair of configs/cameras/t265_like.yaml at `scale` of its resolution; IMU at the left camera,
/// with its axes.
inline std::vector<CameraView> fisheye_pair(double scale) {
  CameraView left;
  left.distortion = CameraDistortion::kEquidistant;
  left.width_px = static_cast<int>(848 * scale);
  left.height_px = static_cast<int>(800 * scale);
  left.intrinsics << 282. * scale, 281. * scale, 416. * scale, 398. * scale, -0.003, 0.054, -0.052,
      0.011;
  CameraView right = left;
  right.intrinsics.head<4>() << 281.5 * scale, 280.5 * scale, 414. * scale, 406. * scale;
  right.p_IinC.x() = -0.063;
  return {left, right};
}

struct CameraPose {
  Eigen::Matrix3d R_CtoW = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_CinW = Eigen::Vector3d::Zero();
};

/// Pose of another camera of the rig.
inline CameraPose pose_of(const CameraView& camera, const CameraPose& left) {
  const Eigen::Vector3d p_IinW = left.p_CinW;
  CameraPose pose;
  pose.R_CtoW = left.R_CtoW * camera.R_ItoC.transpose();
  pose.p_CinW = p_IinW - pose.R_CtoW * camera.p_IinC;
  return pose;
}

/// A square that faces the z axis of the world and moves on its own.
struct Mover {
  Eigen::Vector3d centre;
  double half_side = 0.3;
};

/// A box of 7 x 4 x 6 m around the origin of W; y is down.
class Room {
 public:
  explicit Room(std::uint64_t seed = 7) {
    std::mt19937_64 random(seed);
    cv::Mat fine(kSide, kSide, CV_32F), coarse(kSide / 8, kSide / 8, CV_32F), large;
    for (cv::Mat* noise : {&fine, &coarse}) {
      std::for_each(noise->begin<float>(), noise->end<float>(), [&](float& value) {
        value = static_cast<float>(random() % 1024) / 1023.F - 0.5F;
      });
    }
    cv::GaussianBlur(fine, fine, cv::Size(), 1.6);
    cv::resize(coarse, large, fine.size(), 0., 0., cv::INTER_CUBIC);
    texture_ = 1100. * fine + 110. * large + 127.;
  }

  /// Where a ray from inside meets the wall.
  static Eigen::Vector3d hit(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
    double nearest = 1e9;
    for (int i = 0; i < 3; ++i) {
      const double wall = direction[i] > 0. ? kHalf[static_cast<std::size_t>(i)]
                                            : -kHalf[static_cast<std::size_t>(i)];
      if (std::abs(direction[i]) > 1e-12) {
        nearest = std::min(nearest, (wall - from[i]) / direction[i]);
      }
    }
    return from + nearest * direction;
  }

  /// Grey level of a point on the wall.
  double grey(const Eigen::Vector3d& p) const {
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
      if (std::abs(p[i]) / kHalf[static_cast<std::size_t>(i)] >
          std::abs(p[axis]) / kHalf[static_cast<std::size_t>(axis)]) {
        axis = i;
      }
    }
    const double face = 97. * axis + (p[axis] > 0. ? 41. : 0.);
    return texel(p[(axis + 1) % 3] / kTexel + face, p[(axis + 2) % 3] / kTexel + 2. * face);
  }

  double mover_grey(const Eigen::Vector2d& on_mover) const {
    constexpr double kFiner = 0.4;  // it is nearer than the walls
    return texel(on_mover.x() / (kFiner * kTexel) + 17., on_mover.y() / (kFiner * kTexel) + 311.);
  }

 private:
  static constexpr int kSide = 512;
  static constexpr double kTexel = 0.02;  // m
  static constexpr std::array<double, 3> kHalf{3.5, 2., 3.};

  double texel(double x, double y) const {
    const double fx = std::floor(x), fy = std::floor(y);
    const auto at = [&](double column, double row) {
      const int c = static_cast<int>(column) & (kSide - 1), r = static_cast<int>(row) & (kSide - 1);
      return static_cast<double>(texture_.at<float>(r, c));
    };
    const double u = x - fx, v = y - fy;
    return (1. - v) * ((1. - u) * at(fx, fy) + u * at(fx + 1., fy)) +
           v * ((1. - u) * at(fx, fy + 1.) + u * at(fx + 1., fy + 1.));
  }

  cv::Mat texture_;
};

/// Makes the images of one camera.
class Renderer {
 public:
  Renderer(const CameraView& camera, const Room& room) : camera_(camera), room_(room) {
    for (int v = 0; v < camera.height_px; ++v) {
      for (int u = 0; u < camera.width_px; ++u) {
        rays_.push_back(unproject(camera, Eigen::Vector2d(u, v)));
      }
    }
  }

  /// With gaussian noise of `sigma` grey levels.
  Image render(const CameraPose& pose, double sigma = 0., std::uint64_t seed = 1,
               const std::optional<Mover>& mover = {}) const {
    Image image{camera_.width_px, camera_.height_px, {}};
    image.pixels.reserve(rays_.size());
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0., 1.);
    for (const auto& ray : rays_) {
      double grey = ray ? grey_of(pose, pose.R_CtoW * *ray, mover) : 0.;
      if (sigma > 0.) grey += sigma * noise(random);
      image.pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L)));
    }
    return image;
  }

  const CameraView& camera() const { return camera_; }

 private:
  double grey_of(const CameraPose& pose, const Eigen::Vector3d& direction,
                 const std::optional<Mover>& mover) const {
    if (mover && std::abs(direction.z()) > 1e-9) {
      const double along = (mover->centre.z() - pose.p_CinW.z()) / direction.z();
      const Eigen::Vector2d on_mover = (pose.p_CinW + along * direction - mover->centre).head<2>();
      if (along > 0. && on_mover.cwiseAbs().maxCoeff() < mover->half_side) {
        return room_.mover_grey(on_mover);
      }
    }
    return room_.grey(Room::hit(pose.p_CinW, direction));
  }

  CameraView camera_;
  const Room& room_;
  std::vector<std::optional<Eigen::Vector3d>> rays_;
};

}  // namespace viwo::klt
