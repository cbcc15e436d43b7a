// What the models of a base with N steered and driven wheels share: parameters, the order of the
// intrinsics x_WI = [r_1..r_N, x_1..x_N, y_1..y_N, delta_o1..delta_oN], and kappa_1..kappa_N where
// they are asked for, inverse kinematics. Wheel j steers by
// delta_j = (1 + kappa_j) delta_mj - delta_oj and rolls with v_j = r_j omega_j along
// d_j = [cos delta_j, sin delta_j]^T (four_wis_wid/model.md, S-1).
#pragma once

#include <cstddef>
#include <vector>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/params.hpp"

namespace viwo::swerve {

struct Params {
  std::vector<double> x_m;
  std::vector<double> y_m;
  std::vector<double> radius_m;
  std::vector<double> steer_offset_rad{0.};
  double prior_sigma_radius_m = 0.0003;
  double prior_sigma_position_m = 0.002;
  double prior_sigma_steer_offset_rad = 0.01;
  double prior_sigma_steer_gain = 0.;
  double sigma_drive_rad_per_s = 0.001;
  double sigma_steer_rad = 0.001;
  double sigma_lateral_m_per_s = 0.001;

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
    b(VIWO_PARAM(radius_m), {.unit = "m",
                             .above = 0.,
                             .max = 10.,
                             .required = true,
                             .help = "wheel radii, one for all or one per wheel"});
    b(VIWO_PARAM(steer_offset_rad),
      {.unit = "rad",
       .help = "reading of the steering encoder when the wheel points along x, one for all or "
               "one per wheel"});
    b(VIWO_PARAM(prior_sigma_radius_m),
      {.unit = "m", .above = 0., .help = "how well the radii are known"});
    b(VIWO_PARAM(prior_sigma_position_m),
      {.unit = "m", .above = 0., .help = "how well each coordinate of a contact point is known"});
    b(VIWO_PARAM(prior_sigma_steer_offset_rad),
      {.unit = "rad", .above = 0., .help = "how well the steering offsets are known"});
    b(VIWO_PARAM(prior_sigma_steer_gain),
      {.unit = "1",
       .min = 0.,
       .help = "how well it is known that the steering angles turn by what is read; 0: they "
               "do, and no gains are estimated"});
    b(VIWO_PARAM(sigma_drive_rad_per_s),
      {.unit = "rad/s", .above = 0., .help = "noise of a drive rate, per sample"});
    b(VIWO_PARAM(sigma_steer_rad),
      {.unit = "rad", .above = 0., .help = "noise of a steering angle, per sample"});
    b(VIWO_PARAM(sigma_lateral_m_per_s),
      {.unit = "m/s",
       .above = 0.,
       .help = "sideways velocity of a contact point, per sample (unused by drive-only models)"});
  }
};

/// Rows that one wheel contributes, for filling in the description.
enum class RowsPerWheel : int { kDriveOnly = 1, kDriveAndLateral = 2 };

/// Base of the swerve models: everything but the rows.
class SwerveBase : public KinematicModel {
 public:
  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                 EncoderSample& y) const override;
  Status move_frame(const Eigen::Vector3d& g, Intrinsics& x_WI) const override;

 protected:
  /// Throws ParamError when the lists do not agree in length or there are fewer than two wheels.
  explicit SwerveBase(const Params& params);

  /// Intrinsics, encoder noises, counts; rows per wheel decide the row ranges. Wheel 1's position
  /// and steering offset hold the gauge (four_wis_wid/model.md, S-11).
  void describe_wheels(RowsPerWheel rows_per_wheel, ModelDescription& out) const;

  /// The slip of wheel j as a velocity in O, from the model's slip rows.
  virtual Eigen::Vector2d contact_slip(const RowVector& slip, int j) const = 0;

  int n() const { return n_; }
  int r(int j) const { return j; }
  int x(int j) const { return n_ + j; }
  int y(int j) const { return 2 * n_ + j; }
  int delta_o(int j) const { return 3 * n_ + j; }
  bool has_gains() const { return params_.prior_sigma_steer_gain > 0.; }
  int kappa(int j) const { return 4 * n_ + j; }  ///< only with gains

  /// Of wheel j: by how much it turns for each radian that is read, and where it points (S-1), rad.
  double gain(const Intrinsics& x_WI, int j) const {
    return has_gains() ? 1. + x_WI[kappa(j)] : 1.;
  }
  double delta(const EncoderSample& sample, const Intrinsics& x_WI, int j) const {
    return gain(x_WI, j) * sample.steer_rad[static_cast<std::size_t>(j)] - x_WI[delta_o(j)];
  }

 private:
  Params params_;
  int n_ = 0;
  std::vector<double> nominal_;
};

}  // namespace viwo::swerve
