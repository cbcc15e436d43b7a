// Which pairs of rays belong to one motion of the camera: RANSAC of an essential matrix on unit
// vectors, so that any field of view is right (model.md).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace viwo::klt {

/// p_2 = R p_1 + t, t of unit length.
struct RelativeMotion {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::UnitX();
};

/// Rays of two images, `dt_s` apart, whose rows were exposed one after the other, as the middle
/// rows would have them if the camera only turned (KLT-12). `rows_1`, `rows_2`: how long after the
/// middle row each was seen, s.
void straighten(std::span<Eigen::Vector3d> rays_1, std::span<Eigen::Vector3d> rays_2,
                std::span<const double> rows_1, std::span<const double> rows_2, double dt_s);

/// By how much two unit rays miss a common point, rad: to first order, the angle of one of them to
/// the epipolar plane of the other, also next to the epipole, where that plane is ill-defined.
double epipolar_angle(const RelativeMotion& motion, const Eigen::Vector3d& ray_1,
                      const Eigen::Vector3d& ray_2);

/// One flag per pair: 1 for the pairs within `threshold_rad` of the motion that the most of them
/// agree on. Fewer than 8 pairs are all taken. Same arguments, same bits.
std::vector<std::uint8_t> epipolar_inliers(std::span<const Eigen::Vector3d> rays_1,
                                           std::span<const Eigen::Vector3d> rays_2,
                                           double threshold_rad, std::uint64_t seed,
                                           RelativeMotion* motion = nullptr);

}  // namespace viwo::klt
