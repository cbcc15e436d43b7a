// The recorded swerve robot as somebody else would model it: four wheels at the corners of a
// square, each steered and driven, with one radius and one track to calibrate.
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "viwo/api/auto_kinematics.hpp"
#include "viwo/api/plugin.hpp"

namespace {

using viwo::NoiseKind;
using viwo::ParamSpec;
using viwo::ParamType;

constexpr ParamSpec positive(const char* name, const char* unit, const char* fallback,
                             const char* help) {
  return {.name = name,
          .type = ParamType::kNumber,
          .unit = unit,
          .fallback = fallback,
          .min = 0.,
          .min_exclusive = true,
          .help = help};
}

constexpr std::array kParams{
    positive("radius_m", "m", nullptr, "radius of all wheels"),
    positive("track_m", "m", nullptr, "side of the square"),
    positive("prior_sigma_m", "m", "0.001", "how well both are known"),
    positive("sigma_drive_rad_per_s", "rad/s", "0.02", "noise of a drive rate, per sample"),
    positive("sigma_steer_rad", "rad", "0.00044", "noise of a steering angle, per sample"),
    positive("sigma_lateral_m_per_s", "m/s", "0.001", "sideways velocity of a wheel, per sample")};

class SwerveAuto final : public viwo::AutoKinematics<SwerveAuto> {
 public:
  SwerveAuto(const viwo::ParamSet& params, const viwo::HostServices& /*services*/) : p_(params) {}

  void describe(viwo::ModelDescription& out) const override {
    out.n_drive = out.n_steer = 4;
    out.n_rows = 8;
    out.noise_block = 2;
    out.intrinsics = {{"r", "m", p_.number("radius_m"), p_.number("prior_sigma_m")},
                      {"track", "m", p_.number("track_m"), p_.number("prior_sigma_m")}};
    const auto add = [&out](NoiseKind kind, double sigma, int first, int rows) {
      for (int i = 0; i < 4; ++i) out.noises.push_back({kind, i, sigma, {2 * i + first, rows}});
    };
    add(NoiseKind::kDrive, p_.number("sigma_drive_rad_per_s"), 0, 1);
    add(NoiseKind::kSteer, p_.number("sigma_steer_rad"), 0, 2);
    add(NoiseKind::kSlip, p_.number("sigma_lateral_m_per_s"), 1, 1);
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
  viwo::ParamSet p_;
};

VIWO_REGISTER(viwo::KinematicModel, SwerveAuto, "swerve_auto", "1.0.0", "square swerve base",
              "Apache-2.0", kParams);

}  // namespace
