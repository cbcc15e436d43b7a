// Skid-steered base: one or more driven wheels (or a track) per side, with the instantaneous
// centres of rotation (ICR) of the sides and of the base. Equations: model.md beside this file.
#include <array>
#include <cmath>

#include "sides.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

struct Params : sides::SideParams {
  double radius_left_m = 0.;
  double radius_right_m = 0.;
  double y_icr_left_m = 0.;
  double y_icr_right_m = 0.;
  double x_icr_m = 0.;
  bool hold_frame = true;
  double prior_sigma_radius_m = 0.003;
  double prior_sigma_icr_m = 0.05;
  double sigma_drive_rad_per_s = 0.001;
  double sigma_slip_m_per_s = 0.001;
  double sigma_lateral_m_per_s = 0.001;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(radius_left_m),
      {.unit = "m",
       .above = 0.,
       .max = 10.,
       .required = true,
       .help = "effective radius of the left side: slip factor times radius"});
    b(VIWO_PARAM(radius_right_m),
      {.unit = "m",
       .above = 0.,
       .max = 10.,
       .required = true,
       .help = "effective radius of the right side: slip factor times radius"});
    b(VIWO_PARAM(y_icr_left_m),
      {.unit = "m",
       .required = true,
       .help = "ICR of the left side along y, left of y_icr_right_m and, on a base that "
               "skids, outside of its contact line"});
    b(VIWO_PARAM(y_icr_right_m),
      {.unit = "m", .required = true, .help = "ICR of the right side along y"});
    b(VIWO_PARAM(x_icr_m),
      {.unit = "m", .help = "ICR of the base along x: the point that does not move sideways"});
    SideParams::bind(b);
    b(VIWO_PARAM(hold_frame),
      {.help = "hold x_icr and y_icr_left, which places O on the base; false: the mounting "
               "of the IMU is known and places it (wheels.sigma_p_IinO_m 0 in x and y)"});
    b(VIWO_PARAM(prior_sigma_radius_m),
      {.unit = "m", .above = 0., .help = "how well the effective radii are known"});
    b(VIWO_PARAM(prior_sigma_icr_m),
      {.unit = "m", .above = 0., .help = "how well each coordinate of an ICR is known"});
    b(VIWO_PARAM(sigma_drive_rad_per_s),
      {.unit = "rad/s", .above = 0., .help = "noise of a drive rate, per sample"});
    b(VIWO_PARAM(sigma_slip_m_per_s),
      {.unit = "m/s",
       .above = 0.,
       .help = "what a side slips along besides its slip factor, per sample"});
    b(VIWO_PARAM(sigma_lateral_m_per_s),
      {.unit = "m/s", .above = 0., .help = "sideways velocity of the ICR of the base, per sample"});
  }
  const Params& checked() const {
    if (!(y_icr_left_m > y_icr_right_m)) {
      throw ParamError("y_icr_left_m", "must be greater than y_icr_right_m: y is to the left");
    }
    return *this;
  }
};

class SkidSteer final : public KinematicModel {
 public:
  SkidSteer(const Params& params, const HostServices& /*services*/)
      : params_(params.checked()),
        nominal_{params.radius_left_m, params.radius_right_m, params.y_icr_left_m,
                 params.y_icr_right_m, params.x_icr_m},
        sides_(params) {}

  void describe(ModelDescription& out) const override {
    const int n = n_drive();
    const RowRange left = sides_.left(), right = sides_.right();
    out.n_drive = n;
    out.n_rows = n + 1;
    out.constant_A = true;
    out.intrinsics = {
        {"r_left", "m", nominal_[kRLeft], params_.prior_sigma_radius_m, false, left, 0.},
        {"r_right", "m", nominal_[kRRight], params_.prior_sigma_radius_m, false, right, 0.},
        {"y_icr_left", "m", nominal_[kYLeft], params_.prior_sigma_icr_m, params_.hold_frame,
         left},  // (K-7)
        {"y_icr_right", "m", nominal_[kYRight], params_.prior_sigma_icr_m, false, right},
        {"x_icr", "m", nominal_[kX], params_.prior_sigma_icr_m, params_.hold_frame, {n, 1}}};
    sides_.add_drive_noises(params_.sigma_drive_rad_per_s, out);
    for (int i = 0; i < n; ++i) {
      const int channel = static_cast<int>(sides_.channel(i));
      out.noises.push_back(
          {NoiseKind::kSlip, channel, params_.sigma_slip_m_per_s, {i, 1}, "sigma_slip_m_per_s"});
    }
    out.noises.push_back(
        {NoiseKind::kSlip, n, params_.sigma_lateral_m_per_s, {n, 1}, "sigma_lateral_m_per_s"});
  }

  Status rows(const EncoderSample& sample, const Intrinsics& x_WI, bool A_is_current,
              RowSystem& out) const override {
    const int n = n_drive();
    for (int i = 0; i < n; ++i) {
      out.b[i] = x_WI[r(i)] * sample.drive_rad_per_s[sides_.channel(i)];
      if (!A_is_current) out.A.row(i) << 1., 0., -x_WI[y(i)];  // (K-1)
    }
    out.b[n] = 0.;
    if (!A_is_current) out.A.row(n) << 0., 1., x_WI[kX];  // (K-2)
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                             const RowSystem& /*rows*/, const RowVector& b, const Twist& xi,
                             const RowVector& e, IntrinsicDerivatives& out) const override {
    const int n = n_drive();
    out.DtE.setZero();
    for (int i = 0; i < n; ++i) {
      out.J(i, r(i)) = b[i] / x_WI[r(i)];  // (K-3)
      out.J(i, y(i)) = xi.z();             // (K-4)
      out.DtE(2, y(i)) -= e[i];            // (K-5)
    }
    out.J(n, kX) = -xi.z();
    out.DtE(2, kX) = e[n];
  }

  void noise_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                         const RowSystem& /*rows*/, const RowVector& /*b*/, const Twist& /*xi*/,
                         const RowVector& /*e*/, NoiseDerivatives& out) const override {
    const int n = n_drive();
    for (int i = 0; i < n; ++i) {
      out.J(i, i) = x_WI[r(i)];  // (K-6)
      out.J(i, n + i) = 1.;
    }
    out.J(n, 2 * n) = 1.;
    out.DtE.setZero();
  }

  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                 EncoderSample& sample) const override {
    const int n = n_drive();
    // Sideways its ICR moves by slip alone; this base can make no other motion.
    const double sideways = xi.y() + x_WI[kX] * xi.z();
    if (std::abs(sideways + slip[n]) > 1e-9 && std::abs(sideways) > 1e-9) return Status::kRejected;
    sample.n_drive = n;
    sample.n_steer = 0;
    for (int i = 0; i < n; ++i) {
      const double v = xi.x() - x_WI[y(i)] * xi.z() + slip[i];  // (K-8)
      sample.drive_rad_per_s[sides_.channel(i)] = v / x_WI[r(i)];
    }
    return Status::kOk;
  }

  Status move_frame(const Eigen::Vector3d& g, Intrinsics& x_WI) const override {
    // The rolling rows have no sideways part: they hold the direction of x. With nothing held the
    // mounting places O, not this model.
    if (!params_.hold_frame || g[0] != 0.) return Status::kUnsupported;
    x_WI[kX] -= g[1];  // (K-7)
    x_WI[kYLeft] -= g[2];
    x_WI[kYRight] -= g[2];
    return Status::kOk;
  }

 private:
  static constexpr int kRLeft = 0, kRRight = 1, kYLeft = 2, kYRight = 3, kX = 4;

  int n_drive() const { return sides_.n_drive(); }
  /// Of row i: indices of its radius and of its ICR.
  int r(int i) const { return sides_.is_left(i) ? kRLeft : kRRight; }
  int y(int i) const { return sides_.is_left(i) ? kYLeft : kYRight; }

  Params params_;
  std::array<double, 5> nominal_;
  sides::Sides sides_;
};

VIWO_REGISTER(KinematicModel, SkidSteer, "skid_steer", "1.0.0",
              "skid-steered base: effective radii and centres of rotation of its sides",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
