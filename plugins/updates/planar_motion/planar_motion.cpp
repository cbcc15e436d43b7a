// A base that drives on a plane: between two clones the odometry frame O turns about its z axis
// only and does not leave its x-y plane. Equations: model.md.
#include <array>

#include "planar_pair.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

using namespace planar_motion;

constexpr std::array kParams{
    ParamSpec{.name = "ground",
              .type = ParamType::kString,
              .fallback = "plane",
              .choices = "plane|horizontal",
              .help = "a plane of any slope, or one that is also level (a floor): then the height "
                      "of O in G does not change either"},
    ParamSpec{.name = "sigma_tilt_rad",
              .type = ParamType::kNumber,
              .unit = "rad",
              .fallback = "0.001",
              .min = 0.,
              .min_exclusive = true,
              .help = "roll and pitch that the floor gives in an interval between two clones"},
    ParamSpec{.name = "sigma_height_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .fallback = "0.0005",
              .min = 0.,
              .min_exclusive = true,
              .help = "motion across the plane that the floor gives in an interval"},
    ParamSpec{.name = "sigma_tilt_rad_per_sqrt_m",
              .type = ParamType::kNumber,
              .unit = "rad/sqrt(m)",
              .fallback = "0.002",
              .min = 0.,
              .help = "roll and pitch on top of it that grow with the path"},
    ParamSpec{.name = "sigma_height_m_per_sqrt_m",
              .type = ParamType::kNumber,
              .unit = "m/sqrt(m)",
              .fallback = "0.001",
              .min = 0.,
              .help = "motion across the plane that grows with the path"},
    ParamSpec{.name = "gate_probability",
              .type = ParamType::kNumber,
              .fallback = "0.001",
              .min = 0.,
              .max = 0.5,
              .help = "intervals less likely than this are left out: the ground is no plane "
                      "there; 0: none"},
};

class PlanarMotion final : public Update {
 public:
  PlanarMotion(const ParamSet& params, const HostServices& /*services*/)
      : rows_(params.text("ground") == "horizontal" ? 4 : 3),
        sigma_tilt_rad_(params.number("sigma_tilt_rad")),
        sigma_height_m_(params.number("sigma_height_m")),
        sigma_tilt_rad_per_sqrt_m_(params.number("sigma_tilt_rad_per_sqrt_m")),
        sigma_height_m_per_sqrt_m_(params.number("sigma_height_m_per_sqrt_m")),
        gate_probability_(params.number("gate_probability")) {}

  void declare(Declarations& host) override { blocks_ = declare_wheels(host); }

  void update(const FilterView& filter, const EpochData& /*data*/, FactorSink& sink) override {
    // Each pair of neighbours comes once: when the second of them is new.
    if (filter.clones.size() < 2) return;
    const CloneView& first = filter.clones[filter.clones.size() - 2];
    const CloneView& last = filter.clones.back();
    const WheelsView wheels = blocks_.view(filter);
    const Extrinsics mount{wheels.R_ItoO, wheels.p_IinO};
    double path_m = 0.;
    const ImuPose at_first{first.R_GtoI, first.p_IinG};
    const ImuPose at_last{last.R_GtoI, last.p_IinG};
    const Rows off = off_plane(at_first, at_last, mount, &path_m);
    PairJacobian J;
    poses_jacobian({first.R_GtoI_fej, first.p_IinG_fej}, {last.R_GtoI_fej, last.p_IinG_fej}, mount,
                   J);
    mount_jacobian(at_first, at_last, mount, J);

    ResidualFactor& factor = sink.add_residual();
    factor.columns.add(first.column, kPoseSize);
    factor.columns.add(last.column, kPoseSize);
    const bool free_mount = wheels.extrinsics_column >= 0;
    if (free_mount) factor.columns.add(wheels.extrinsics_column, 3);
    factor.set_rows(rows_);
    factor.gate_probability = gate_probability_;
    factor.heavy_tailed = true;
    factor.residual = -off.head(rows_);  // (PM-8)
    factor.H = J.topLeftCorner(rows_, free_mount ? kColumns : 2 * kPoseSize);
    const auto variance = [path_m](double floor, double per_sqrt_m) {
      return floor * floor + path_m * per_sqrt_m * per_sqrt_m;  // (PM-9)
    };
    factor.R.diagonal().setConstant(variance(sigma_height_m_, sigma_height_m_per_sqrt_m_));
    factor.R.diagonal().head<2>().setConstant(
        variance(sigma_tilt_rad_, sigma_tilt_rad_per_sqrt_m_));
  }

 private:
  WheelsBlocks blocks_;
  int rows_;
  double sigma_tilt_rad_, sigma_height_m_;
  double sigma_tilt_rad_per_sqrt_m_, sigma_height_m_per_sqrt_m_;
  double gate_probability_;
};

VIWO_REGISTER(Update, PlanarMotion, "planar_motion", "1.0.0",
              "a base that drives on a plane turns about its normal only and stays on it",
              "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo
