// Differential drive: one or more driven wheels per side, lateral no-slip row at the axle.
// Equations: model.md beside this file.
#include <array>
#include <cmath>

#include "sides.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

struct Params : sides::SideParams {
  double radius_left_m = 0.;
  double radius_right_m = 0.;
  double baseline_m = 0.;
  double prior_sigma_radius_m = 0.0003;
  double prior_sigma_baseline_m = 0.005;
  double sigma_drive_rad_per_s = 0.001;
  double sigma_lateral_m_per_s = 0.001;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(radius_left_m), {.unit = "m",
                                  .above = 0.,
                                  .max = 10.,
                                  .required = true,
                                  .help = "radius of the left wheels"});
    b(VIWO_PARAM(radius_right_m), {.unit = "m",
                                   .above = 0.,
                                   .max = 10.,
                                   .required = true,
                                   .help = "radius of the right wheels"});
    b(VIWO_PARAM(baseline_m), {.unit = "m",
                               .above = 0.,
                               .max = 50.,
                               .required = true,
                               .help = "distance between the left and right contact lines"});
    SideParams::bind(b);
    b(VIWO_PARAM(prior_sigma_radius_m),
      {.unit = "m", .above = 0., .help = "how well the radii are known"});
    b(VIWO_PARAM(prior_sigma_baseline_m),
      {.unit = "m", .above = 0., .help = "how well the baseline is known"});
    b(VIWO_PARAM(sigma_drive_rad_per_s),
      {.unit = "rad/s", .above = 0., .help = "noise of a drive rate, per sample"});
    b(VIWO_PARAM(sigma_lateral_m_per_s),
      {.unit = "m/s", .above = 0., .help = "sideways velocity of the axle, per sample"});
  }
};

class Differential final : public KinematicModel {
 public:
  Differential(const Params& params, const HostServices& /*services*/)
      : params_(params),
        nominal_{params.radius_left_m, params.radius_right_m, params.baseline_m},
        sides_(params) {}

  void describe(ModelDescription& out) const override {
    const int n = n_drive();
    out.n_drive = n;
    out.n_rows = n + 1;
    out.constant_A = true;
    out.intrinsics = {
        {"r_left", "m", nominal_[0], params_.prior_sigma_radius_m, false, sides_.left(), 0.},
        {"r_right", "m", nominal_[1], params_.prior_sigma_radius_m, false, sides_.right(), 0.},
        {"baseline", "m", nominal_[2], params_.prior_sigma_baseline_m, false, {0, n}, 0.}};
    sides_.add_drive_noises(params_.sigma_drive_rad_per_s, out);
    out.noises.push_back(
        {NoiseKind::kSlip, 0, params_.sigma_lateral_m_per_s, {n, 1}, "sigma_lateral_m_per_s"});
  }

  Status rows(const EncoderSample& sample, const Intrinsics& x_WI, bool A_is_current,
              RowSystem& out) const override {
    const int n = n_drive();
    for (int i = 0; i < n; ++i) {
      out.b[i] = x_WI[side(i)] * sample.drive_rad_per_s[sides_.channel(i)];
      if (!A_is_current) out.A.row(i) << 1., 0., sign(i) * 0.5 * x_WI[2];  // (DD-1)
    }
    out.b[n] = 0.;
    if (!A_is_current) out.A.row(n) << 0., 1., 0.;  // (DD-2)
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                             const RowSystem& /*rows*/, const RowVector& b, const Twist& xi,
                             const RowVector& e, IntrinsicDerivatives& out) const override {
    out.DtE.setZero();
    for (int i = 0; i < n_drive(); ++i) {
      out.J(i, side(i)) = b[i] / x_WI[side(i)];  // (DD-3)
      out.J(i, 2) = -0.5 * sign(i) * xi.z();     // (DD-4)
      out.DtE(2, 2) += 0.5 * sign(i) * e[i];     // (DD-6)
    }
  }

  void noise_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                         const RowSystem& /*rows*/, const RowVector& /*b*/, const Twist& /*xi*/,
                         const RowVector& /*e*/, NoiseDerivatives& out) const override {
    const int n = n_drive();
    for (int i = 0; i < n; ++i) out.J(i, i) = x_WI[side(i)];  // (DD-5)
    out.J(n, n) = 1.;
    out.DtE.setZero();
  }

  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                 EncoderSample& sample) const override {
    const int n = n_drive();
    // Whatever sideways motion the slip of the axle does not account for, this base cannot make.
    if (std::abs(xi.y() + slip[n]) > 1e-9 && std::abs(xi.y()) > 1e-9) return Status::kRejected;
    sample.n_drive = n;
    sample.n_steer = 0;
    for (int i = 0; i < n; ++i) {
      const double v = xi.x() + sign(i) * 0.5 * x_WI[2] * xi.z() + slip[i];  // (DD-7)
      sample.drive_rad_per_s[sides_.channel(i)] = v / x_WI[side(i)];
    }
    return Status::kOk;
  }

 private:
  int n_drive() const { return sides_.n_drive(); }
  /// Row i: index of its radius, and the side's sign of the yaw rate.
  int side(int i) const { return sides_.is_left(i) ? 0 : 1; }
  double sign(int i) const { return sides_.is_left(i) ? -1. : 1.; }

  Params params_;
  std::array<double, 3> nominal_;
  sides::Sides sides_;
};

VIWO_REGISTER(KinematicModel, Differential, "differential", "1.0.0",
              "differential drive with lateral no-slip row: two radii and the baseline",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
