#include "interval_factor.hpp"

#include <array>
#include <cmath>

#include "viwo/math/so3.hpp"

namespace viwo::wheel_odometry {

using namespace wheel_motion;

namespace {

/// Steps for the second derivatives, of the mount (rad, m) and the time offset (s). The Jacobian is
/// nearly quadratic in them, so that they may be large.
constexpr double kSecondDerivativeStep = 1e-4;

/// Of the mount in a CalibrationJacobian; x and y follow.
constexpr int kYawColumn = 2;

/// Whether a pose tells of some intrinsics, but not of one that turns with O and is not known.
bool hides_turn(const IntrinsicJacobian& J_g_WI, const Intrinsics& by_yaw,
                const Eigen::Ref<const Intrinsics>& variance) {
  if (J_g_WI.isZero(0.)) return false;  // of a base that stands
  for (Eigen::Index i = 0; i < by_yaw.size(); ++i) {
    if (by_yaw[i] != 0. && variance[i] > 0. && J_g_WI.col(i).isZero(0.)) return true;
  }
  return false;
}

/// `at` with the mount or the time offset, entry k of the geometry, a step on.
Point stepped(Point at, int k) {
  Eigen::Vector3d d = Eigen::Vector3d::Zero();
  if (k == kTimeOffset) {
    at.first.after_s += kSecondDerivativeStep;
    at.last.after_s += kSecondDerivativeStep;
    return at;
  }
  d[k % 3] = kSecondDerivativeStep;
  if (k < kMountPosition) {
    at.mount.R_ItoO = exp_so3(-d) * at.mount.R_ItoO;
  } else {
    at.mount.p_IinO += d;
  }
  return at;
}

}  // namespace

Eigen::Matrix3d measurement_noise(const Params& params, const PreintegratedPose& pose) {
  const double path = pose.path_length_m;
  Eigen::Matrix3d R = square(params.noise_scale) * pose.P_g;
  R(0, 0) += square(params.sigma_floor_yaw_rad) + path * square(params.sigma_yaw_rad_per_sqrt_m);
  for (int i = 1; i < 3; ++i) {
    R(i, i) +=
        square(params.sigma_floor_position_m) + path * square(params.sigma_position_m_per_sqrt_m);
  }
  return R;
}

Linearised IntervalFactor::linearise(const Point& at, const PreintegratedPose& pose) const {
  Linearised out;
  out.residual = pose.g - relative_pose(at.first, at.last, at.mount, &out.tilt);
  const Motion motion = complete_motion(pose.g, out.tilt);
  out.residual.tail<2>() += motion.d.head<2>() - pose.g.tail<2>();
  out.residual[0] = std::remainder(out.residual[0], 2. * M_PI);
  MovingPose first = interval_.first_fej;
  MovingPose last = interval_.last_fej;
  first.after_s = at.first.after_s;
  last.after_s = at.last.after_s;
  PoseJacobian geometry = relative_pose_jacobian(first, last, at.mount);
  out.R = measurement_noise(params_, pose) + interval_.curvature_noise;
  // What the mount shows is proportional to the motion. Taken at the noisy first estimates it
  // would count their noise as motion, and so as information: it is taken at the motion that the
  // wheels measured, with a tilt that intervals before tell.
  const Eigen::Vector3d& p_IinO = at.mount.p_IinO;
  CalibrationJacobian measured = calibration_jacobian(pose.g, out.tilt, interval_.rate.g, p_IinO);
  const States& states = interval_.states;
  const auto n = states.n_intrinsics();
  out.lasting.setZero();
  if (n > 0) {  // held intrinsics are no states
    const auto& J = pose.J_g_WI;
    out.lasting = (J * states.P.bottomRightCorner(n, n)).cwiseProduct(J).rowwise().sum();
  }
  Eigen::Vector3d motion_of_O = planar_part(pose.g, out.R.diagonal() + out.lasting);
  if (motion_of_O[0] == 0.) motion_of_O[0] = before_.turn.expected(pose.duration_s);
  // Free of the noise of this interval.
  const Eigen::Vector2d tilt =
      params_.motion_sigmas > 0. ? before_.tilt.expected(pose.duration_s) : out.tilt;
  const Rate& rate = interval_.rate;
  CalibrationJacobian moving =
      calibration_jacobian(motion_of_O, tilt, planar_part(rate.g, rate.variance), p_IinO);
  if (n > 0 && interval_.by_yaw) {
    const Eigen::Vector3d yaw = hidden_yaw(pose.J_g_WI, measured, p_IinO);
    if (!motion_of_O.isZero()) moving.col(kYawColumn) += yaw - measured.col(kYawColumn);
    measured.col(kYawColumn) = yaw;
  }
  geometry.rightCols<kCalibrationSize>() = moving;
  out.H.resize(3, states.P.cols());
  for (int k = 0; k < states.n_geometry; ++k) out.H.col(k) = geometry.col(states.geometry_at(k));
  if (n > 0) out.H.rightCols(n) = -pose.J_g_WI;
  // What the calibration may be off by, through columns that are not in the Jacobian, is noise.
  if (measured == moving) return out;
  const CalibrationJacobian D = measured - moving;
  out.R += before_.tilt.alike() * D *
           states.geometry_P.bottomRightCorner<kCalibrationSize, kCalibrationSize>() *
           D.transpose();
  return out;
}

Eigen::Vector3d IntervalFactor::hidden_yaw(const IntrinsicJacobian& J_g_WI,
                                           const CalibrationJacobian& measured,
                                           const Eigen::Vector3d& p_IinO) const {
  const Intrinsics& by_yaw = *interval_.by_yaw;
  if (!hides_turn(J_g_WI, by_yaw, interval_.states.P.diagonal().tail(by_yaw.size()))) {
    return measured.col(kYawColumn);
  }
  return J_g_WI * by_yaw - p_IinO.y() * measured.col(kYawColumn + 1) +
         p_IinO.x() * measured.col(kYawColumn + 2);
}

/// (WO-15): zero where its noise alone explains all of it.
template <class Vector, class Variance>
Vector IntervalFactor::moving_part(const Vector& measured, const Variance& variance) const {
  for (Eigen::Index i = 0; i < measured.size(); ++i) {
    if (!is_noise(measured[i], variance[i], params_.motion_sigmas)) return measured;
  }
  return Vector::Zero();
}

/// Turning and moving of [yaw, x, y], each by itself.
Eigen::Vector3d IntervalFactor::planar_part(const Eigen::Vector3d& g,
                                            const Eigen::Vector3d& variance) const {
  using Turn = Eigen::Matrix<double, 1, 1>;
  Eigen::Vector3d part;
  part << moving_part(Turn(g.head<1>()), variance),
      moving_part(Eigen::Vector2d(g.tail<2>()), variance.tail<2>());
  return part;
}

Point IntervalFactor::moved(const Step& step) const {
  const States& states = interval_.states;
  Eigen::Matrix<double, kGeometrySize, 1> d = Eigen::Matrix<double, kGeometrySize, 1>::Zero();
  for (int k = 0; k < states.n_geometry; ++k) d[states.geometry_at(k)] = step[k];
  Point at = interval_.start;
  at.first.R_GtoI = exp_so3(-d.segment<3>(kFirstTheta)) * at.first.R_GtoI;
  at.first.p_IinG += d.segment<3>(kFirstPosition);
  at.last.R_GtoI = exp_so3(-d.segment<3>(kLastTheta)) * at.last.R_GtoI;
  at.last.p_IinG += d.segment<3>(kLastPosition);
  at.mount.R_ItoO = exp_so3(-d.segment<3>(kMountTheta)) * at.mount.R_ItoO;
  at.mount.p_IinO += d.segment<3>(kMountPosition);
  at.first.after_s += d[kTimeOffset];
  at.last.after_s += d[kTimeOffset];
  if (const auto n = states.n_intrinsics(); n > 0) at.x_WI += step.tail(n);
  return at;
}

double IntervalFactor::tilt_variance(const Point& at) const {
  const Eigen::Matrix<double, 2, kGeometrySize> J = tilt_jacobian(at.first, at.last, at.mount);
  return 0.5 * (J * interval_.states.geometry_P * J.transpose()).trace();
}

void IntervalFactor::add_second_order_noise(const Point& at, Eigen::Matrix3d& R) const {
  const States& states = interval_.states;
  if (states.n_geometry == 0 || states.geometry_at(states.n_geometry - 1) < kMountTheta) return;
  std::array<GeometryMatrix, 3> second;
  for (GeometryMatrix& D : second) D.setZero();
  const PoseJacobian here = relative_pose_jacobian(at.first, at.last, at.mount);
  for (int k = kMountTheta; k < kGeometrySize; ++k) {
    const Point there = stepped(at, k);
    const PoseJacobian change =
        (relative_pose_jacobian(there.first, there.last, there.mount) - here) /
        kSecondDerivativeStep;
    for (int a = 0; a < 3; ++a) {
      GeometryMatrix& D = second[static_cast<std::size_t>(a)];
      D.row(k) = change.row(a);
      D.col(k) = change.row(a).transpose();
    }
  }
  for (GeometryMatrix& D : second) D = (D * states.geometry_P).eval();
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b <= a; ++b) {
      const double trace = second[static_cast<std::size_t>(a)]
                               .cwiseProduct(second[static_cast<std::size_t>(b)].transpose())
                               .sum();
      R(a, b) += 0.5 * trace;
      R(b, a) = R(a, b);
    }
  }
}

}  // namespace viwo::wheel_odometry
