// A base with two steered and driven wheels, for the tests of the simulator: written on its own, as
// a third party would.
#pragma once

#include <array>
#include <cmath>

#include <Eigen/Core>

#include "viwo/api/kinematic_model.hpp"

namespace viwo::sim {

/// Row pair j: R(delta_j)^T (v + omega J p_j) = [r_j omega_j, slip_j]^T with delta_j = y_j - o_j.
/// Intrinsics [r_1, r_2, o_1, o_2]. Slip sources are left out for sigma_slip = 0.
class TwoWheels : public KinematicModel {
 public:
  double sigma_drive = 0.02;
  double sigma_steer = 0.003;
  double sigma_slip = 0.005;
  bool own_inverse = false;
  bool can_crab = true;  ///< own_inverse refuses sideways motion otherwise

  void describe(ModelDescription& out) const override {
    out.n_drive = 2;
    out.n_steer = 2;
    out.n_rows = 4;
    for (int j = 0; j < 2; ++j)
      out.noises.push_back({NoiseKind::kDrive, j, sigma_drive, {2 * j, 1}});
    for (int j = 0; j < 2; ++j)
      out.noises.push_back({NoiseKind::kSteer, j, sigma_steer, {2 * j, 2}});
    for (int j = 0; j < 2 && sigma_slip > 0.; ++j) {
      out.noises.push_back({NoiseKind::kSlip, j, sigma_slip, {2 * j + 1, 1}});
    }
    out.intrinsics = {{"r_1", "m", 0.05, 0.001, false, {0, 1}},
                      {"r_2", "m", 0.06, 0.002, false, {2, 1}},
                      {"o_1", "rad", 0.1, 0.01, true, {0, 2}},
                      {"o_2", "rad", -0.2, 0.02, false, {2, 2}}};
  }

  Status rows(const EncoderSample& y, const Intrinsics& x_WI, bool, RowSystem& out) const override {
    for (int j = 0; j < 2; ++j) {
      const auto i = static_cast<std::size_t>(j);
      const double c = std::cos(y.steer_rad[i] - x_WI[2 + j]);
      const double s = std::sin(y.steer_rad[i] - x_WI[2 + j]);
      const double px = kPositions[i][0], py = kPositions[i][1];
      out.A.row(2 * j) << c, s, -c * py + s * px;
      out.A.row(2 * j + 1) << -s, c, s * py + c * px;
      out.b[2 * j] = x_WI[j] * y.drive_rad_per_s[i];
      out.b[2 * j + 1] = 0.;
    }
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample&, const Intrinsics&, const RowSystem&,
                             const RowVector&, const Twist&, const RowVector&,
                             IntrinsicDerivatives&) const override {}

  void noise_derivatives(const EncoderSample&, const Intrinsics& x_WI, const RowSystem& rows,
                         const RowVector&, const Twist& xi, const RowVector&,
                         NoiseDerivatives& out) const override {
    for (int j = 0; j < 2; ++j) {
      out.J(2 * j, j) = x_WI[j];
      // Turning the wheel frame swaps the components of the contact velocity.
      out.J(2 * j, 2 + j) = -rows.A.row(2 * j + 1).dot(xi);
      out.J(2 * j + 1, 2 + j) = rows.A.row(2 * j).dot(xi);
      if (sigma_slip > 0.) out.J(2 * j + 1, 4 + j) = 1.;
    }
  }

  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                 EncoderSample& y) const override {
    if (!own_inverse) return Status::kUnsupported;
    if (!can_crab && std::abs(xi[1]) > 1e-9) return Status::kRejected;
    for (int j = 0; j < 2; ++j) {
      const auto i = static_cast<std::size_t>(j);
      const Eigen::Vector2d u(xi[0] - kPositions[i][1] * xi[2], xi[1] + kPositions[i][0] * xi[2]);
      const double lateral = slip[2 * j + 1];
      if (u.norm() < std::abs(lateral)) return Status::kRejected;
      if (u.norm() < 1e-12) {
        y.drive_rad_per_s[i] = slip[2 * j] / x_WI[j];
        continue;
      }
      // b - A xi = slip in the lateral row: the contact moves by -slip sideways in the wheel frame.
      const double inside = std::asin(-lateral / u.norm());
      y.steer_rad[i] = std::atan2(u[1], u[0]) - inside + x_WI[2 + j];
      y.drive_rad_per_s[i] = (u.norm() * std::cos(inside) + slip[2 * j]) / x_WI[j];
    }
    return Status::kOk;
  }

 private:
  static constexpr std::array<std::array<double, 2>, 2> kPositions = {{{0.2, 0.}, {-0.2, 0.1}}};
};

}  // namespace viwo::sim
