#include "swerve_base.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>

namespace viwo::swerve {
namespace {

/// Appends `values`, repeated if there is one for all wheels.
void append(const char* key, std::span<const double> values, int n, std::vector<double>& out) {
  if (values.size() != 1 && values.size() != static_cast<std::size_t>(n)) {
    throw ParamError(key, "has " + std::to_string(values.size()) + " values for " +
                              std::to_string(n) + " wheels (x_m has " + std::to_string(n) + ")");
  }
  for (int j = 0; j < n; ++j)
    out.push_back(values[values.size() == 1 ? 0 : static_cast<std::size_t>(j)]);
}

}  // namespace

SwerveBase::SwerveBase(const Params& params) : params_(params) {
  const auto& x_m = params.x_m;
  const auto& y_m = params.y_m;
  n_ = static_cast<int>(x_m.size());
  if (n_ < 2 || n_ > kMaxDrives) {
    throw ParamError("x_m", "has " + std::to_string(n_) + " wheels, this model takes 2 to " +
                                std::to_string(kMaxDrives));
  }
  if (y_m.size() != x_m.size()) {
    throw ParamError("y_m", "has " + std::to_string(y_m.size()) + " values, x_m has " +
                                std::to_string(x_m.size()) + ": one per wheel in each");
  }
  bool apart = false;
  for (std::size_t j = 1; j < x_m.size(); ++j) apart |= x_m[j] != x_m[0] || y_m[j] != y_m[0];
  if (!apart) throw ParamError("x_m", "all wheels are at the same place: no yaw rate can be told");
  append("radius_m", params.radius_m, n_, nominal_);
  nominal_.insert(nominal_.end(), x_m.begin(), x_m.end());
  nominal_.insert(nominal_.end(), y_m.begin(), y_m.end());
  append("steer_offset_rad", params.steer_offset_rad, n_, nominal_);
  if (!has_gains()) return;
  nominal_.resize(nominal_.size() + x_m.size(), 0.);
  if (nominal_.size() > static_cast<std::size_t>(kMaxIntrinsics)) {
    throw ParamError("prior_sigma_steer_gain",
                     "makes " + std::to_string(nominal_.size()) + " intrinsics of " +
                         std::to_string(n_) + " wheels, at most " + std::to_string(kMaxIntrinsics) +
                         " can be estimated");
  }
}

void SwerveBase::describe_wheels(RowsPerWheel rows_per_wheel, ModelDescription& out) const {
  const int k = static_cast<int>(rows_per_wheel);
  out.n_drive = n_;
  out.n_steer = n_;
  out.n_rows = k * n_;
  out.noise_block = k;
  struct Group {
    const char* name;
    const char* unit;
    double prior_sigma;
    bool holds_gauge;
    double lowest = -std::numeric_limits<double>::infinity();
  };
  const Group groups[] = {{"r_", "m", params_.prior_sigma_radius_m, false, 0.},
                          {"x_", "m", params_.prior_sigma_position_m, true},
                          {"y_", "m", params_.prior_sigma_position_m, true},
                          {"delta_o", "rad", params_.prior_sigma_steer_offset_rad, true},
                          {"kappa_", "1", params_.prior_sigma_steer_gain, false}};
  for (const Group& group : groups) {
    if (!(group.prior_sigma > 0.)) continue;
    for (int j = 0; j < n_; ++j) {
      out.intrinsics.push_back({.name = group.name + std::to_string(j + 1),
                                .unit = group.unit,
                                .nominal = nominal_[out.intrinsics.size()],
                                .prior_sigma = group.prior_sigma,
                                .gauge_fixed = group.holds_gauge && j == 0,  // (S-11)
                                .rows = {k * j, k},
                                .lowest = group.lowest});
    }
  }
  for (int j = 0; j < n_; ++j) {
    out.noises.push_back(
        {NoiseKind::kDrive, j, params_.sigma_drive_rad_per_s, {k * j, k}, "sigma_drive_rad_per_s"});
  }
  for (int j = 0; j < n_; ++j) {
    out.noises.push_back(
        {NoiseKind::kSteer, j, params_.sigma_steer_rad, {k * j, k}, "sigma_steer_rad"});
  }
  if (rows_per_wheel == RowsPerWheel::kDriveOnly) return;
  for (int j = 0; j < n_; ++j) {
    out.noises.push_back(
        {NoiseKind::kSlip, j, params_.sigma_lateral_m_per_s, {k * j, k}, "sigma_lateral_m_per_s"});
  }
}

Status SwerveBase::inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                           EncoderSample& sample) const {
  sample.n_drive = n_;
  sample.n_steer = n_;
  for (int j = 0; j < n_; ++j) {
    const auto channel = static_cast<std::size_t>(j);
    const Eigen::Vector2d u =  // (S-9)
        Eigen::Vector2d(xi.x() - x_WI[y(j)] * xi.z(), xi.y() + x_WI[x(j)] * xi.z()) +
        contact_slip(slip, j);
    double v = u.norm();
    // A wheel at rest keeps its direction, also where a spline makes it creep; otherwise it turns
    // by at most a quarter, rolling backwards where that is the shorter way.
    constexpr double kCreep = 1e-6;  // m/s
    if (v > kCreep) {
      double turn =
          std::remainder(std::atan2(u.y(), u.x()) - delta(sample, x_WI, j), 2. * std::numbers::pi);
      if (std::abs(turn) > std::numbers::pi / 2. + 1e-9) {
        turn -= std::copysign(std::numbers::pi, turn);
        v = -v;
      }
      sample.steer_rad[channel] += turn / gain(x_WI, j);
    } else {
      const double direction = delta(sample, x_WI, j);
      v = u.x() * std::cos(direction) + u.y() * std::sin(direction);
    }
    sample.drive_rad_per_s[channel] = v / x_WI[r(j)];
  }
  return Status::kOk;
}

Status SwerveBase::move_frame(const Eigen::Vector3d& g, Intrinsics& x_WI) const {
  const double c = std::cos(g[0]);
  const double s = std::sin(g[0]);
  for (int j = 0; j < n_; ++j) {  // (S-11)
    const double dx = x_WI[x(j)] - g[1];
    const double dy = x_WI[y(j)] - g[2];
    x_WI[x(j)] = c * dx + s * dy;
    x_WI[y(j)] = c * dy - s * dx;
    x_WI[delta_o(j)] += g[0];
  }
  return Status::kOk;
}

}  // namespace viwo::swerve
