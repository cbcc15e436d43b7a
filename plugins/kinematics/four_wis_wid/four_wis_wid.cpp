// Redundant model of a base with N >= 2 steered and driven wheels: rolling and no-slip rows of
// every wheel, written in O, where A is constant. Equations: model.md beside this file.
#include <cmath>

#include "swerve_base.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

class FourWisWid final : public swerve::SwerveBase {
 public:
  FourWisWid(const swerve::Params& params, const HostServices& /*services*/) : SwerveBase(params) {}

  void describe(ModelDescription& out) const override {
    describe_wheels(swerve::RowsPerWheel::kDriveAndLateral, out);
    out.constant_A = true;  // (S-10)
  }

  Status rows(const EncoderSample& sample, const Intrinsics& x_WI, bool A_is_current,
              RowSystem& out) const override {
    for (int j = 0; j < n(); ++j) {
      const auto channel = static_cast<std::size_t>(j);
      const double delta_j = delta(sample, x_WI, j);  // (S-1)
      const double v = x_WI[r(j)] * sample.drive_rad_per_s[channel];
      const double c = std::cos(delta_j);
      const double s = std::sin(delta_j);
      out.b[2 * j] = v * c;  // (S-2)
      out.b[2 * j + 1] = v * s;
      out.kept[2 * channel] = c;
      out.kept[2 * channel + 1] = s;
      if (!A_is_current) {
        out.A.row(2 * j) << 1., 0., -x_WI[y(j)];  // (S-3)
        out.A.row(2 * j + 1) << 0., 1., x_WI[x(j)];
      }
    }
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample& sample, const Intrinsics& x_WI,
                             const RowSystem& /*rows*/, const RowVector& b, const Twist& xi,
                             const RowVector& e, IntrinsicDerivatives& out) const override {
    const double omega = xi.z();
    for (int j = 0; j < n(); ++j) {
      const int i = 2 * j;
      const double per_r = 1. / x_WI[r(j)];
      out.J(i, r(j)) = b[i] * per_r;  // (S-4)
      out.J(i + 1, r(j)) = b[i + 1] * per_r;
      out.J(i + 1, x(j)) = -omega;  // (S-5)
      out.J(i, y(j)) = omega;
      out.J(i, delta_o(j)) = b[i + 1];  // (S-6)
      out.J(i + 1, delta_o(j)) = -b[i];
      if (has_gains()) {
        const double read = sample.steer_rad[static_cast<std::size_t>(j)];
        out.J(i, kappa(j)) = -read * b[i + 1];  // (S-12)
        out.J(i + 1, kappa(j)) = read * b[i];
      }
      out.DtE(2, x(j)) = e[i + 1];  // (S-7)
      out.DtE(2, y(j)) = -e[i];
    }
  }

  void noise_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                         const RowSystem& rows, const RowVector& b, const Twist& /*xi*/,
                         const RowVector& /*e*/, NoiseDerivatives& out) const override {
    for (int j = 0; j < n(); ++j) {
      const int i = 2 * j;
      const auto k = static_cast<std::size_t>(i);
      const double c = rows.kept[k];
      const double s = rows.kept[k + 1];
      out.J(i, j) = x_WI[r(j)] * c;  // (S-8) drive
      out.J(i + 1, j) = x_WI[r(j)] * s;
      out.J(i, n() + j) = -gain(x_WI, j) * b[i + 1];  // steering
      out.J(i + 1, n() + j) = gain(x_WI, j) * b[i];
      out.J(i, 2 * n() + j) = -s;  // lateral slip
      out.J(i + 1, 2 * n() + j) = c;
    }
  }

 protected:
  Eigen::Vector2d contact_slip(const RowVector& slip, int j) const override {
    // (S-9): b - A xi = slip with b the velocity that the encoders tell.
    return slip.segment<2>(2 * j);
  }
};

VIWO_REGISTER(KinematicModel, FourWisWid, "four_wis_wid", "1.0.0",
              "N >= 2 steered and driven wheels (swerve), rolling and lateral no-slip rows",
              "Apache-2.0", swerve::Params);

}  // namespace
}  // namespace viwo
