// Where rays of cameras meet, be it at infinity.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace viwo::visual {

/// A point by its direction and inverse distance from somewhere: p_FinG = origin + direction / rho.
/// rho = 0: infinitely far; less: rays that part, as those of a far point do for their noise.
struct InversePoint {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double rho = 0.;  ///< 1/m where `direction` is of unit length

  /// rho = 1 from the origin of G.
  static InversePoint at(const Eigen::Vector3d& p_FinG) {
    return {Eigen::Vector3d::Zero(), p_FinG, 1.};
  }
  /// The direction from `p`, times rho and the distance.
  Eigen::Vector3d seen_from(const Eigen::Vector3d& p) const {
    return direction + rho * (origin - p);
  }
  Eigen::Vector3d p_FinG() const { return origin + direction / rho; }
};

enum class FeatureStatus : std::uint8_t { kOk, kNotVisible, kNear, kBroken };

/// Two unit vectors across a unit vector, and each other.
Eigen::Matrix<double, 3, 2> basis_across(const Eigen::Vector3d& unit);

/// What a camera has measured, in G.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;      ///< unit
  Eigen::Matrix<double, 2, 3> J;  ///< d uv / d (p_FinG - origin) at `direction`

  bool is_finite() const { return origin.allFinite() && direction.allFinite() && J.allFinite(); }
};

/// A point, and how well its rays tell it.
struct MetRays {
  InversePoint point;                 ///< `direction` of unit length
  Eigen::Matrix<double, 3, 2> basis;  ///< of what is across it
  double sigma_rho = 0.;              ///< 1/m
  bool has_distance = false;          ///< beyond what noise feigns
  /// How rho answers to the gradients of the residuals: a row of the inverse of J^T J.
  Eigen::RowVector3d of_rho = Eigen::RowVector3d::Zero();

  /// Derivative by p_FinG of the coordinates: across the direction, and rho (VF-26).
  Eigen::Matrix3d by_point() const;
};

/// What is known of rho before: no point is nearer than `min_distance_m`.
inline double information_of_rho(double min_distance_m) { return min_distance_m * min_distance_m; }

/// Derivative of a ray's pixels by what it sees, q = rho (p_FinG - origin), and by the coordinates
/// of the point.
struct RayDerivative {
  Eigen::Vector2d e;  ///< the residual, px
  Eigen::Matrix<double, 2, 3> by_q, by_point;
  bool is_visible = true;
};
RayDerivative derivative_of(const Ray& ray, const InversePoint& point,
                            const Eigen::Matrix<double, 3, 2>& basis);

/// Least squares of the pixel residuals (VF-3) over direction and inverse distance from the first
/// ray's origin. Anything but kOk: no use to linearise.
FeatureStatus triangulate(std::span<const Ray> rays, double sigma_px, double min_distance_m,
                          MetRays& out);

/// How far the points are, of those that were found last. What a track tells of the way goes with
/// its rho: taken as it was found, noise and all, it would be seen where it is not (VF-28).
class FoundDistances {
 public:
  void add(double rho, double variance);
  /// What is to be expected of the point: its rho, and its sigma, if it is `of_scene`. 0 where its
  /// rays tell less than the others do, or nothing and there are no others yet. One that is not of
  /// the scene stays where it was found.
  void expect(bool of_scene, MetRays& met) const;
  double mean() const { return mean_; }
  double mean_square() const { return second_; }

 private:
  double variance() const { return std::max(0., second_ - mean_ * mean_); }
  double weight_ = 0.;
  int count_ = 0;
  double mean_ = 0., second_ = 0.;  ///< of rho: mean, and mean square
  double noise_ = 0.;               ///< mean variance of what was found
};

/// The rays that agree within `most_px` on the point of two of them, for the two with which most do
/// (VF-22); returns how many. `agrees` is for work.
int find_agreeing(std::span<const Ray> rays, double most_px, std::vector<bool>& agrees,
                  std::vector<bool>& best);

}  // namespace viwo::visual
