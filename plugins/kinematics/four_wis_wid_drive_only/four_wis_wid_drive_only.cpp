// Reduced model of a base with N >= 2 steered and driven wheels: the rolling row of every wheel
// only. Equations: model.md beside this file.
#include <cmath>

#include "swerve_base.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

struct Params : swerve::Params {
  enum class OffsetDerivative { kPredicted, kMeasured };
  OffsetDerivative offset_derivative = OffsetDerivative::kPredicted;

  void bind(ParamBinder& b) {
    swerve::Params::bind(b);
    b(VIWO_PARAM(offset_derivative),
      {{"predicted", OffsetDerivative::kPredicted}, {"measured", OffsetDerivative::kMeasured}},
      {.help = "at the signal that the twist predicts, the derivative by a steering offset is "
               "taken where the wheel points as the twist predicts (zero: rolling rows do not "
               "tell offsets), or as it was read"});
  }
};

class FourWisWidDriveOnly final : public swerve::SwerveBase {
 public:
  FourWisWidDriveOnly(const Params& params, const HostServices& /*services*/)
      : SwerveBase(params),
        points_as_predicted_(params.offset_derivative == Params::OffsetDerivative::kPredicted) {}

  void describe(ModelDescription& out) const override {
    describe_wheels(swerve::RowsPerWheel::kDriveOnly, out);
  }

  Status rows(const EncoderSample& sample, const Intrinsics& x_WI, bool /*A_is_current*/,
              RowSystem& out) const override {
    for (int j = 0; j < n(); ++j) {
      const auto channel = static_cast<std::size_t>(j);
      const double delta_j = delta(sample, x_WI, j);
      const double c = std::cos(delta_j);
      const double s = std::sin(delta_j);
      out.A.row(j) << c, s, x_WI[x(j)] * s - x_WI[y(j)] * c;  // (D-1)
      out.b[j] = x_WI[r(j)] * sample.drive_rad_per_s[channel];
      out.kept[channel] = x_WI[x(j)] * c + x_WI[y(j)] * s;  // third entry of dA/d delta (D-2)
    }
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample& sample, const Intrinsics& x_WI,
                             const RowSystem& rows, const RowVector& b, const Twist& xi,
                             const RowVector& e, IntrinsicDerivatives& out) const override {
    // A wheel that had measured what the twist predicts would point along its contact velocity: at
    // the fitted signal nothing moves with the offset (D-8). The measured direction would leave
    // v n_delta there, noise, and with it information about offsets that rolling rows do not have.
    const bool no_slip = points_as_predicted_ && &b != &rows.b;
    for (int j = 0; j < n(); ++j) {
      const double c = rows.A(j, 0);
      const double s = rows.A(j, 1);
      const Eigen::Vector3d turned = turned_row(rows, j);
      out.J(j, r(j)) = b[j] / x_WI[r(j)];  // (D-3)
      out.J(j, x(j)) = -xi.z() * s;        // (D-4)
      out.J(j, y(j)) = xi.z() * c;
      out.J(j, delta_o(j)) = no_slip ? 0. : turned.dot(xi);  // (D-5)
      out.DtE.col(r(j)).setZero();                           // (D-7)
      out.DtE.col(x(j)) << 0., 0., s * e[j];
      out.DtE.col(y(j)) << 0., 0., -c * e[j];
      out.DtE.col(delta_o(j)) = -turned * e[j];
      if (has_gains()) {
        const double read = sample.steer_rad[static_cast<std::size_t>(j)];
        out.J(j, kappa(j)) = -read * out.J(j, delta_o(j));  // (D-9)
        out.DtE.col(kappa(j)) = -read * out.DtE.col(delta_o(j));
      }
    }
  }

  void noise_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                         const RowSystem& rows, const RowVector& /*b*/, const Twist& xi,
                         const RowVector& e, NoiseDerivatives& out) const override {
    for (int j = 0; j < n(); ++j) {
      const Eigen::Vector3d turned = turned_row(rows, j);
      out.J(j, j) = x_WI[r(j)];  // (D-6) drive
      out.DtE.col(j).setZero();
      out.J(j, n() + j) = -gain(x_WI, j) * turned.dot(xi);  // steering
      out.DtE.col(n() + j) = gain(x_WI, j) * turned * e[j];
    }
  }

 protected:
  Eigen::Vector2d contact_slip(const RowVector& /*slip*/, int /*j*/) const override {
    return Eigen::Vector2d::Zero();  // the rows know of no slip
  }

 private:
  bool points_as_predicted_;

  /// dA_j/d delta_j (D-2): the rolling row turned by a quarter.
  static Eigen::Vector3d turned_row(const RowSystem& rows, int j) {
    return {-rows.A(j, 1), rows.A(j, 0), rows.kept[static_cast<std::size_t>(j)]};
  }
};

VIWO_REGISTER(KinematicModel, FourWisWidDriveOnly, "four_wis_wid_drive_only", "1.0.0",
              "N >= 2 steered and driven wheels (swerve), rolling rows only", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
