#include "viwo/filter/propagation.hpp"

#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// How a robot turns and accelerates while nothing is measured, off the line between the readings
/// around the gap.
constexpr double kGapGyroRadPerS = 0.5;
constexpr double kGapAccelMPerS2 = 2.;

/// One step between two samples, in an error state whose orientation error is in G
/// (phi = R_ItoG dtheta): there the orientation's own transition is the identity (F-3, F-4).
struct Step {
  double dt;
  Matrix3d R_bg;  // d phi = -R_bg dbg
  Matrix3d R_ba;  // d v = -R_ba dba
  Matrix3d S_v;   // d v = -S_v phi
  Matrix3d S_p;   // d p = dt v - S_p phi

  /// M <- Phi_step M.
  void apply(ImuMatrix& M) const {
    const auto phi = M.middleRows<3>(kThetaColumn);
    const auto bg = M.middleRows<3>(kGyroBiasColumn);
    const auto ba = M.middleRows<3>(kAccelBiasColumn);
    // What the biases do to v and p through phi (and v) within the step is the mean effect: half
    // and a third of the step.
    const Eigen::Matrix<double, 3, kImuSize> d_phi = R_bg * bg;
    const Eigen::Matrix<double, 3, kImuSize> d_v = S_v * (phi - 0.5 * d_phi) + R_ba * ba;
    const Eigen::Matrix<double, 3, kImuSize> d_p =
        S_p * (phi - d_phi / 3.) + (0.5 * dt) * (R_ba * ba);
    M.middleRows<3>(kPositionColumn) += dt * M.middleRows<3>(kVelocityColumn) - d_p;
    M.middleRows<3>(kVelocityColumn) -= d_v;
    M.middleRows<3>(kThetaColumn) -= d_phi;
  }

  /// Q <- Phi_step Q Phi_step^T + Q_step (F-5).
  void add_noise(const ImuNoise& noise, double gap_s, ImuMatrix& Q) const {
    apply(Q);
    Q.transposeInPlace();
    apply(Q);
    const auto squared = [](double sigma) { return sigma * sigma; };
    // (F-27): white noise that over the whole gap is as much as an error that lasts.
    const double gyro =
        (squared(noise.gyro_rad_per_s_sqrt_hz) + squared(kGapGyroRadPerS) * gap_s) * dt;
    const double accel =
        (squared(noise.accel_m_per_s2_sqrt_hz) + squared(kGapAccelMPerS2) * gap_s) * dt;
    // White noise is isotropic: the rotation that turns it into G leaves its covariance alone.
    Q.diagonal().segment<3>(kThetaColumn).array() += gyro;
    Q.diagonal().segment<3>(kVelocityColumn).array() += accel;
    Q.diagonal().segment<3>(kPositionColumn).array() += accel * dt * dt / 3.;
    for (int i = 0; i < 3; ++i) {
      Q(kPositionColumn + i, kVelocityColumn + i) += 0.5 * accel * dt;
      Q(kVelocityColumn + i, kPositionColumn + i) += 0.5 * accel * dt;
    }
    const Matrix3d phi_v = (0.5 * gyro) * S_v;  // E[phi v^T] = -(-S_v)^T .. = S_v for skew S_v
    Q.block<3, 3>(kThetaColumn, kVelocityColumn) += phi_v;
    Q.block<3, 3>(kVelocityColumn, kThetaColumn) += phi_v.transpose();
    Q.block<3, 3>(kVelocityColumn, kVelocityColumn) -= (gyro / 3.) * S_v * S_v;
    Q.diagonal().segment<3>(kGyroBiasColumn).array() +=
        squared(noise.gyro_walk_rad_per_s2_sqrt_hz) * dt;
    Q.diagonal().segment<3>(kAccelBiasColumn).array() +=
        squared(noise.accel_walk_m_per_s3_sqrt_hz) * dt;
  }
};

/// Moves the mean over one step (F-1, F-2) and describes the step for the errors.
Step integrate(const ImuSample& from, const ImuSample& to, double gravity, ImuState& imu) {
  const double dt = seconds_between(from.t_ns, to.t_ns);
  const Vector3d w0 = to_vector(from.gyro_rad_per_s) - imu.gyro_bias;
  const Vector3d w1 = to_vector(to.gyro_rad_per_s) - imu.gyro_bias;
  const Vector3d a0 = to_vector(from.accel_m_per_s2) - imu.accel_bias;
  const Vector3d a1 = to_vector(to.accel_m_per_s2) - imu.accel_bias;
  // Fourth-order Magnus expansion for a rate that is linear in time.
  const Vector3d half_turn = dt * (0.375 * w0 + 0.125 * w1) + (dt * dt / 48.) * w0.cross(w1);
  const Vector3d turn = 0.5 * dt * (w0 + w1) + (dt * dt / 12.) * w0.cross(w1);
  const Matrix3d R0 = imu.R_GtoI.transpose();  // R_ItoG at the start, in the middle, at the end
  const Matrix3d Rm = R0 * exp_so3(half_turn);
  const Matrix3d R1 = R0 * exp_so3(turn);
  // Simpson's rule for the integral of the specific force in G, and for its double integral.
  const Vector3d f0 = R0 * a0, fm = Rm * (0.5 * (a0 + a1)), f1 = R1 * a1;
  const Vector3d dv = dt / 6. * (f0 + 4. * fm + f1);
  const Vector3d dp = dt * dt / 6. * (f0 + 2. * fm);
  const Vector3d g(0., 0., -gravity);
  imu.p_IinG += dt * imu.v_IinG + dp + 0.5 * dt * dt * g;
  imu.v_IinG += dv + dt * g;
  imu.R_GtoI = R1.transpose();
  const Matrix3d R_mean = dt / 6. * (R0 + 4. * Rm + R1);
  return {dt, R_mean, R_mean, skew(dv), skew(dp)};
}

}  // namespace

ImuVector difference(const ImuState& to, const ImuState& from) {
  ImuVector dx;
  dx << -log_so3(to.R_GtoI * from.R_GtoI.transpose()), to.p_IinG - from.p_IinG,
      to.v_IinG - from.v_IinG, to.gyro_bias - from.gyro_bias, to.accel_bias - from.accel_bias;
  return dx;
}

void retract(const ImuVector& dx, ImuState& imu) {
  imu.R_GtoI = normalized_rotation(exp_so3(-dx.segment<3>(kThetaColumn)) * imu.R_GtoI);
  imu.p_IinG += dx.segment<3>(kPositionColumn);
  imu.v_IinG += dx.segment<3>(kVelocityColumn);
  imu.gyro_bias += dx.segment<3>(kGyroBiasColumn);
  imu.accel_bias += dx.segment<3>(kAccelBiasColumn);
}

ImuSample interpolate(const ImuSample& before, const ImuSample& after, std::int64_t t_ns) {
  const double ratio =
      seconds_between(before.t_ns, t_ns) / seconds_between(before.t_ns, after.t_ns);
  ImuSample sample;
  sample.t_ns = t_ns;
  for (std::size_t i = 0; i < 3; ++i) {
    sample.gyro_rad_per_s[i] =
        before.gyro_rad_per_s[i] + ratio * (after.gyro_rad_per_s[i] - before.gyro_rad_per_s[i]);
    sample.accel_m_per_s2[i] =
        before.accel_m_per_s2[i] + ratio * (after.accel_m_per_s2[i] - before.accel_m_per_s2[i]);
  }
  return sample;
}

ImuTransition propagate(std::span<const ImuSample> samples, const ImuNoise& noise,
                        double gravity_m_per_s2, ImuState& imu, std::span<const double> gaps_s) {
  ImuTransition transition{ImuMatrix::Identity(), ImuMatrix::Zero()};
  if (samples.size() < 2) return transition;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const Step step = integrate(samples[i - 1], samples[i], gravity_m_per_s2, imu);
    step.apply(transition.Phi);
    step.add_noise(noise, gaps_s.empty() ? 0. : gaps_s[i], transition.Q);
  }
  imu.R_GtoI = normalized_rotation(imu.R_GtoI);

  // Between first estimates (F-6), still with the orientation error in G.
  ImuMatrix& Phi = transition.Phi;
  const double T = seconds_between(samples.front().t_ns, samples.back().t_ns);
  const Vector3d g(0., 0., -gravity_m_per_s2);
  Phi.block<3, 3>(kVelocityColumn, kThetaColumn) = -skew(imu.v_IinG - imu.v_IinG_fej - T * g);
  Phi.block<3, 3>(kPositionColumn, kThetaColumn) =
      -skew(imu.p_IinG - imu.p_IinG_fej - T * imu.v_IinG_fej - 0.5 * T * T * g);
  // Orientation errors back into I: phi = R_ItoG dtheta, at the start and at the end.
  Phi.leftCols<3>() = (Phi.leftCols<3>() * imu.R_GtoI_fej.transpose()).eval();
  Phi.topRows<3>() = (imu.R_GtoI * Phi.topRows<3>()).eval();
  ImuMatrix& Q = transition.Q;
  Q.topRows<3>() = (imu.R_GtoI * Q.topRows<3>()).eval();
  Q.leftCols<3>() = (Q.leftCols<3>() * imu.R_GtoI.transpose()).eval();

  imu.R_GtoI_fej = imu.R_GtoI;
  imu.p_IinG_fej = imu.p_IinG;
  imu.v_IinG_fej = imu.v_IinG;
  return transition;
}

}  // namespace viwo
