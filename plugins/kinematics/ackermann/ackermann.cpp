// Car-like base: rear wheels that do not steer, front wheels that do. Rolling rows of the measured
// wheels, no-slip row of the rear axle, steering rows at the front. Equations: model.md beside this
// file.
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ackermann_params.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

/// A row of the front axle, at [wheel base, side * track / 2].
struct FrontRow {
  int row;
  int steer;    ///< steering channel
  int drive;    ///< drive channel of a rolling row, -1: steering row
  double side;  ///< +1 left, -1 right, 0 middle
};

/// Where a front wheel is and where it points, with the derivatives of its direction.
struct FrontWheel {
  double y, c, s;                  ///< place across, cosine and sine of the direction
  double by_delta = 1.;            ///< of the direction, by the steering angle,
  double by_base = 0., by_y = 0.;  ///< the wheel base, and y
};

class Ackermann final : public KinematicModel {
 public:
  Ackermann(const ackermann::Params& params, const HostServices& /*services*/)
      : params_(params),
        n_steer_(params.steering == "both" ? 2 : 1),
        n_drive_(params.wheel_speeds == "all" ? 4 : 2) {
    append("radius_m", params.radius_m, n_drive_, "measured wheels");
    nominal_.push_back(params.wheel_base_m);
    nominal_.push_back(params.track_m);
    append("steer_offset_rad", params.steer_offset_rad, n_steer_, "steering channels");
    // Rear left, rear right, axle, then what one steering channel enters together.
    int row = 3;
    for (int k = 0; k < n_steer_; ++k) {
      const double left = n_steer_ == 1 ? 0. : (k == 0 ? 1. : -1.);
      front_.push_back({row++, k, -1, left});
      if (n_drive_ == 2) continue;
      if (n_steer_ == 2) front_.push_back({row++, k, 2 + k, left});
      if (n_steer_ == 1) front_.push_back({row++, k, 2, 1.});
      if (n_steer_ == 1) front_.push_back({row++, k, 3, -1.});
    }
    n_rows_ = row;
  }

  void describe(ModelDescription& out) const override {
    out.n_drive = n_drive_;
    out.n_steer = n_steer_;
    out.n_rows = n_rows_;
    // A steering channel enters its steering row and, with all speeds, front rolling rows.
    out.noise_block = n_drive_ == 2 ? 1 : (n_steer_ == 1 ? 3 : n_rows_);
    const RowRange all{0, n_rows_}, front{3, n_rows_ - 3};
    const char* wheels[] = {"r_rear_left", "r_rear_right", "r_front_left", "r_front_right"};
    const char* offsets[] = {n_steer_ == 1 ? "delta_o" : "delta_o_left", "delta_o_right"};
    const auto add = [&](const char* name, const char* unit, double sigma, RowRange rows) {
      out.intrinsics.push_back({name, unit, nominal_[out.intrinsics.size()], sigma, false, rows});
      if (unit == std::string_view("m")) out.intrinsics.back().lowest = 0.;  // radii and lengths
    };
    for (int i = 0; i < n_drive_; ++i) add(wheels[i], "m", params_.prior_sigma_radius_m, all);
    add("wheel_base", "m", params_.prior_sigma_length_m, front);
    add("track", "m", params_.prior_sigma_length_m, all);
    for (int k = 0; k < n_steer_; ++k) {
      add(offsets[k], "rad", params_.prior_sigma_steer_offset_rad, rows_of_channel(k));
    }
    for (int i = 0; i < n_drive_; ++i) {
      out.noises.push_back({NoiseKind::kDrive,
                            i,
                            params_.sigma_drive_rad_per_s,
                            {row_of_drive(i), 1},
                            "sigma_drive_rad_per_s"});
    }
    for (int k = 0; k < n_steer_; ++k) {
      out.noises.push_back(
          {NoiseKind::kSteer, k, params_.sigma_steer_rad, rows_of_channel(k), "sigma_steer_rad"});
    }
    out.noises.push_back(
        {NoiseKind::kSlip, 0, params_.sigma_lateral_m_per_s, {2, 1}, "sigma_lateral_m_per_s"});
    for (const FrontRow& f : front_) {
      if (f.drive >= 0) continue;
      out.noises.push_back({NoiseKind::kSlip,
                            1 + f.steer,
                            params_.sigma_front_lateral_m_per_s,
                            {f.row, 1},
                            "sigma_front_lateral_m_per_s"});
    }
  }

  Status rows(const EncoderSample& sample, const Intrinsics& x_WI, bool /*A_is_current*/,
              RowSystem& out) const override {
    for (int i = 0; i < 2; ++i) {
      out.A.row(i) << 1., 0., -0.5 * side_of(i) * x_WI[track()];
      out.b[i] = x_WI[i] * sample.drive_rad_per_s[static_cast<std::size_t>(i)];
    }
    out.A.row(2) << 0., 1., 0.;
    out.b[2] = 0.;
    for (const FrontRow& f : front_) {
      const FrontWheel w = front_wheel(f, sample, x_WI);
      out.A.row(f.row) = f.drive < 0 ? across(w, x_WI) : along(w, x_WI);
      out.b[f.row] =
          f.drive < 0 ? 0.
                      : x_WI[f.drive] * sample.drive_rad_per_s[static_cast<std::size_t>(f.drive)];
    }
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample& sample, const Intrinsics& x_WI,
                             const RowSystem& rows, const RowVector& b, const Twist& xi,
                             const RowVector& e, IntrinsicDerivatives& out) const override {
    out.DtE.setZero();
    for (int i = 0; i < 2; ++i) {
      out.J(i, i) = b[i] / x_WI[i];
      out.J(i, track()) = 0.5 * side_of(i) * xi.z();
      out.DtE(2, track()) -= 0.5 * side_of(i) * e[i];
    }
    share_slip(2, b, x_WI, out);
    for (const FrontRow& f : front_) {
      const FrontWheel w = front_wheel(f, sample, x_WI);
      const double half = 0.5 * f.side, omega = xi.z();
      if (f.drive < 0) {
        share_slip(f.row, b, x_WI, out);
        const Eigen::RowVector3d t = -along(w, x_WI);
        out.J(f.row, base()) = -omega * w.c;
        out.J(f.row, track()) = -half * omega * w.s;
        out.J(f.row, delta_o(f.steer)) = t.dot(xi);
        out.DtE(2, base()) += w.c * e[f.row];
        out.DtE(2, track()) += half * w.s * e[f.row];
        out.DtE.col(delta_o(f.steer)) -= t.transpose() * e[f.row];
        continue;
      }
      const Eigen::RowVector3d t = across(w, x_WI);
      const double turned = t.dot(xi);
      out.J(f.row, f.drive) = b[f.row] / x_WI[f.drive];
      out.J(f.row, base()) = -omega * w.s - turned * w.by_base;
      out.J(f.row, track()) = half * (omega * w.c - turned * w.by_y);
      // At the fitted signal the wheel points along the velocity of its contact point, and nothing
      // moves with its offset, as in four_wis_wid_drive_only.
      out.J(f.row, delta_o(f.steer)) = &b != &rows.b ? 0. : turned * w.by_delta;
      out.DtE.col(base()) += (t.transpose() * w.by_base + Eigen::Vector3d(0., 0., w.s)) * e[f.row];
      out.DtE.col(track()) +=
          half * (t.transpose() * w.by_y - Eigen::Vector3d(0., 0., w.c)) * e[f.row];
      out.DtE.col(delta_o(f.steer)) -= t.transpose() * (w.by_delta * e[f.row]);
    }
  }

  void noise_derivatives(const EncoderSample& sample, const Intrinsics& x_WI,
                         const RowSystem& /*rows*/, const RowVector& /*b*/, const Twist& xi,
                         const RowVector& e, NoiseDerivatives& out) const override {
    out.DtE.setZero();
    for (int i = 0; i < n_drive_; ++i) out.J(row_of_drive(i), i) = x_WI[i];
    int slip = n_drive_ + n_steer_;
    out.J(2, slip++) = 1.;
    for (const FrontRow& f : front_) {
      const FrontWheel w = front_wheel(f, sample, x_WI);
      const Eigen::RowVector3d t = f.drive < 0 ? Eigen::RowVector3d(-along(w, x_WI))
                                               : Eigen::RowVector3d(w.by_delta * across(w, x_WI));
      out.J(f.row, n_drive_ + f.steer) = -t.dot(xi);
      out.DtE.col(n_drive_ + f.steer) += t.transpose() * e[f.row];
      if (f.drive < 0) out.J(f.row, slip++) = 1.;
    }
  }

  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                 EncoderSample& sample) const override {
    // Whatever sideways motion the slip of the rear axle does not account for, it cannot make.
    if (std::abs(xi.y() + slip[2]) > 1e-9 && std::abs(xi.y()) > 1e-9) return Status::kRejected;
    const double turn = x_WI[base()] * xi.z();
    if (std::abs(turn) > 1e-9 &&
        std::atan2(std::abs(turn), std::abs(xi.x())) > params_.max_steer_rad) {
      return Status::kRejected;
    }
    EncoderSample out = sample;
    out.n_drive = n_drive_;
    out.n_steer = n_steer_;
    const auto roll = [&](int drive, double v) {
      out.drive_rad_per_s[static_cast<std::size_t>(drive)] = v / x_WI[drive];
    };
    for (int i = 0; i < 2; ++i) {
      roll(i, xi.x() - 0.5 * side_of(i) * x_WI[track()] * xi.z() + slip[i]);
    }
    for (const FrontRow& f : front_) {
      if (f.drive >= 0) {
        roll(f.drive, along(front_wheel(f, out, x_WI), x_WI).dot(xi) + slip[f.row]);
        continue;
      }
      const double u = xi.x() - 0.5 * f.side * x_WI[track()] * xi.z();
      const double v = xi.y() + turn;
      const double speed = std::hypot(u, v);
      if (speed < 1e-9) continue;  // a wheel at rest keeps its direction
      if (std::abs(slip[f.row]) > speed) return Status::kRejected;
      const double forward = u < 0. ? -1. : 1.;
      const double delta =
          std::atan2(forward * v, forward * u) + std::asin(forward * slip[f.row] / speed);
      out.steer_rad[static_cast<std::size_t>(f.steer)] = delta + x_WI[delta_o(f.steer)];
    }
    sample = out;
    return Status::kOk;
  }

 private:
  /// Appends `values` to the nominal intrinsics, repeated if there is one for all.
  void append(const char* key, std::span<const double> values, int n, const char* what) {
    if (values.size() != 1 && values.size() != static_cast<std::size_t>(n)) {
      throw ParamError(key, "has " + std::to_string(values.size()) + " values for " +
                                std::to_string(n) + " " + what);
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
      nominal_.push_back(values[values.size() == 1 ? 0 : i]);
    }
  }

  int base() const { return n_drive_; }
  int track() const { return n_drive_ + 1; }
  int delta_o(int k) const { return n_drive_ + 2 + k; }
  /// +1 on the left, -1 on the right; drive channels are left, right, left, right.
  static double side_of(int drive) { return drive % 2 == 0 ? 1. : -1.; }

  int row_of_drive(int drive) const {
    for (const FrontRow& f : front_) {
      if (f.drive == drive) return f.row;
    }
    return drive;
  }
  RowRange rows_of_channel(int k) const {
    const int count = (n_rows_ - 3) / n_steer_;
    return {3 + k * count, count};
  }

  /// A steering row, and wheels with an encoder of their own, point where the encoder says; the
  /// others where a linkage turns them that leaves one centre of rotation.
  FrontWheel front_wheel(const FrontRow& f, const EncoderSample& sample,
                         const Intrinsics& x_WI) const {
    const double delta =
        sample.steer_rad[static_cast<std::size_t>(f.steer)] - x_WI[delta_o(f.steer)];
    const double c = std::cos(delta), s = std::sin(delta), L = x_WI[base()];
    const double y = 0.5 * f.side * x_WI[track()];
    if (f.drive < 0 || n_steer_ == 2) return {y, c, s};
    const double a = L * c - y * s, b = L * s;
    const double n2 = a * a + b * b, n = std::sqrt(n2);
    return {y, a / n, b / n, L * L / n2, -y * s * s / n2, L * s * s / n2};
  }

  /// Velocity of the contact point along the wheel and across it, as rows.
  Eigen::RowVector3d along(const FrontWheel& w, const Intrinsics& x_WI) const {
    return {w.c, w.s, x_WI[base()] * w.s - w.y * w.c};
  }
  Eigen::RowVector3d across(const FrontWheel& w, const Intrinsics& x_WI) const {
    return {-w.s, w.c, x_WI[base()] * w.c + w.y * w.s};
  }

  /// A row without a wheel speed: what the fitted signal has there grows with all radii, like the
  /// twist, so that their common factor stays free of information. Zero at the measured one.
  void share_slip(int row, const RowVector& b, const Intrinsics& x_WI,
                  IntrinsicDerivatives& out) const {
    for (int i = 0; i < n_drive_; ++i) out.J(row, i) = b[row] / (n_drive_ * x_WI[i]);
  }

  ackermann::Params params_;
  int n_steer_, n_drive_;
  int n_rows_ = 0;
  std::vector<double> nominal_;
  std::vector<FrontRow> front_;
};

VIWO_REGISTER(KinematicModel, Ackermann, "ackermann", "1.0.0",
              "car-like base: radii, wheel base, track and steering offset", "Apache-2.0",
              ackermann::Params);

}  // namespace
}  // namespace viwo
