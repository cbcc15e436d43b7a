// The wheel measurement of the paper as it is published: the preintegrated relative pose between
// consecutive clones, linearised once and at the measured readings. Equations: model.md beside this
// file. What the paper does not say is a parameter; wheel_odometry is what to use on a robot.
#include <cmath>
#include <optional>
#include <span>

#include "encoder_intervals.hpp"
#include "encoders.hpp"
#include "increment.hpp"
#include "relative_pose.hpp"
#include "tally.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

using namespace wheel_motion;
using namespace wheel_relative_pose;

struct Params {
  double gate_probability = 0.05;
  double residual_gate_m_per_s = 0.;
  double sigma_floor_yaw_rad = 0.;
  double sigma_floor_position_m = 0.;
  std::string reading = "from_stamp";
  std::string jacobian_at = "measured";
  double rank_tolerance = 0.;
  double max_hold_s = 0.05;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(gate_probability),
      {.min = 0.,
       .max = 0.5,
       .help = "intervals less likely than this are left out (the paper's alpha, which it "
               "does not give); 0: none"});
    b(VIWO_PARAM(residual_gate_m_per_s),
      {.unit = "m/s",
       .min = 0.,
       .help = "readings with a larger |e_perp| are replaced by the one before (the paper "
               "gives no threshold); 0: none"});
    b(VIWO_PARAM(sigma_floor_yaw_rad),
      {.unit = "rad",
       .min = 0.,
       .help = "yaw noise of each interval on top of the encoders' (the paper has one of "
               "a size that it does not give)"});
    b(VIWO_PARAM(sigma_floor_position_m),
      {.unit = "m",
       .min = 0.,
       .help = "position noise of each interval on top of the encoders', per axis (as "
               "sigma_floor_yaw_rad)"});
    b(VIWO_PARAM(reading),
      {.choices = "from_stamp|cell",
       .help = "how long a reading holds: from its stamp to the next, as published; or over "
               "the time around the stamp that it stands for"});
    b(VIWO_PARAM(jacobian_at),
      {.choices = "measured|fitted",
       .help = "the readings at which the twist is differentiated: the measured ones, as "
               "published; or those that the twist predicts"});
    b(VIWO_PARAM(rank_tolerance),
      {.min = 0.,
       .max = 0.5,
       .help = "twists that the rows do not tell are taken as zero with 0.1 m/s, see "
               "docs/math/wheel_odometry.md, W-3; 0: the plain inverse, as published"});
    b(VIWO_PARAM(max_hold_s),
      {.unit = "s",
       .min = 0.,
       .help = "intervals in which one reading would have to do for longer are left out"});
  }
};

IncrementOptions read_options(const Params& params, bool exact) {
  IncrementOptions options;
  options.twist.fitted_jacobian = params.jacobian_at == "fitted";
  options.twist.rank_tolerance = params.rank_tolerance;
  options.holds_from_stamp = params.reading == "from_stamp";
  options.residual_gate_m_per_s = exact ? 0. : params.residual_gate_m_per_s;
  return options;
}

class WheelRelativePose final : public Update {
 public:
  WheelRelativePose(const Params& params, const HostServices& services)
      : params_(params), options_(read_options(params, services.exact)) {}

  void declare(Declarations& host) override {
    blocks_ = declare_wheels(host);
    if (blocks_.wander.index >= 0) {
      throw InputError("takes the intrinsics as constant: wheels.intrinsics_wander must be 0");
    }
    encoders_ = declare_encoders(host, blocks_);
  }

  void start(const UpdateSetup& /*setup*/) override {
    integrator_.emplace(wheel_model_of(blocks_), options_);
  }

  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    if (filter.clones.size() < 2) return;
    const CloneState& first = filter.clones[filter.clones.size() - 2];
    const CloneState& last = filter.clones.back();
    const WheelsView wheels = blocks_.view(filter);
    const auto encoders = data.samples<EncoderSample>(encoders_);
    if (!encoders.empty() && !has_channels(integrator_->model().description(), encoders.back())) {
      other_channels_.add(1, last.t_ns);
      return;
    }
    if (!measure(wheels, first, last, encoders)) return;
    add_factor(wheels, first, last, sink.add_residual());
  }

  void rejections(std::vector<RejectionCount>& out) const override {
    for (const Tally* tally : {&other_channels_, &uncovered_, &held_, &refused_, &gated_}) {
      tally->append_to(out);
    }
  }

 private:
  /// g between two clones, at the present estimate of calibration and clock (RP-1).
  bool measure(const WheelsView& wheels, const CloneState& first, const CloneState& last,
               std::span<const EncoderSample> encoders) {
    const std::int64_t offset_ns = to_ns(wheels.t_OtoI_s);
    integrator_->set_intrinsics(wheels.x_WI);
    if (!integrator_->integrate(encoders, first.t_ns - offset_ns, last.t_ns - offset_ns,
                                increment_)) {
      uncovered_.add(1, last.t_ns);
      return false;
    }
    refused_.add(increment_.refused, last.t_ns);
    gated_.add(increment_.gated, last.t_ns);
    if (!(increment_.longest_hold_s <= params_.max_hold_s) || !increment_.g.allFinite() ||
        !increment_.P_g.allFinite()) {
      held_.add(1, last.t_ns);
      return false;
    }
    return true;
  }

  /// (RP-9)
  void add_factor(const WheelsView& wheels, const CloneState& first, const CloneState& last,
                  ResidualFactor& factor) {
    const Extrinsics mount{wheels.R_ItoO, wheels.p_IinO};
    const PoseJacobian by_state = relative_pose_jacobian(
        moving_pose(first, 0., true), moving_pose(last, 0., true), mount);  // (RP-8)
    factor.columns.add(first.column, kPoseSize);
    factor.columns.add(last.column, kPoseSize);
    if (wheels.extrinsics_column >= 0) factor.columns.add(wheels.extrinsics_column, kPoseSize);
    if (wheels.time_offset_column >= 0) factor.columns.add(wheels.time_offset_column, 1);
    const auto n = increment_.J_g_WI.cols();
    if (wheels.intrinsics_column >= 0) {
      factor.columns.add(wheels.intrinsics_column, static_cast<int>(n));
    }
    factor.set_rows(3);
    factor.H.leftCols<kMountTheta>() = by_state.leftCols<kMountTheta>();
    Eigen::Index column = kMountTheta;
    if (wheels.extrinsics_column >= 0) {
      factor.H.middleCols<kPoseSize>(column) = by_state.middleCols<kPoseSize>(kMountTheta);
      column += kPoseSize;
    }
    if (wheels.time_offset_column >= 0) factor.H.col(column) = by_state.col(kTimeOffset);
    if (wheels.intrinsics_column >= 0) factor.H.rightCols(n) = -increment_.J_g_WI;

    factor.residual = increment_.g - relative_pose(moving_pose(first, 0., false),
                                                   moving_pose(last, 0., false), mount);  // (RP-7)
    factor.residual[0] = std::remainder(factor.residual[0], 2. * M_PI);
    const Eigen::Vector3d floor(params_.sigma_floor_yaw_rad, params_.sigma_floor_position_m,
                                params_.sigma_floor_position_m);
    factor.R = increment_.P_g;
    factor.R += floor.cwiseAbs2().asDiagonal();
    factor.gate_probability = params_.gate_probability;  // (RP-10)
  }

  Params params_;
  IncrementOptions options_;

  WheelsBlocks blocks_;
  StreamId encoders_;
  std::optional<IncrementIntegrator> integrator_;
  Increment increment_;

  Tally other_channels_{"interval left out: encoder samples without the channels of the model"};
  Tally uncovered_{"interval left out: the encoder samples do not reach over it"};
  Tally held_{"interval left out: one encoder sample would have to do for too long"};
  Tally refused_{"encoder sample without a twist (replaced by the one before)"};
  Tally gated_{"encoder sample beyond residual_gate_m_per_s (replaced by the one before)"};
};

VIWO_REGISTER(Update, WheelRelativePose, "wheel_relative_pose", "1.0.0",
              "the wheel measurement of the paper as published: relative pose between clones",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
