// A base that gives its twist instead of its wheels. Equations: model.md beside this file.
#include <cmath>
#include <cstddef>

#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

struct Params {
  bool sideways = false;
  double scale_v = 1.;
  double scale_omega = 1.;
  double turn_rad_per_m = 0.;
  double prior_sigma_scale_v = 0.03;
  double prior_sigma_scale_omega = 0.1;
  double prior_sigma_turn_rad_per_m = 0.01;
  double sigma_v_m_per_s = 0.05;
  double sigma_omega_rad_per_s = 0.05;
  double sigma_lateral_m_per_s = 0.05;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(sideways),
      {.help =
           "drives are v_x, v_y and omega, as of a base that moves sideways; or v_x and omega"});
    b(VIWO_PARAM(scale_v), {.above = 0., .help = "true velocity by the one that is given"});
    b(VIWO_PARAM(scale_omega), {.above = 0., .help = "true yaw rate by the one that is given"});
    b(VIWO_PARAM(turn_rad_per_m),
      {.unit = "rad/m",
       .help = "by how much the base turns as it drives by what is given as straight: radii of "
               "left and right that differ"});
    b(VIWO_PARAM(prior_sigma_scale_v), {.above = 0., .help = "how well scale_v is known"});
    b(VIWO_PARAM(prior_sigma_scale_omega),
      {.above = 0., .help = "how well scale_omega is known; of a base that skids, badly"});
    b(VIWO_PARAM(prior_sigma_turn_rad_per_m),
      {.unit = "rad/m", .above = 0., .help = "how well turn_rad_per_m is known"});
    b(VIWO_PARAM(sigma_v_m_per_s),
      {.unit = "m/s", .above = 0., .help = "noise of a velocity, per sample"});
    b(VIWO_PARAM(sigma_omega_rad_per_s),
      {.unit = "rad/s", .above = 0., .help = "noise of a yaw rate, per sample"});
    b(VIWO_PARAM(sigma_lateral_m_per_s),
      {.unit = "m/s",
       .above = 0.,
       .help = "sideways velocity of O where sideways is false, per sample"});
  }
};

class BodyTwist final : public KinematicModel {
 public:
  BodyTwist(const Params& params, const HostServices& /*services*/) : params_(params) {}

  void describe(ModelDescription& out) const override {
    const bool sideways = params_.sideways;
    out.n_drive = sideways ? 3 : 2;
    out.n_rows = 3;
    out.noise_block = 3;
    out.constant_A = true;
    out.intrinsics = {
        {"s_v",
         "1",
         params_.scale_v,
         params_.prior_sigma_scale_v,
         false,
         {0, sideways ? 2 : 1},
         0.},
        {"s_omega", "1", params_.scale_omega, params_.prior_sigma_scale_omega, false, {2, 1}, 0.},
        {"k_turn",
         "rad/m",
         params_.turn_rad_per_m,
         params_.prior_sigma_turn_rad_per_m,
         false,
         {2, 1}}};
    out.noises = {{NoiseKind::kDrive, 0, params_.sigma_v_m_per_s, {0, 3}, "sigma_v_m_per_s"}};
    if (sideways) {
      out.noises.push_back(
          {NoiseKind::kDrive, 1, params_.sigma_v_m_per_s, {1, 1}, "sigma_v_m_per_s"});
    }
    out.noises.push_back({NoiseKind::kDrive,
                          out.n_drive - 1,
                          params_.sigma_omega_rad_per_s,
                          {2, 1},
                          "sigma_omega_rad_per_s"});
    if (!sideways) {
      out.noises.push_back(
          {NoiseKind::kSlip, 0, params_.sigma_lateral_m_per_s, {1, 1}, "sigma_lateral_m_per_s"});
    }
  }

  Status rows(const EncoderSample& sample, const Intrinsics& x_WI, bool A_is_current,
              RowSystem& out) const override {
    if (!A_is_current) out.A.setIdentity();  // (BT-1)
    for (int row = 0; row < 3; ++row) {
      const int drive = drive_of(row);
      out.b[row] =
          drive < 0 ? 0.
                    : x_WI[scale_of(row)] * sample.drive_rad_per_s[static_cast<std::size_t>(drive)];
    }
    out.b[2] += x_WI[kTurn] * sample.drive_rad_per_s[0];
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                             const RowSystem& /*rows*/, const RowVector& b, const Twist& /*xi*/,
                             const RowVector& /*e*/, IntrinsicDerivatives& out) const override {
    const double v_x = b[0] / x_WI[0];  // as it is given
    for (int row = 0; row < 2; ++row) {
      if (drive_of(row) >= 0) out.J(row, 0) = b[row] / x_WI[0];  // (BT-2)
    }
    out.J(2, 1) = (b[2] - x_WI[kTurn] * v_x) / x_WI[1];
    out.J(2, kTurn) = v_x;
    out.DtE.setZero();
  }

  void noise_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                         const RowSystem& /*rows*/, const RowVector& /*b*/, const Twist& /*xi*/,
                         const RowVector& /*e*/, NoiseDerivatives& out) const override {
    // (BT-3); the source of slip is the last one, of the row in the middle.
    for (int row = 0; row < 3; ++row) {
      const int drive = drive_of(row);
      if (drive >= 0) out.J(row, drive) = x_WI[scale_of(row)];
    }
    out.J(2, 0) = x_WI[kTurn];
    if (!params_.sideways) out.J(1, 2) = 1.;
    out.DtE.setZero();
  }

  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                 EncoderSample& sample) const override {
    // Whatever sideways motion slip does not account for, a base that does not give it cannot make.
    if (!params_.sideways && std::abs(xi.y() + slip[1]) > 1e-9 && std::abs(xi.y()) > 1e-9) {
      return Status::kRejected;
    }
    sample.n_drive = params_.sideways ? 3 : 2;
    sample.n_steer = 0;
    for (int row = 0; row < 3; ++row) {
      const int drive = drive_of(row);
      if (drive < 0) continue;
      const double turn = row == 2 ? x_WI[kTurn] * sample.drive_rad_per_s[0] : 0.;
      sample.drive_rad_per_s[static_cast<std::size_t>(drive)] =
          (xi[row] + slip[row] - turn) / x_WI[scale_of(row)];  // (BT-4)
    }
    return Status::kOk;
  }

 private:
  /// The channel that row v_x, v_y or omega is read from; none: -1.
  int drive_of(int row) const {
    if (params_.sideways) return row;
    return row == 0 ? 0 : row == 2 ? 1 : -1;
  }
  static constexpr int kTurn = 2;
  static int scale_of(int row) { return row == 2 ? 1 : 0; }

  Params params_;
};

VIWO_REGISTER(KinematicModel, BodyTwist, "body_twist", "1.0.0",
              "any base that gives its twist: two scales, and a turn per way", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
