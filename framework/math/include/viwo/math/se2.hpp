// Planar motion: constant-twist arcs and their derivatives. g = [theta, x, y]: theta is the yaw of
// the later frame in the earlier one (counter-clockwise positive, d theta/dt = omega), [x, y] its
// origin.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace viwo {

/// J v is v turned by +90 degrees; d R(theta)/d theta = J R(theta).
inline Eigen::Matrix2d J2() {
  Eigen::Matrix2d J;
  J << 0., -1., 1., 0.;
  return J;
}

inline Eigen::Matrix2d R2(double theta) {
  const double c = std::cos(theta);
  const double s = std::sin(theta);
  Eigen::Matrix2d R;
  R << c, -s, s, c;
  return R;
}

/// Angle in (-pi, pi].
inline double wrap_angle(double angle) {
  const double wrapped = std::remainder(angle, 2. * M_PI);
  return wrapped <= -M_PI ? wrapped + 2. * M_PI : wrapped;
}

/// sin(z)/z and its derivative, smooth through z = 0.
struct Sinc {
  double value;
  double derivative;
};

inline Sinc sinc(double z) {
  const double z2 = z * z;
  // Below |z| = 0.05 the series to z^8 (z^7) is exact to the last bit; the closed form of the
  // derivative loses digits there.
  if (z2 < 2.5e-3) {
    return {1. - z2 / 6. * (1. - z2 / 20. * (1. - z2 / 42. * (1. - z2 / 72.))),
            -z / 3. * (1. - z2 / 10. * (1. - z2 / 28. * (1. - z2 / 54.)))};
  }
  const double s = std::sin(z);
  return {s / z, (z * std::cos(z) - s) / z2};
}

/// a (+) b: g of the frame that is at `b` seen from the frame at `a`. theta is not wrapped.
inline Eigen::Vector3d compose(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Eigen::Vector3d g;
  g << a[0] + b[0], a.tail<2>() + R2(a[0]) * b.tail<2>();
  return g;
}

/// The frame at `b` seen from the frame at `a`, both given in one frame: compose(a, between(a,b)) =
/// b.
inline Eigen::Vector3d between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Eigen::Vector3d g;
  g << b[0] - a[0], R2(a[0]).transpose() * (b.tail<2>() - a.tail<2>());
  return g;
}

/// Logarithm of SE(2): the constant twist [theta, v_x, v_y] that reaches g in unit time; theta is
/// wrapped to (-pi, pi].
inline Eigen::Vector3d log_se2(const Eigen::Vector3d& g) {
  const double theta = wrap_angle(g[0]);
  // p = rho R(theta/2) v with rho = sinc(theta/2) (closed form of the constant-twist arc).
  Eigen::Vector3d twist;
  twist << theta, R2(-0.5 * theta) * g.tail<2>() / sinc(0.5 * theta).value;
  return twist;
}

}  // namespace viwo
