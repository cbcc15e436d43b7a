// Base with N >= 3 mecanum wheels: one row per wheel, along the direction in which its rollers
// cannot roll. Equations: model.md beside this file.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

struct Params {
  std::vector<double> x_m;
  std::vector<double> y_m;
  std::vector<double> roller_angle_rad;
  std::vector<double> radius_m;
  double prior_sigma_radius_m = 0.0005;
  double prior_sigma_roller_angle_rad = 0.01;
  double prior_sigma_lever_m = 0.005;
  double sigma_drive_rad_per_s = 0.001;
  double sigma_slip_m_per_s = 0.001;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(x_m), {.unit = "m",
                        .min = -50.,
                        .max = 50.,
                        .required = true,
                        .help = "wheel contact points along x (forward) in O, one per wheel"});
    b(VIWO_PARAM(y_m), {.unit = "m",
                        .min = -50.,
                        .max = 50.,
                        .required = true,
                        .help = "wheel contact points along y (left) in O, one per wheel"});
    b(VIWO_PARAM(roller_angle_rad),
      {.unit = "rad",
       .min = -1.4,
       .max = 1.4,
       .required = true,
       .help = "axis of the roller on the ground, from x, counter-clockwise, one per wheel; "
               "usual: -0.7854 front left and back right, 0.7854 the others"});
    b(VIWO_PARAM(radius_m), {.unit = "m",
                             .above = 0.,
                             .max = 10.,
                             .required = true,
                             .help = "wheel radii, one for all or one per wheel"});
    b(VIWO_PARAM(prior_sigma_radius_m),
      {.unit = "m", .above = 0., .help = "how well the radii are known"});
    b(VIWO_PARAM(prior_sigma_roller_angle_rad),
      {.unit = "rad", .above = 0., .help = "how well the roller angles are known"});
    b(VIWO_PARAM(prior_sigma_lever_m),
      {.unit = "m",
       .above = 0.,
       .help = "how well the lever arms k = x tan(roller angle) - y are known"});
    b(VIWO_PARAM(sigma_drive_rad_per_s),
      {.unit = "rad/s", .above = 0., .help = "noise of a drive rate, per sample"});
    b(VIWO_PARAM(sigma_slip_m_per_s),
      {.unit = "m/s", .above = 0., .help = "what a wheel slips, as rolling velocity, per sample"});
  }
};

/// Appends `values`, repeated if there is one for all wheels.
void append(const char* key, std::span<const double> values, int n, bool one_for_all,
            std::vector<double>& out) {
  const bool repeat = one_for_all && values.size() == 1;
  if (!repeat && values.size() != static_cast<std::size_t>(n)) {
    throw ParamError(key, "has " + std::to_string(values.size()) + " values for " +
                              std::to_string(n) + " wheels (x_m has " + std::to_string(n) + ")");
  }
  for (std::size_t j = 0; j < static_cast<std::size_t>(n); ++j) {
    out.push_back(values[repeat ? 0 : j]);
  }
}

class Mecanum final : public KinematicModel {
 public:
  Mecanum(const Params& params, const HostServices& /*services*/)
      : params_(params), n_(static_cast<int>(params.x_m.size())) {
    if (n_ < 3 || n_ > kMaxDrives) {
      throw ParamError("x_m", "has " + std::to_string(n_) + " wheels, this model takes 3 to " +
                                  std::to_string(kMaxDrives));
    }
    std::vector<double> x, y;
    append("x_m", params.x_m, n_, false, x);
    append("y_m", params.y_m, n_, false, y);
    append("radius_m", params.radius_m, n_, true, nominal_);
    append("roller_angle_rad", params.roller_angle_rad, n_, false, nominal_);
    const auto angle = [&](int j) { return nominal_[static_cast<std::size_t>(gamma(j))]; };
    if (std::abs(std::tan(angle(0)) - std::tan(angle(1))) < 0.1) {
      throw ParamError("roller_angle_rad",
                       "wheels 1 and 2 place the odometry frame on the base and must have "
                       "different angles: put the wheels in another order");
    }
    for (int j = 0; j < n_; ++j) {  // (MC-2)
      const auto i = static_cast<std::size_t>(j);
      nominal_.push_back(x[i] * std::tan(angle(j)) - y[i]);
    }
    require_lever(x, y);
  }

  /// Rollers that all point at O on the ground hold against no turn.
  void require_lever(std::span<const double> x, std::span<const double> y) const {
    constexpr double kLeast = 0.05;
    double lever = 0., far = 0.;
    for (int j = 0; j < n_; ++j) {
      const auto i = static_cast<std::size_t>(j);
      lever = std::max(lever, std::abs(nominal_[static_cast<std::size_t>(2 * n_) + i]));
      far = std::max(far, std::hypot(x[i], y[i]));
    }
    if (lever < kLeast * far) {
      throw ParamError("roller_angle_rad",
                       "the axes of all rollers go through the middle, so that no wheel tells a "
                       "turn: are these the rollers as seen on top of the wheels? On the ground "
                       "they have the other sign");
    }
  }

  void describe(ModelDescription& out) const override {
    out.n_drive = n_;
    out.n_rows = n_;
    out.constant_A = true;
    struct Group {
      const char* name;
      const char* unit;
      double prior_sigma;
      int held;  // the first so many entries hold the gauge (MC-8)
      double lowest = -std::numeric_limits<double>::infinity();
    };
    const Group groups[] = {{"r_", "m", params_.prior_sigma_radius_m, 0, 0.},
                            {"gamma_", "rad", params_.prior_sigma_roller_angle_rad, 1},
                            {"k_", "m", params_.prior_sigma_lever_m, 2}};
    for (const Group& group : groups) {
      for (int j = 0; j < n_; ++j) {
        out.intrinsics.push_back({.name = group.name + std::to_string(j + 1),
                                  .unit = group.unit,
                                  .nominal = nominal_[out.intrinsics.size()],
                                  .prior_sigma = group.prior_sigma,
                                  .gauge_fixed = j < group.held,
                                  .rows = {j, 1},
                                  .lowest = group.lowest});
      }
    }
    for (int j = 0; j < n_; ++j) {
      out.noises.push_back(
          {NoiseKind::kDrive, j, params_.sigma_drive_rad_per_s, {j, 1}, "sigma_drive_rad_per_s"});
    }
    for (int j = 0; j < n_; ++j) {
      out.noises.push_back(
          {NoiseKind::kSlip, j, params_.sigma_slip_m_per_s, {j, 1}, "sigma_slip_m_per_s"});
    }
  }

  Status rows(const EncoderSample& sample, const Intrinsics& x_WI, bool A_is_current,
              RowSystem& out) const override {
    for (int j = 0; j < n_; ++j) {
      out.b[j] = x_WI[r(j)] * sample.drive_rad_per_s[static_cast<std::size_t>(j)];
      if (!A_is_current) out.A.row(j) << 1., std::tan(x_WI[gamma(j)]), x_WI[k(j)];  // (MC-1)
    }
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                             const RowSystem& rows, const RowVector& b, const Twist& xi,
                             const RowVector& e, IntrinsicDerivatives& out) const override {
    for (int j = 0; j < n_; ++j) {
      const double per_angle = 1. + rows.A(j, 1) * rows.A(j, 1);
      out.J(j, r(j)) = b[j] / x_WI[r(j)];        // (MC-3)
      out.J(j, gamma(j)) = -per_angle * xi.y();  // (MC-4)
      out.J(j, k(j)) = -xi.z();                  // (MC-5)
      out.DtE(1, gamma(j)) = per_angle * e[j];   // (MC-6)
      out.DtE(2, k(j)) = e[j];
    }
  }

  void noise_derivatives(const EncoderSample& /*sample*/, const Intrinsics& x_WI,
                         const RowSystem& /*rows*/, const RowVector& /*b*/, const Twist& /*xi*/,
                         const RowVector& /*e*/, NoiseDerivatives& out) const override {
    for (int j = 0; j < n_; ++j) {
      out.J(j, j) = x_WI[r(j)];  // (MC-7)
      out.J(j, n_ + j) = 1.;
    }
  }

  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                 EncoderSample& sample) const override {
    sample.n_drive = n_;
    sample.n_steer = 0;
    for (int j = 0; j < n_; ++j) {  // (MC-9)
      const double v = xi.x() + std::tan(x_WI[gamma(j)]) * xi.y() + x_WI[k(j)] * xi.z() + slip[j];
      sample.drive_rad_per_s[static_cast<std::size_t>(j)] = v / x_WI[r(j)];
    }
    return Status::kOk;
  }

  Status move_frame(const Eigen::Vector3d& g, Intrinsics& x_WI) const override {
    for (int j = 0; j < n_; ++j) {  // (MC-8)
      const double tau = std::tan(x_WI[gamma(j)]);
      const double a = std::cos(g[0]) + tau * std::sin(g[0]);
      if (!(std::abs(a) > 1e-6)) return Status::kRejected;  // a roller axis across the new x
      x_WI[r(j)] /= a;
      x_WI[gamma(j)] = std::atan((tau * std::cos(g[0]) - std::sin(g[0])) / a);
      x_WI[k(j)] = (x_WI[k(j)] + g[2] - tau * g[1]) / a;
    }
    return Status::kOk;
  }

 private:
  int r(int j) const { return j; }
  int gamma(int j) const { return n_ + j; }
  int k(int j) const { return 2 * n_ + j; }

  Params params_;
  int n_;
  std::vector<double> nominal_;
};

VIWO_REGISTER(KinematicModel, Mecanum, "mecanum", "1.0.0",
              "N >= 3 mecanum wheels: radii, roller angles and lever arms", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
