// Preintegrated relative planar pose between consecutive clones, as one residual factor per epoch,
// linearised where the measurement itself puts the calibration. Equations: model.md beside this
// file.
#include <algorithm>
#include <optional>
#include <span>

#include "checked_encoders.hpp"
#include "clock_rate.hpp"
#include "encoder_intervals.hpp"
#include "encoders.hpp"
#include "interval_factor.hpp"
#include "intrinsic_curvature.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo {
namespace {

using namespace wheel_odometry;

/// What the last linearisation may be off by, squared, in units of the noise (chi-square of 3).
constexpr double kConverged = 0.01;
/// What a linearisation must be off by less than the one before, squared, to be taken.
constexpr double kCloser = 0.25;

/// Where the iteration is.
struct Iterate {
  Point at;
  PreintegratedPose pose;
  Linearised factor;
  Eigen::Vector3d moved_back;  ///< residual, by the factor, at the prior
};

/// Prior and first estimates of an interval's states.
Interval interval_of(const WheelsView& wheels, const CloneState& first, const CloneState& last,
                     const Readings& readings) {
  const auto moving = [&](const CloneState& clone, std::int64_t cut_ns, bool fej) {
    const double after_s = seconds_between(clone.t_ns, cut_ns) + wheels.t_OtoI_s;  // (WO-2)
    return wheel_motion::moving_pose(clone, after_s, fej);
  };
  Interval interval;
  interval.start.first = moving(first, readings.begin_ns, false);
  interval.start.last = moving(last, readings.end_ns, false);
  interval.start.mount = {wheels.R_ItoO, wheels.p_IinO};
  interval.start.x_WI = wheels.x_WI;
  interval.first_fej = moving(first, readings.begin_ns, true);
  interval.last_fej = moving(last, readings.end_ns, true);
  return interval;
}

class WheelOdometry final : public Update {
 public:
  WheelOdometry(const Params& params, const HostServices& services) : params_(params) {
    if (services.exact) params_.make_exact();
    noise_.set_enabled(params_.find_noise);
    options_.twist.noise_weighted = params.twist == Params::TwistWeights::kNoise;
    options_.parity_gate_probability = params.sample_gate_probability;
    options_.parity = false;
    options_.twist.fitted_jacobian = true;
    options_.twist.motion_sigmas = params_.motion_sigmas;
  }

  void declare(Declarations& host) override {
    blocks_ = declare_wheels(host);
    encoders_ = declare_encoders(host, blocks_);
  }

  void start(const UpdateSetup& /*setup*/) override {
    noise_.reset();
    memory_ = {GroundTilt(params_.motion_sigmas), SmallTurn(params_.motion_sigmas), {}};
    checked_.start(wheel_model_of(blocks_), params_.wheel_check_probability);
    instrument_.emplace(wheel_model_of(blocks_), options_);
    curvature_.start(wheel_model_of(blocks_), options_);
  }

  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    if (filter.clones.empty()) return;
    const WheelsView wheels = blocks_.view(filter);
    const auto samples = data.samples<EncoderSample>(encoders_);
    const std::optional<EncoderInterval> cut = intervals_.next(filter, wheels.t_OtoI_s, samples);
    if (!cut.has_value()) return;
    if (!has_channels(instrument_->model().description(), samples.back())) {
      other_channels_.add(1, filter.clones.back().t_ns);
      return;
    }
    const Readings readings{checked_.next(samples, wheels, filter.P()), cut->begin_ns, cut->end_ns};
    const CloneState& first = filter.clones[cut->first_clone];
    const CloneState& last = filter.clones[cut->last_clone];
    Interval interval = interval_of(wheels, first, last, readings);
    instrument_->set_weights_at(wheels.x_WI);
    const std::optional<PreintegratedPose> pose = instrument_->pose(readings, wheels.x_WI);
    if (!pose) return;
    const WheelRate wheel_rate{instrument_->rate(readings, wheels.x_WI, *pose), pose->duration_s,
                               noise_.variance() * measurement_noise(params_, *pose).diagonal()};
    interval.rate = clock_rate(wheel_rate, interval.start, filter, data.imu);
    tallies_.add(*pose, last.t_ns);
    if (!(pose->bridged_s <= params_.max_bridged_s) || !is_finite(*pose)) {
      bridged_.add(1, last.t_ns);
      return;
    }
    ResidualFactor& factor = sink.add_residual();
    interval.states = add_states(wheels, filter.P(), first, last, factor.columns);
    const auto n = interval.states.n_intrinsics();
    if (n > 0) interval.by_yaw = memory_.hidden.at(instrument_->model(), wheels.x_WI);
    if (params_.second_order_noise) {
      interval.curvature_noise =
          curvature_.noise(readings.samples, readings.begin_ns, readings.end_ns, wheels.x_WI,
                           interval.states.P.bottomRightCorner(n, n), wheels.wander_time_s, *pose);
    }
    const IntervalFactor model(params_, memory_, interval);
    Iterate found = iterate(model, readings, *pose);
    if (params_.second_order_noise) model.add_second_order_noise(found.at, found.factor.R);
    fill(found, factor);
    const double yaw = found.pose.g[0];
    const double duration_s = found.pose.duration_s;
    const double yaw_variance = found.factor.R(0, 0) + found.factor.lasting[0];
    if (!is_noise(yaw, yaw_variance, params_.motion_sigmas)) memory_.hidden.add_turn();
    const double bias_variance =
        filter.P().diagonal().segment<3>(kGyroBiasColumn).mean();  // rad^2/s^2
    memory_.tilt.add(duration_s, yaw, found.factor.tilt, model.tilt_variance(found.at),
                     bias_variance);
    memory_.turn.add(duration_s, yaw, found.factor.R(0, 0), found.factor.lasting[0]);
  }

  void rejections(std::vector<RejectionCount>& out) const override {
    other_channels_.append_to(out);
    intervals_.append_rejections(out);
    tallies_.append_rejections(out);
    bridged_.append_to(out);
    checked_.append_rejections(out);
  }

  void noises(std::vector<NoiseFound>& out) const override {
    noise_.append_to("noise_scale", "", params_.noise_scale, out);
  }

 private:
  /// Gauss-Newton steps with the prior (WO-10).
  Iterate iterate(const IntervalFactor& model, const Readings& readings,
                  const PreintegratedPose& pose) {
    const Point& start = model.interval().start;
    const States::Square& P = model.interval().states.P;
    Iterate best{start, pose, model.linearise(start, pose), {}};
    best.moved_back = best.factor.residual;
    double missed = best.factor.size_of(best.moved_back);
    for (int i = 1; i < params_.max_iterations; ++i) {
      const Jacobian& H = best.factor.H;
      const Jacobian HP = H * P;
      Eigen::Matrix3d S = best.factor.R;
      S.noalias() += HP * H.transpose();
      const Step step = HP.transpose() * S.llt().solve(best.moved_back);
      if (!step.allFinite()) break;
      const Eigen::Vector3d predicted = best.moved_back - H * step;
      const Point at = model.moved(step);
      const std::optional<PreintegratedPose> moved = instrument_->pose(readings, at.x_WI);
      if (!moved || !is_finite(*moved)) break;
      const Linearised next = model.linearise(at, *moved);
      const double missed_before = missed;
      missed = next.size_of(next.residual - predicted);
      if (!(missed < std::max(kConverged, kCloser * missed_before))) break;  // leads astray
      best = {at, *moved, next, next.residual + next.H * step};
      if (missed < kConverged) break;
    }
    return best;
  }

  void fill(const Iterate& found, ResidualFactor& factor) {
    const Jacobian& H = found.factor.H;
    factor.set_rows(3);
    factor.H.leftCols(H.cols()) = H;
    const auto wandering = factor.H.cols() - H.cols();
    factor.H.rightCols(wandering) = H.rightCols(wandering);
    factor.residual.head<3>() = found.moved_back;
    factor.R = found.factor.R;
    factor.gate_probability = params_.gate_probability;
    factor.heavy_tailed = true;
    factor.noise = noise_.enabled() ? &noise_ : nullptr;
  }

  Params params_;
  PreintegrationOptions options_;

  WheelsBlocks blocks_;
  StreamId encoders_;
  Tally other_channels_{"interval left out: encoder samples without the channels of the model"};
  EncoderIntervals intervals_;
  CheckedEncoders checked_;
  // Slip comes and goes within seconds.
  NoiseScale noise_{10., 30., 100.};
  SampleTallies tallies_;
  Tally bridged_{"interval left out: too long without believable encoder samples"};
  std::optional<Instrument> instrument_;
  IntrinsicCurvature curvature_;
  Memory memory_;
};

VIWO_REGISTER(Update, WheelOdometry, "wheel_odometry", "1.0.0",
              "relative planar pose between clones, preintegrated from the wheel encoders",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
