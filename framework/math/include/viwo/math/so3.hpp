// Rotations in three dimensions. Exp and Log are those of SO(3); Exp(phi) turns vectors by |phi|
// around phi. With the filter's convention R_GtoI = Exp(-dtheta) R_GtoI_hat.
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace viwo {

/// skew(a) b = a x b.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d S;
  S << 0., -a.z(), a.y(), a.z(), 0., -a.x(), -a.y(), a.x(), 0.;
  return S;
}

inline Eigen::Matrix3d exp_so3(const Eigen::Vector3d& phi) {
  const double t2 = phi.squaredNorm();
  double a = 0., b = 0.;  // sin(t)/t, (1 - cos(t))/t^2
  if (t2 < 1e-4) {
    a = 1. - t2 / 6. * (1. - t2 / 20. * (1. - t2 / 42.));
    b = 0.5 * (1. - t2 / 12. * (1. - t2 / 30. * (1. - t2 / 56.)));
  } else {
    const double t = std::sqrt(t2);
    a = std::sin(t) / t;
    b = (1. - std::cos(t)) / t2;
  }
  // I + a [phi] + b [phi]^2 with [phi]^2 = phi phi^T - t^2 I.
  Eigen::Matrix3d R = b * phi * phi.transpose() + a * skew(phi);
  R.diagonal().array() += 1. - b * t2;
  return R;
}

/// Rotation vector in [0, pi] length; R must be a rotation.
inline Eigen::Vector3d log_so3(const Eigen::Matrix3d& R) {
  const Eigen::Vector3d axis_sin(0.5 * (R(2, 1) - R(1, 2)), 0.5 * (R(0, 2) - R(2, 0)),
                                 0.5 * (R(1, 0) - R(0, 1)));
  const double s = axis_sin.norm();
  const double c = 0.5 * (R.trace() - 1.);
  const double angle = std::atan2(s, c);
  if (c > -0.9) {  // far from pi: the antisymmetric part has full precision
    const double a2 = angle * angle;
    const double factor = s < 1e-4 ? 1. + a2 / 6. * (1. + 7. * a2 / 60.) : angle / s;
    return factor * axis_sin;
  }
  const Eigen::AngleAxisd angle_axis(R);
  return angle_axis.angle() * angle_axis.axis();
}

/// Right Jacobian: Exp(phi + d) = Exp(phi) Exp(Jr(phi) d) to first order in d. The left one is
/// Jr(-phi).
inline Eigen::Matrix3d right_jacobian_so3(const Eigen::Vector3d& phi) {
  const double t2 = phi.squaredNorm();
  double b = 0., c = 0.;  // (1 - cos(t))/t^2, (t - sin(t))/t^3
  if (t2 < 1e-4) {
    b = 0.5 * (1. - t2 / 12. * (1. - t2 / 30.));
    c = 1. / 6. * (1. - t2 / 20. * (1. - t2 / 42.));
  } else {
    const double t = std::sqrt(t2);
    b = (1. - std::cos(t)) / t2;
    c = (t - std::sin(t)) / (t2 * t);
  }
  const Eigen::Matrix3d S = skew(phi);
  return Eigen::Matrix3d::Identity() - b * S + c * S * S;
}

/// Inverse of the right Jacobian: Log(Exp(phi) Exp(d)) = phi + Jr^-1(phi) d to first order.
inline Eigen::Matrix3d right_jacobian_inverse_so3(const Eigen::Vector3d& phi) {
  const double t2 = phi.squaredNorm();
  double c = 0.;  // 1/t^2 - (1 + cos(t)) / (2 t sin(t))
  if (t2 < 1e-3) {
    c = 1. / 12. * (1. + t2 / 60. * (1. + t2 / 42.));
  } else {
    const double t = std::sqrt(t2);
    c = 1. / t2 - (1. + std::cos(t)) / (2. * t * std::sin(t));
  }
  const Eigen::Matrix3d S = skew(phi);
  return Eigen::Matrix3d::Identity() + 0.5 * S + c * S * S;
}

/// The rotation matrix nearest to a matrix that drifted off by rounding.
inline Eigen::Matrix3d normalized_rotation(const Eigen::Matrix3d& R) {
  return Eigen::Quaterniond(R).normalized().toRotationMatrix();
}

}  // namespace viwo
