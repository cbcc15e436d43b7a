#include "viwo/camera/camera_model.hpp"

#include <cmath>

#include <Eigen/LU>

namespace viwo {
namespace {

using CoefficientsJacobian = Eigen::Matrix<double, 2, 4>;

/// Distorted point of the plane z = 1, as a function of p_C.
struct Distorted {
  Eigen::Vector2d xy;
  Eigen::Matrix<double, 2, 3> J_point;  ///< by p_C
};

/// Whether 1 + 3 k1 r^2 + 5 k2 r^4, the slope of the distorted radius, was negative nearer to the
/// axis, though it need not be any more: the image has been folded back and out again.
bool is_beyond_folds(double k1, double k2, double r2) {
  return k1 < 0. && k2 > 0. && 9. * k1 * k1 > 20. * k2 && r2 > -0.3 * k1 / k2;
}

/// Distorted point for one of the plane z = 1, with the derivative by it; false where the model
/// folds back, and beyond.
bool distort_radtan(const CameraView& camera, double x, double y, Eigen::Vector2d& xy,
                    Eigen::Matrix2d& J) {
  const double k1 = camera.intrinsics[4], k2 = camera.intrinsics[5];
  const double p1 = camera.intrinsics[6], p2 = camera.intrinsics[7];
  const double r2 = x * x + y * y;
  const double radial = 1. + r2 * (k1 + r2 * k2);
  const double radial_slope = 2. * (k1 + 2. * k2 * r2);  // d radial / d x = radial_slope * x
  if (!(radial + r2 * radial_slope > 0.) || is_beyond_folds(k1, k2, r2)) return false;
  xy << x * radial + 2. * p1 * x * y + p2 * (r2 + 2. * x * x),
      y * radial + p1 * (r2 + 2. * y * y) + 2. * p2 * x * y;
  J << radial + x * x * radial_slope + 2. * p1 * y + 6. * p2 * x,
      x * y * radial_slope + 2. * p1 * x + 2. * p2 * y,
      x * y * radial_slope + 2. * p1 * x + 2. * p2 * y,
      radial + y * y * radial_slope + 6. * p1 * y + 2. * p2 * x;
  return true;
}

bool distort_radtan(const CameraView& camera, const Eigen::Vector3d& p_C, Distorted& out,
                    CoefficientsJacobian* J_coefficients) {
  if (!(p_C.z() > 1e-9)) return false;
  const double inverse_z = 1. / p_C.z();
  const double x = p_C.x() * inverse_z, y = p_C.y() * inverse_z;
  Eigen::Matrix2d J;
  if (!distort_radtan(camera, x, y, out.xy, J)) return false;
  out.J_point.leftCols<2>() = J * inverse_z;
  out.J_point.col(2) = -inverse_z * (J.col(0) * x + J.col(1) * y);
  if (J_coefficients != nullptr) {
    const double r2 = x * x + y * y;
    *J_coefficients << x * r2, x * r2 * r2, 2. * x * y, r2 + 2. * x * x,  //
        y * r2, y * r2 * r2, r2 + 2. * y * y, 2. * x * y;
  }
  return true;
}

/// The distance from the centre by the angle, `t2` its square.
double equidistant_part(const Eigen::Vector4d& k, double t2) {
  return 1. + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])));
}

/// How fast that distance grows with the angle; of one angle or of several.
template <class Squares>
Squares equidistant_slope(const Eigen::Vector4d& k, const Squares& t2) {
  return 1. + t2 * (3. * k[0] + t2 * (5. * k[1] + t2 * (7. * k[2] + t2 * (9. * k[3]))));
}

/// Whether the distance has grown all the way up to there, looked at step by step. A function of
/// its own, for hardly any lens asks for it.
[[gnu::noinline]] bool grows_up_to(const Eigen::Vector4d& k, double t2) {
  using Steps = Eigen::Array<double, 32, 1>;
  static const Steps fractions = Steps::LinSpaced(1. / 32., 1.);
  return (equidistant_slope(k, Steps(fractions * t2)) > 0.).all();
}

/// Whether it has grown all the way up to there: behind a fold it may grow again, and what is seen
/// there is nothing.
bool is_before_fold(const Eigen::Vector4d& k, double theta) {
  const double t2 = theta * theta;
  if (!(theta >= 0.) || theta > 3.14) return false;
  // Not even if all that makes it less were there at once.
  return equidistant_slope(k.cwiseMin(0.), t2) > 0. || grows_up_to(k, t2);
}

/// Derivative of the distorted point by p_C, which is r = |p_xy| from the axis, at z, |p_C|^2 = n2;
/// `direction` is p_xy / r, `d` the distance from the centre and `slope` that by the angle.
Eigen::Matrix<double, 2, 3> equidistant_jacobian(const Eigen::Vector2d& direction, double r,
                                                 double z, double n2, double d, double slope) {
  // xy = d(theta) a / r with d theta / d a = z a / (r n2), d theta / d z = -r / n2.
  const double radial = slope * z / n2;
  Eigen::Matrix<double, 2, 3> J;
  J.leftCols<2>() =
      (d / r) * Eigen::Matrix2d::Identity() + (radial - d / r) * direction * direction.transpose();
  J.col(2) = -slope * r / n2 * direction;
  return J;
}

bool distort_equidistant(const CameraView& camera, const Eigen::Vector3d& p_C, Distorted& out,
                         CoefficientsJacobian* J_coefficients) {
  const Eigen::Vector2d a = p_C.head<2>();
  const double z = p_C.z();
  const double a2 = a.squaredNorm();
  const double n2 = a2 + z * z;
  if (a2 < 1e-18 * n2) {
    if (!(z > 0.)) return false;
    out.xy = a / z;
    out.J_point << 1. / z, 0., -a.x() / (z * z), 0., 1. / z, -a.y() / (z * z);
    if (J_coefficients != nullptr) J_coefficients->setZero();
    return true;
  }
  const double r = std::sqrt(a2);
  const double theta = std::atan2(r, z);
  const double t2 = theta * theta;
  const Eigen::Vector4d k = camera.intrinsics.tail<4>();
  const double slope = equidistant_slope(k, t2);
  if (!is_before_fold(k, theta)) return false;
  const double d = theta * equidistant_part(k, t2);
  const Eigen::Vector2d direction = a / r;
  out.xy = d * direction;
  out.J_point = equidistant_jacobian(direction, r, z, n2, d, slope);
  if (J_coefficients != nullptr) {
    double power = theta;
    for (int i = 0; i < 4; ++i) {
      power *= t2;
      J_coefficients->col(i) = power * direction;
    }
  }
  return true;
}

bool distort(const CameraView& camera, const Eigen::Vector3d& p_C, Distorted& out,
             CoefficientsJacobian* J_coefficients = nullptr) {
  return camera.distortion == CameraDistortion::kRadtan
             ? distort_radtan(camera, p_C, out, J_coefficients)
             : distort_equidistant(camera, p_C, out, J_coefficients);
}

/// A step of Newton's method this small leaves an error of about its square, in radians.
constexpr double kStepTolerance = 1e-6;

Eigen::Vector3d direction_of(const Eigen::Vector2d& point) {
  return Eigen::Vector3d(point.x(), point.y(), 1.).normalized();
}

/// Unit vector towards a distorted point of the plane z = 1, with the derivative of the point by
/// it.
bool undistort_equidistant(const CameraView& camera, const Eigen::Vector2d& target,
                           Eigen::Vector3d& ray, Eigen::Matrix<double, 2, 3>& J) {
  const double d = target.norm();
  if (d < 1e-12) {
    ray = direction_of(target);
    J << 1., 0., -target.x(), 0., 1., -target.y();
    return true;
  }
  const Eigen::Vector4d k = camera.intrinsics.tail<4>();
  double theta = d, step = -d;  // half a step where it would leave what is not folded
  double not_folded = 0.;       // up to there
  const auto is_allowed = [&] {
    if (theta >= 0. && theta <= not_folded) return true;
    if (!is_before_fold(k, theta)) return false;
    not_folded = theta;
    return true;
  };
  for (int i = 0; i < 60; ++i) {
    if (!is_allowed()) {
      step *= 0.5;
      theta += step;
      continue;
    }
    const double t2 = theta * theta;
    step = (theta * equidistant_part(k, t2) - d) / equidistant_slope(k, t2);
    theta -= step;
    if (std::abs(step) < kStepTolerance) break;
  }
  if (!is_allowed() || std::abs(step) > kStepTolerance) return false;
  const double r = std::sin(theta), z = std::cos(theta);
  const Eigen::Vector2d direction = target / d;
  ray << r * direction, z;
  J = equidistant_jacobian(direction, r, z, 1., d, equidistant_slope(k, theta * theta));
  return true;
}

/// About the point of the plane z = 1 which is seen there: the inverse series of the radius.
Eigen::Vector2d about_undistorted(const CameraView& camera, const Eigen::Vector2d& target) {
  const double k1 = camera.intrinsics[4], k2 = camera.intrinsics[5];
  const double r2 = target.squaredNorm();
  const double scale = 1. + r2 * (-k1 + r2 * (3. * k1 * k1 - k2));
  return (scale > 0.5 && scale < 2. ? scale : 1.) * target;
}

/// The same. Newton's method on the distortion; half a step where it would leave what is not
/// folded.
bool undistort_radtan(const CameraView& camera, const Eigen::Vector2d& target, Eigen::Vector3d& ray,
                      Eigen::Matrix<double, 2, 3>& J_ray) {
  Eigen::Vector2d point = about_undistorted(camera, target), step = -point, distorted;
  Eigen::Matrix2d J;
  const auto is_found = [&] {
    const double n = std::sqrt(1. + point.squaredNorm());
    ray << point / n, 1. / n;
    J_ray.leftCols<2>() = n * J;
    J_ray.col(2) = -n * (J * point);
    return true;
  };
  for (int i = 0; i < 50; ++i) {
    if (!distort_radtan(camera, point.x(), point.y(), distorted, J)) {
      step *= 0.5;
      point += step;
      continue;
    }
    const Eigen::Vector2d residual = distorted - target;
    const double determinant = J.determinant();
    if (!(std::abs(determinant) > 1e-12)) return false;
    Eigen::Matrix2d inverse;
    inverse << J(1, 1), -J(0, 1), -J(1, 0), J(0, 0);
    step = inverse * residual / determinant;
    point -= step;
    if (step.squaredNorm() < kStepTolerance * kStepTolerance) return is_found();
  }
  return distorted.isApprox(target, 1e-9) && is_found();
}

Eigen::Vector2d to_pixels(const CameraView& camera, const Eigen::Vector2d& xy) {
  return camera.intrinsics.head<2>().cwiseProduct(xy) + camera.intrinsics.segment<2>(2);
}

}  // namespace

bool project(const CameraView& camera, const Eigen::Vector3d& p_C, Eigen::Vector2d& uv) {
  Distorted distorted;
  if (!distort(camera, p_C, distorted)) return false;
  uv = to_pixels(camera, distorted.xy);
  return true;
}

bool project(const CameraView& camera, const Eigen::Vector3d& p_C, Eigen::Vector2d& uv,
             PixelJacobian& J_point, IntrinsicsJacobian* J_intrinsics) {
  Distorted distorted;
  CoefficientsJacobian J_coefficients;
  if (!distort(camera, p_C, distorted, J_intrinsics != nullptr ? &J_coefficients : nullptr)) {
    return false;
  }
  uv = to_pixels(camera, distorted.xy);
  const Eigen::Vector2d focal = camera.intrinsics.head<2>();
  J_point = focal.asDiagonal() * distorted.J_point;
  if (J_intrinsics != nullptr) {
    J_intrinsics->leftCols<2>() = distorted.xy.asDiagonal();
    J_intrinsics->middleCols<2>(2).setIdentity();
    J_intrinsics->rightCols<4>() = focal.asDiagonal() * J_coefficients;
  }
  return true;
}

std::optional<Eigen::Vector3d> unproject(const CameraView& camera, const Eigen::Vector2d& uv,
                                         PixelJacobian* J_ray) {
  const Eigen::Vector2d focal = camera.intrinsics.head<2>();
  const Eigen::Vector2d target = (uv - camera.intrinsics.segment<2>(2)).cwiseQuotient(focal);
  if (!target.allFinite()) return std::nullopt;
  Eigen::Vector3d ray;
  Eigen::Matrix<double, 2, 3> J;
  const bool is_seen = camera.distortion == CameraDistortion::kEquidistant
                           ? undistort_equidistant(camera, target, ray, J)
                           : undistort_radtan(camera, target, ray, J);
  if (!is_seen) return std::nullopt;
  if (J_ray != nullptr) *J_ray = focal.asDiagonal() * J;
  return ray;
}

}  // namespace viwo
