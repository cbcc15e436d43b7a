// A base that drives on a plane: between two clones the odometry frame O turns about its z axis
// only and does not leave its x-y plane. Equations: model.md.

#include "planar_pair.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

using namespace planar_motion;

struct Params {
  std::string ground = "plane";
  double sigma_tilt_rad = 0.001;
  double sigma_height_m = 0.0005;
  double sigma_tilt_rad_per_sqrt_m = 0.002;
  double sigma_height_m_per_sqrt_m = 0.001;
  double gate_probability = 0.001;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(ground),
      {.choices = "plane|horizontal",
       .help = "a plane of any slope, or one that is also level (a floor): then the height "
               "of O in G does not change either"});
    b(VIWO_PARAM(sigma_tilt_rad),
      {.unit = "rad",
       .above = 0.,
       .help = "roll and pitch that the floor gives in an interval between two clones"});
    b(VIWO_PARAM(sigma_height_m),
      {.unit = "m",
       .above = 0.,
       .help = "motion across the plane that the floor gives in an interval"});
    b(VIWO_PARAM(sigma_tilt_rad_per_sqrt_m),
      {.unit = "rad/sqrt(m)",
       .min = 0.,
       .help = "roll and pitch on top of it that grow with the path"});
    b(VIWO_PARAM(sigma_height_m_per_sqrt_m),
      {.unit = "m/sqrt(m)", .min = 0., .help = "motion across the plane that grows with the path"});
    b(VIWO_PARAM(gate_probability),
      {.min = 0.,
       .max = 0.5,
       .help = "intervals less likely than this are weighed down (F-32): the ground is no plane "
               "there; 0: none"});
  }
};

class PlanarMotion final : public Update {
 public:
  PlanarMotion(const Params& params, const HostServices& /*services*/)
      : params_(params), rows_(params.ground == "horizontal" ? 4 : 3) {}

  void declare(Declarations& host) override { blocks_ = declare_wheels(host); }

  void update(const FilterView& filter, const EpochData& /*data*/, FactorSink& sink) override {
    // Each pair of neighbours comes once: when the second of them is new.
    if (filter.clones.size() < 2) return;
    const CloneState& first = filter.clones[filter.clones.size() - 2];
    const CloneState& last = filter.clones.back();
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
    factor.gate_probability = params_.gate_probability;
    factor.heavy_tailed = true;
    factor.residual = -off.head(rows_);  // (PM-8)
    factor.H = J.topLeftCorner(rows_, free_mount ? kColumns : 2 * kPoseSize);
    const auto variance = [path_m](double floor, double per_sqrt_m) {
      return floor * floor + path_m * per_sqrt_m * per_sqrt_m;  // (PM-9)
    };
    factor.R.diagonal().setConstant(
        variance(params_.sigma_height_m, params_.sigma_height_m_per_sqrt_m));
    factor.R.diagonal().head<2>().setConstant(
        variance(params_.sigma_tilt_rad, params_.sigma_tilt_rad_per_sqrt_m));
  }

 private:
  Params params_;
  WheelsBlocks blocks_;
  int rows_;
};

VIWO_REGISTER(Update, PlanarMotion, "planar_motion", "1.0.0",
              "a base that drives on a plane turns about its normal only and stays on it",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
