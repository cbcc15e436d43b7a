// Differential drive: one or more driven wheels per side, lateral no-slip row at the axle.
// Equations: model.md beside this file.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{
    ParamSpec{.name = "radius_left_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .min = 0.,
              .min_exclusive = true,
              .help = "radius of the left wheels"},
    ParamSpec{.name = "radius_right_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .min = 0.,
              .min_exclusive = true,
              .help = "radius of the right wheels"},
    ParamSpec{.name = "baseline_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .min = 0.,
              .min_exclusive = true,
              .help = "distance between the left and right contact lines"},
    ParamSpec{.name = "left_drives",
              .type = ParamType::kNumbers,
              .fallback = "[1]",
              .min = 1.,
              .max = kMaxDrives,
              .help = "drive channels on the left, counted from 1"},
    ParamSpec{.name = "right_drives",
              .type = ParamType::kNumbers,
              .fallback = "[2]",
              .min = 1.,
              .max = kMaxDrives,
              .help = "drive channels on the right, counted from 1"},
    ParamSpec{.name = "prior_sigma_radius_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .fallback = "0.0003",
              .min = 0.,
              .min_exclusive = true,
              .help = "how well the radii are known"},
    ParamSpec{.name = "prior_sigma_baseline_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .fallback = "0.005",
              .min = 0.,
              .min_exclusive = true,
              .help = "how well the baseline is known"},
    ParamSpec{.name = "sigma_drive_rad_per_s",
              .type = ParamType::kNumber,
              .unit = "rad/s",
              .fallback = "0.001",
              .min = 0.,
              .min_exclusive = true,
              .help = "noise of a drive rate, per sample"},
    ParamSpec{.name = "sigma_lateral_m_per_s",
              .type = ParamType::kNumber,
              .unit = "m/s",
              .fallback = "0.001",
              .min = 0.,
              .min_exclusive = true,
              .help = "sideways velocity of the axle, per sample"},
};

class Differential final : public KinematicModel {
 public:
  Differential(const ParamSet& params, const HostServices& /*services*/)
      : nominal_{params.number("radius_left_m"), params.number("radius_right_m"),
                 params.number("baseline_m")},
        prior_sigma_radius_m_(params.number("prior_sigma_radius_m")),
        prior_sigma_baseline_m_(params.number("prior_sigma_baseline_m")),
        sigma_drive_rad_per_s_(params.number("sigma_drive_rad_per_s")),
        sigma_lateral_m_per_s_(params.number("sigma_lateral_m_per_s")) {
    for (const char* key : {"left_drives", "right_drives"}) {
      for (const double number : params.numbers(key)) add_channel(key, number);
      if (key == std::string("left_drives")) n_left_ = static_cast<int>(channels_.size());
    }
    std::vector<std::size_t> sorted = channels_;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      if (sorted[i] != i) {
        throw ParamError("right_drives",
                         "left_drives and right_drives together must name each "
                         "channel from 1 to " +
                             std::to_string(sorted.size()) + " once");
      }
    }
    if (n_left_ == 0 || n_left_ == n_drive()) {
      throw ParamError("left_drives", "each side needs at least one drive channel");
    }
  }

  void describe(ModelDescription& out) const override {
    const int n = n_drive();
    out.n_drive = n;
    out.n_rows = n + 1;
    out.constant_A = true;
    out.intrinsics = {
        {"r_left", "m", nominal_[0], prior_sigma_radius_m_, false, {0, n_left_}},
        {"r_right", "m", nominal_[1], prior_sigma_radius_m_, false, {n_left_, n - n_left_}},
        {"baseline", "m", nominal_[2], prior_sigma_baseline_m_, false, {0, n}}};
    for (int i = 0; i < n; ++i) {
      const int channel = static_cast<int>(channels_[static_cast<std::size_t>(i)]);
      out.noises.push_back(
          {NoiseKind::kDrive, channel, sigma_drive_rad_per_s_, {i, 1}, "sigma_drive_rad_per_s"});
    }
    out.noises.push_back(
        {NoiseKind::kSlip, 0, sigma_lateral_m_per_s_, {n, 1}, "sigma_lateral_m_per_s"});
  }

  Status rows(const EncoderSample& sample, const Intrinsics& x_WI, bool A_is_current,
              RowSystem& out) const override {
    const int n = n_drive();
    for (int i = 0; i < n; ++i) {
      out.b[i] = x_WI[side(i)] * sample.drive_rad_per_s[channels_[static_cast<std::size_t>(i)]];
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
      sample.drive_rad_per_s[channels_[static_cast<std::size_t>(i)]] = v / x_WI[side(i)];
    }
    return Status::kOk;
  }

 private:
  void add_channel(const char* key, double number) {
    if (number != std::floor(number)) throw ParamError(key, "channels are whole numbers from 1");
    channels_.push_back(static_cast<std::size_t>(number) - 1);
  }

  int n_drive() const { return static_cast<int>(channels_.size()); }
  /// Row i: index of its radius, and the side's sign of the yaw rate.
  int side(int i) const { return i < n_left_ ? 0 : 1; }
  double sign(int i) const { return i < n_left_ ? -1. : 1.; }

  std::array<double, 3> nominal_;
  double prior_sigma_radius_m_, prior_sigma_baseline_m_;
  double sigma_drive_rad_per_s_, sigma_lateral_m_per_s_;
  std::vector<std::size_t> channels_;  ///< drive channel of each row, left ones first
  int n_left_ = 0;
};

VIWO_REGISTER(KinematicModel, Differential, "differential", "1.0.0",
              "differential drive with lateral no-slip row: two radii and the baseline",
              "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
