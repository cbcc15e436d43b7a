// The recorded swerve robot as somebody else would model it: four wheels at the corners of a
// square, each steered and driven, with one radius and one track to calibrate.
#include <cmath>
#include <cstddef>
#include <span>

#include "viwo/api/auto_kinematics.hpp"
#include "viwo/api/plugin.hpp"

namespace {

using viwo::NoiseKind;

struct Params {
  double radius_m = 0.;
  double track_m = 0.;
  double prior_sigma_m = 0.001;
  double sigma_drive_rad_per_s = 0.02;
  double sigma_steer_rad = 0.00044;
  double sigma_lateral_m_per_s = 0.001;

  void bind(viwo::ParamBinder& b) {
    b(VIWO_PARAM(radius_m),
      {.unit = "m", .above = 0., .required = true, .help = "radius of all wheels"});
    b(VIWO_PARAM(track_m),
      {.unit = "m", .above = 0., .required = true, .help = "side of the square"});
    b(VIWO_PARAM(prior_sigma_m), {.unit = "m", .above = 0., .help = "how well both are known"});
    b(VIWO_PARAM(sigma_drive_rad_per_s),
      {.unit = "rad/s", .above = 0., .help = "noise of a drive rate, per sample"});
    b(VIWO_PARAM(sigma_steer_rad),
      {.unit = "rad", .above = 0., .help = "noise of a steering angle, per sample"});
    b(VIWO_PARAM(sigma_lateral_m_per_s),
      {.unit = "m/s", .above = 0., .help = "sideways velocity of a wheel, per sample"});
  }
};

class SwerveAuto final : public viwo::AutoKinematics<SwerveAuto> {
 public:
  SwerveAuto(const Params& params, const viwo::HostServices& /*services*/) : p_(params) {}

  void describe(viwo::ModelDescription& out) const override {
    out.n_drive = out.n_steer = 4;
    out.n_rows = 8;
    out.noise_block = 2;
    out.intrinsics = {{"r", "m", p_.radius_m, p_.prior_sigma_m},
                      {"track", "m", p_.track_m, p_.prior_sigma_m}};
    const auto add = [&out](NoiseKind kind, double sigma, int first, int rows) {
      for (int i = 0; i < 4; ++i) out.noises.push_back({kind, i, sigma, {2 * i + first, rows}});
    };
    add(NoiseKind::kDrive, p_.sigma_drive_rad_per_s, 0, 1);
    add(NoiseKind::kSteer, p_.sigma_steer_rad, 0, 2);
    add(NoiseKind::kSlip, p_.sigma_lateral_m_per_s, 1, 1);
  }

  template <class T>
  void auto_rows(std::span<const T> drive_rad_per_s, std::span<const T> steer_rad,
                 std::span<const T> x_WI, viwo::AutoRows<T>& out) const {
    using std::cos, std::sin;
    constexpr double kX[] = {0.5, -0.5, -0.5, 0.5}, kY[] = {0.5, 0.5, -0.5, -0.5};
    for (std::size_t i = 0; i < 4; ++i) {
      const T c = cos(steer_rad[i]), s = sin(steer_rad[i]);
      const T x = kX[i] * x_WI[1], y = kY[i] * x_WI[1];
      const int roll = 2 * static_cast<int>(i), slide = roll + 1;
      out.A(roll, 0) = c;
      out.A(roll, 1) = s;
      out.A(roll, 2) = x * s - y * c;
      out.b[2 * i] = x_WI[0] * drive_rad_per_s[i];
      out.A(slide, 0) = -s;
      out.A(slide, 1) = c;
      out.A(slide, 2) = x * c + y * s;
    }
  }

 private:
  Params p_;
};

VIWO_REGISTER(viwo::KinematicModel, SwerveAuto, "swerve_auto", "1.0.0", "square swerve base",
              "Apache-2.0", Params);

}  // namespace
