// IMU propagation: mean, transition and noise of the inertial state between two instants.
// Equations: docs/math/filter.md.
#pragma once

#include <span>

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"

namespace viwo {

using ImuMatrix = Eigen::Matrix<double, kImuSize, kImuSize>;
using ImuVector = Eigen::Matrix<double, kImuSize, 1>;

/// The error that moves `from` to `to`, in the order of the columns of the inertial state.
ImuVector difference(const ImuState& to, const ImuState& from);
/// Moves it by such an error: R = Exp(-dtheta) R_hat, the rest adds. First estimates stay.
void retract(const ImuVector& dx, ImuState& imu);

/// The reading at `t_ns` on the straight line between two others.
ImuSample interpolate(const ImuSample& before, const ImuSample& after, std::int64_t t_ns);

/// Transition Phi and noise Q of the inertial error state over an interval:
/// P <- Phi P Phi^T + Q.
struct ImuTransition {
  ImuMatrix Phi;
  ImuMatrix Q;
};

/// Moves `imu` over the samples, from the stamp of the first to that of the last (F-1, F-2), and
/// returns the transition (F-3 .. F-5). Readings are taken as linear between samples. Phi is taken
/// between the first estimates at the start (imu.*_fej) and the new estimate (F-6), which becomes
/// the first estimate of what follows. With fewer than two samples nothing moves. `gaps_s`: for
/// each sample the length of the gap that it ends or lies in, where the line between samples is a
/// guess (F-27); empty: there is none.
ImuTransition propagate(std::span<const ImuSample> samples, const ImuNoise& noise,
                        double gravity_m_per_s2, ImuState& imu,
                        std::span<const double> gaps_s = {});

}  // namespace viwo
