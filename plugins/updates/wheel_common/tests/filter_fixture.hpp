// A filter small enough to see through: views for updates, the boxplus of its states, and the
// textbook application of factors; and a robot that drives on a tilted plane.
#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "viwo/api/update.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/plugin_host/registry.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "wheel_fixture.hpp"

namespace viwo::testing {

inline std::shared_ptr<Update> load_update(const std::string& yaml) {
  static PluginRegistry registry({VIWO_TEST_PLUGIN_DIR});
  config::Errors errors;
  const auto loaded = registry.make_update(config::parse(yaml, "test"), "updates", errors);
  errors.throw_if_any();
  return loaded.object;
}

/// States: inertial (15), clones (6 each), then of the wheels extrinsics (6), time offset (1) and
/// intrinsics.
struct SmallFilter {
  ImuView imu;
  std::vector<CloneView> clones;
  WheelsView wheels;
  Eigen::MatrixXd P;
  bool has_wheels = true;

  /// Sets the columns; P is zero where it grows.
  void layout() {
    int column = kImuSize;
    for (CloneView& clone : clones) {
      clone.column = column;
      column += kPoseSize;
    }
    wheels.extrinsics_column = column;
    wheels.time_offset_column = column + kPoseSize;
    wheels.intrinsics_column = column + kPoseSize + 1;
    const auto size = wheels.intrinsics_column + wheels.x_WI.size();
    if (P.rows() != size) P = Eigen::MatrixXd::Zero(size, size);
  }

  FilterView view() const {
    FilterView view;
    view.imu = imu;
    view.clones = clones;
    view.wheels = has_wheels ? &wheels : nullptr;
    view.size = static_cast<int>(P.rows());
    view.covariance_data = P.data();
    view.covariance_stride = static_cast<int>(P.rows());
    return view;
  }

  void plus(const Eigen::VectorXd& d) {
    const auto rotate = [&](Eigen::Matrix3d& R, int column) {
      R = exp_so3(-d.segment<3>(column)) * R;
    };
    rotate(imu.R_GtoI, kThetaColumn);
    imu.p_IinG += d.segment<3>(kPositionColumn);
    imu.v_IinG += d.segment<3>(kVelocityColumn);
    imu.gyro_bias += d.segment<3>(kGyroBiasColumn);
    imu.accel_bias += d.segment<3>(kAccelBiasColumn);
    for (CloneView& clone : clones) {
      rotate(clone.R_GtoI, clone.column);
      clone.p_IinG += d.segment<3>(clone.column + 3);
    }
    rotate(wheels.R_ItoO, wheels.extrinsics_column);
    wheels.p_IinO += d.segment<3>(wheels.extrinsics_column + 3);
    wheels.t_OtoI_s += d[wheels.time_offset_column];
    wheels.x_WI += d.tail(wheels.x_WI.size());
  }

  /// First estimates = estimates.
  void first_estimates() {
    imu.R_GtoI_fej = imu.R_GtoI;
    imu.p_IinG_fej = imu.p_IinG;
    imu.v_IinG_fej = imu.v_IinG;
    for (CloneView& clone : clones) {
      clone.R_GtoI_fej = clone.R_GtoI;
      clone.p_IinG_fej = clone.p_IinG;
    }
  }

  static Eigen::MatrixXd spread(const FactorColumns& columns, const Eigen::MatrixXd& H,
                                Eigen::Index size) {
    Eigen::MatrixXd full = Eigen::MatrixXd::Zero(H.rows(), size);
    int from = 0;
    for (const ColumnRange block : columns.blocks()) {
      full.middleCols(block.first, block.count) = H.middleCols(from, block.count);
      from += block.count;
    }
    return full;
  }

  /// Updates with all factors; returns the chi-square of the residual factors.
  double apply(const FactorSink& sink) {
    double chi2 = 0.;
    Eigen::VectorXd dx = Eigen::VectorXd::Zero(P.rows());
    for (const ResidualFactor& factor : sink.residuals()) {
      const Eigen::MatrixXd H = spread(factor.columns, factor.H, P.rows());
      const Eigen::MatrixXd S = H * P * H.transpose() + factor.R;
      const Eigen::VectorXd r = factor.residual - H * dx;
      chi2 += r.dot(S.llt().solve(r));
      const Eigen::MatrixXd K = S.llt().solve(H * P).transpose();
      dx += K * r;
      const Eigen::MatrixXd I_KH = Eigen::MatrixXd::Identity(P.rows(), P.rows()) - K * H;
      P = (I_KH * P * I_KH.transpose() + K * factor.R * K.transpose()).eval();
    }
    if (const InformationFactor* factor = sink.information()) {
      const int n = factor->columns.size();
      const Eigen::MatrixXd lower = factor->Lambda.topLeftCorner(n, n);
      const Eigen::MatrixXd symmetric = lower.selfadjointView<Eigen::Lower>();
      const Eigen::MatrixXd E = spread(factor->columns, Eigen::MatrixXd::Identity(n, n), P.rows());
      const Eigen::MatrixXd Lambda = E.transpose() * symmetric * E;
      const Eigen::VectorXd eta = E.transpose() * (factor->eta.head(n) - symmetric * E * dx);
      const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(P.rows(), P.rows()) + P * Lambda;
      P = M.partialPivLu().solve(P).eval();
      P = (0.5 * (P + P.transpose())).eval();
      dx += P * eta;
    }
    plus(dx);
    return chi2;
  }
};

/// The true state of a base whose odometry frame moves over a tilted plane.
struct TiltedDrive {
  Eigen::Matrix3d R_GtoW = exp_so3({0.2, -0.3, 0.7});  ///< W: the plane, z up from it
  Eigen::Vector3d p_WinG{1., -2., 0.5};
  Eigen::Matrix3d R_ItoO = exp_so3({0.1, -0.2, 2.3});
  Eigen::Vector3d p_IinO{0.08, -0.05, 0.12};

  /// The clone for the planar pose g = [yaw, x, y] of O in W and the twist of O.
  CloneView clone(std::int64_t t_ns, int slot, const Eigen::Vector3d& g, const Twist& xi) const {
    const Eigen::Matrix3d R_WtoO = exp_so3({0., 0., -g[0]});
    const Eigen::Matrix3d R_GtoO = R_WtoO * R_GtoW;
    CloneView clone;
    clone.t_ns = t_ns;
    clone.slot = slot;
    clone.R_GtoI = R_ItoO.transpose() * R_GtoO;
    clone.p_IinG =
        p_WinG + R_GtoW.transpose() * Eigen::Vector3d(g[1], g[2], 0.) + R_GtoO.transpose() * p_IinO;
    const Eigen::Vector3d omega(0., 0., xi[2]);
    clone.w_IinI = R_ItoO.transpose() * omega;
    clone.v_IinG = R_GtoO.transpose() * (Eigen::Vector3d(xi[0], xi[1], 0.) + omega.cross(p_IinO));
    clone.R_GtoI_fej = clone.R_GtoI;
    clone.p_IinG_fej = clone.p_IinG;
    return clone;
  }
};

inline Eigen::VectorXd gaussian(int n, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss;
  Eigen::VectorXd v(n);
  for (int i = 0; i < n; ++i) v[i] = gauss(rng);
  return v;
}

}  // namespace viwo::testing
