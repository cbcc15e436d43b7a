// Preintegrated relative planar pose between consecutive clones, as one residual factor per epoch,
// linearised where the measurement itself puts the calibration. Equations: model.md beside this
// file.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include <Eigen/Cholesky>

#include "checked_encoders.hpp"
#include "encoder_intervals.hpp"
#include "encoders.hpp"
#include "ground_tilt.hpp"
#include "intrinsic_curvature.hpp"
#include "relative_pose.hpp"
#include "small_turn.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/math/so3.hpp"
#include "wheel_odometry_params.hpp"

namespace viwo {
namespace {

using namespace wheel_motion;
using wheel_odometry::Params;

constexpr int kMaxColumns = kGeometrySize + 2 * kMaxIntrinsics;
static_assert(kMaxColumns <= kMaxFactorColumns);
using Step = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxColumns, 1>;
using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxColumns>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxColumns,
                             kMaxColumns>;
using GeometryMatrix = Eigen::Matrix<double, kGeometrySize, kGeometrySize>;

/// Steps for the second derivatives, of the mount (rad, m) and the time offset (s). The Jacobian is
/// nearly quadratic in them, so that they may be large.
constexpr double kSecondDerivativeStep = 1e-4;

/// For the derivative by time, ns: the rates of a few encoder samples are averaged.
constexpr std::int64_t kShiftNs = 50'000'000;

/// What the last linearisation may be off by, squared, in units of the noise (chi-square of 3).
constexpr double kConverged = 0.01;
/// What a linearisation must be off by less than the one before, squared, to be taken.
constexpr double kCloser = 0.25;

/// Where a factor is linearised.
struct Point {
  MovingPose first, last;
  Extrinsics mount;
  Intrinsics x_WI;
};

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
    ground_tilt_ = wheel_odometry::GroundTilt(options_.twist.motion_sigmas);
    small_turn_ = wheel_odometry::SmallTurn(options_.twist.motion_sigmas);
    checked_.start(wheel_model_of(blocks_), params_.wheel_check_probability);
    preintegrator_.emplace(wheel_model_of(blocks_), options_);
    shifted_preintegrator_.emplace(wheel_model_of(blocks_), options_);
    curvature_.start(wheel_model_of(blocks_), options_);
  }

  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    if (filter.clones.empty()) return;
    const WheelsView wheels = blocks_.view(filter);
    const auto samples = data.samples<EncoderSample>(encoders_);
    const std::optional<EncoderInterval> interval =
        intervals_.next(filter, wheels.t_OtoI_s, samples);
    if (!interval.has_value()) return;
    if (!has_channels(preintegrator_->model().description(), samples.back())) {
      other_channels_.add(1, filter.clones.back().t_ns);
      return;
    }
    const auto encoders = checked_.next(samples, wheels, filter.P());
    const CloneState& first = filter.clones[interval->first_clone];
    const CloneState& last = filter.clones[interval->last_clone];
    set_start(wheels, first, last, *interval);
    if (!measure(encoders, *interval, at_)) return;
    measure_rate(encoders, *interval);
    tallies_.add(pose_, last.t_ns);
    if (!(pose_.bridged_s <= params_.max_bridged_s) || !pose_.g.allFinite() ||
        !pose_.P_g.allFinite()) {
      bridged_.add(1, last.t_ns);
      return;
    }
    ResidualFactor& factor = sink.add_residual();
    set_columns(wheels, filter.P(), first, last, factor.columns);
    if (params_.second_order_noise) {
      const auto n = P_.cols() - n_geometry_;
      curvature_noise_ = curvature_.noise(encoders, interval->begin_ns, interval->end_ns, at_.x_WI,
                                          P_.bottomRightCorner(n, n), wheels.wander_time_s, pose_);
    }
    iterate(wheels, encoders, *interval, factor);
    ground_tilt_.add(pose_.duration_s, pose_.g[0], tilt_, tilt_variance());
    small_turn_.add(pose_.duration_s, pose_.g[0], R_(0, 0), lasting_[0]);
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
  /// Prior estimate of the factor's states, and the first estimates for its Jacobian.
  void set_start(const WheelsView& wheels, const CloneState& first, const CloneState& last,
                 const EncoderInterval& interval) {
    const auto moving = [&](const CloneState& clone, std::int64_t cut_ns, bool fej) {
      const double after_s = seconds_between(clone.t_ns, cut_ns) + wheels.t_OtoI_s;  // (WO-2)
      return moving_pose(clone, after_s, fej);
    };
    start_.first = moving(first, interval.begin_ns, false);
    start_.last = moving(last, interval.end_ns, false);
    start_.mount = {wheels.R_ItoO, wheels.p_IinO};
    start_.x_WI = wheels.x_WI;
    first_fej_ = moving(first, interval.begin_ns, true);
    last_fej_ = moving(last, interval.end_ns, true);
    at_ = start_;
    preintegrator_->set_weights_at(wheels.x_WI);
    shifted_preintegrator_->set_weights_at(wheels.x_WI);
  }

  bool measure(std::span<const EncoderSample> encoders, const EncoderInterval& interval,
               const Point& point) {
    preintegrator_->set_intrinsics(point.x_WI);
    return preintegrator_->integrate(encoders, interval.begin_ns, interval.end_ns, pose_);
  }

  /// How the relative pose changes when both instants move on: of the encoders themselves, whose
  /// rates are less noisy than those of the IMU (WO-13). From the clones where samples are missing.
  void measure_rate(std::span<const EncoderSample> encoders, const EncoderInterval& interval) {
    shifted_preintegrator_->set_intrinsics(at_.x_WI);
    const bool covered = shifted_preintegrator_->integrate(encoders, interval.begin_ns - kShiftNs,
                                                           interval.end_ns - kShiftNs, shifted_);
    rate_is_wheels_ = covered && shifted_.g.allFinite() && shifted_.bridged_s == 0.;
    g_rate_ = rate_is_wheels_
                  ? Eigen::Vector3d((pose_.g - shifted_.g) / (1e-9 * kShiftNs))
                  : Eigen::Vector3d(
                        relative_pose_jacobian(at_.first, at_.last, at_.mount).col(kTimeOffset));
  }

  /// Columns of what the filter estimates, and where they stand in the geometry and in x_WI.
  void set_columns(const WheelsView& wheels, const FilterView::Covariance& P,
                   const CloneState& first, const CloneState& last, FactorColumns& columns) {
    n_geometry_ = 0;
    const auto add = [&](int column, int count, int geometry) {
      if (column < 0) return;
      columns.add(column, count);
      for (int i = 0; i < count; ++i)
        geometry_[static_cast<std::size_t>(n_geometry_++)] = geometry + i;
    };
    add(first.column, kPoseSize, kFirstTheta);
    add(last.column, kPoseSize, kLastTheta);
    add(wheels.extrinsics_column, kPoseSize, kMountTheta);
    add(wheels.time_offset_column, 1, kTimeOffset);
    const auto n = static_cast<int>(wheels.x_WI.size());
    for (const int column : {wheels.intrinsics_column, wheels.wander_column}) {
      if (column >= 0) columns.add(column, n);
    }
    // The prior of just these columns.
    P_.resize(columns.size(), columns.size());
    int row = 0;
    for (const ColumnRange rows : columns.blocks()) {
      int col = 0;
      for (const ColumnRange cols : columns.blocks()) {
        P_.block(row, col, rows.count, cols.count) =
            P.block(rows.first, cols.first, rows.count, cols.count);
        col += cols.count;
      }
      row += rows.count;
    }
    // What is constant of the intrinsics and what wanders have the same derivatives: they are one
    // here, their sum.
    if (const int sum = n_geometry_ + n; row > sum) {
      P_.middleCols(n_geometry_, n) += P_.rightCols(n);
      P_.middleRows(n_geometry_, n) += P_.bottomRows(n);
      P_.conservativeResize(sum, sum);
    }
    geometry_P_.setZero();
    for (int i = 0; i < n_geometry_; ++i) {
      for (int k = 0; k < n_geometry_; ++k) {
        geometry_P_(geometry_[static_cast<std::size_t>(i)],
                    geometry_[static_cast<std::size_t>(k)]) = P_(i, k);
      }
    }
  }

  /// (WO-8): residual and Jacobian at at_, and the noise of pose_.
  void linearise() {
    residual_ = pose_.g - relative_pose(at_.first, at_.last, at_.mount, &tilt_);
    const Motion motion = complete_motion(pose_.g, tilt_);
    residual_.tail<2>() += motion.d.head<2>() - pose_.g.tail<2>();
    residual_[0] = std::remainder(residual_[0], 2. * M_PI);
    MovingPose first = first_fej_;
    MovingPose last = last_fej_;
    first.after_s = at_.first.after_s;
    last.after_s = at_.last.after_s;
    geometry_jacobian_ = relative_pose_jacobian(first, last, at_.mount);
    set_noise();
    // What the mount shows is proportional to the motion. Taken at the noisy first estimates it
    // would count their noise as motion, and so as information: it is taken at the motion that the
    // wheels measured, with a tilt that intervals before tell.
    const Eigen::Vector3d& p_IinO = at_.mount.p_IinO;
    const CalibrationJacobian measured = calibration_jacobian(pose_.g, tilt_, g_rate_, p_IinO);
    const auto n = P_.cols() - n_geometry_;
    lasting_ =
        (pose_.J_g_WI * P_.bottomRightCorner(n, n)).cwiseProduct(pose_.J_g_WI).rowwise().sum();
    Eigen::Vector3d motion_of_O = planar_part(pose_.g, R_.diagonal() + lasting_);
    if (motion_of_O[0] == 0.) motion_of_O[0] = small_turn_.expected(pose_.duration_s);
    const CalibrationJacobian moving =
        calibration_jacobian(motion_of_O, moving_tilt(), moving_rate(), p_IinO);
    geometry_jacobian_.rightCols<kCalibrationSize>() = moving;
    H_.resize(3, P_.cols());
    for (int k = 0; k < n_geometry_; ++k) {
      H_.col(k) = geometry_jacobian_.col(geometry_[static_cast<std::size_t>(k)]);
    }
    if (n > 0) H_.rightCols(n) = -pose_.J_g_WI;
    // What the calibration may be off by, through columns that are not in the Jacobian, is noise.
    if (measured == moving) return;
    const CalibrationJacobian D = measured - moving;
    R_ += ground_tilt_.alike() * D *
          geometry_P_.bottomRightCorner<kCalibrationSize, kCalibrationSize>() * D.transpose();
  }

  /// (WO-9)
  void set_noise() {
    const double path = pose_.path_length_m;
    const auto square = [](double x) { return x * x; };
    R_ = square(params_.noise_scale) * pose_.P_g + curvature_noise_;
    R_(0, 0) +=
        square(params_.sigma_floor_yaw_rad) + path * square(params_.sigma_yaw_rad_per_sqrt_m);
    for (int i = 1; i < 3; ++i) {
      R_(i, i) += square(params_.sigma_floor_position_m) +
                  path * square(params_.sigma_position_m_per_sqrt_m);
    }
  }

  /// (WO-15): zero where its noise alone explains all of it.
  template <class Vector, class Variance>
  Vector moving_part(const Vector& measured, const Variance& variance) const {
    for (Eigen::Index i = 0; i < measured.size(); ++i) {
      if (!is_noise(measured[i], variance[i], options_.twist.motion_sigmas)) return measured;
    }
    return Vector::Zero();
  }

  /// Turning and moving of [yaw, x, y], each by itself.
  Eigen::Vector3d planar_part(const Eigen::Vector3d& g, const Eigen::Vector3d& variance) const {
    using Turn = Eigen::Matrix<double, 1, 1>;
    Eigen::Vector3d part;
    part << moving_part(Turn(g.head<1>()), variance),
        moving_part(Eigen::Vector2d(g.tail<2>()), variance.tail<2>());
    return part;
  }

  /// Free of the noise of this interval.
  Eigen::Vector2d moving_tilt() const {
    return options_.twist.motion_sigmas > 0. ? ground_tilt_.expected(pose_.duration_s) : tilt_;
  }

  /// Of the roll, or the pitch, of O from one clone to the other.
  double tilt_variance() const {
    const Eigen::Matrix<double, 2, kGeometrySize> J = tilt_jacobian(at_.first, at_.last, at_.mount);
    return 0.5 * (J * geometry_P_ * J.transpose()).trace();
  }

  /// Of the rates of the encoders: two intervals that share all but the shift at both ends. Those
  /// of the IMU are too noisy to teach anything.
  Eigen::Vector3d moving_rate() const {
    if (options_.twist.motion_sigmas <= 0.) return g_rate_;
    if (!rate_is_wheels_) return Eigen::Vector3d::Zero();
    const double shift_s = 1e-9 * kShiftNs;
    const double apart = std::min(shift_s / pose_.duration_s, 1.);
    return planar_part(g_rate_, Eigen::Vector3d(2. * apart / (shift_s * shift_s) * R_.diagonal()));
  }

  /// at_ = start_ (+) step.
  void move(const Step& step) {
    Eigen::Matrix<double, kGeometrySize, 1> d = Eigen::Matrix<double, kGeometrySize, 1>::Zero();
    for (int k = 0; k < n_geometry_; ++k) d[geometry_[static_cast<std::size_t>(k)]] = step[k];
    at_.first.R_GtoI = exp_so3(-d.segment<3>(kFirstTheta)) * start_.first.R_GtoI;
    at_.first.p_IinG = start_.first.p_IinG + d.segment<3>(kFirstPosition);
    at_.last.R_GtoI = exp_so3(-d.segment<3>(kLastTheta)) * start_.last.R_GtoI;
    at_.last.p_IinG = start_.last.p_IinG + d.segment<3>(kLastPosition);
    at_.mount.R_ItoO = exp_so3(-d.segment<3>(kMountTheta)) * start_.mount.R_ItoO;
    at_.mount.p_IinO = start_.mount.p_IinO + d.segment<3>(kMountPosition);
    at_.first.after_s = start_.first.after_s + d[kTimeOffset];
    at_.last.after_s = start_.last.after_s + d[kTimeOffset];
    const auto n = step.size() - n_geometry_;
    if (n > 0) at_.x_WI = start_.x_WI + step.tail(n);
  }

  /// Gauss-Newton steps with the prior, then the factor of the last linearisation (WO-10).
  void iterate(const WheelsView& wheels, std::span<const EncoderSample> encoders,
               const EncoderInterval& interval, ResidualFactor& factor) {
    linearise();
    Step step = Step::Zero(P_.cols());
    Eigen::Vector3d moved_back = residual_;
    double missed = residual_.dot(R_.llt().solve(residual_));
    for (int i = 1; i < params_.max_iterations; ++i) {
      const Jacobian HP = H_ * P_;
      Eigen::Matrix3d S = R_;
      S.noalias() += HP * H_.transpose();
      const Step next = HP.transpose() * S.llt().solve(moved_back);
      const Eigen::Vector3d predicted = moved_back - H_ * next;
      if (!next.allFinite()) break;
      const PreintegratedPose before = pose_;
      const Point from = at_;
      const double missed_before = missed;
      move(next);
      if (measure(encoders, interval, at_) && pose_.g.allFinite() && pose_.P_g.allFinite()) {
        linearise();
        const Eigen::Vector3d off = residual_ - predicted;
        missed = off.dot(R_.llt().solve(off));
      } else {
        missed = std::numeric_limits<double>::infinity();
      }
      if (!(missed < std::max(kConverged, kCloser * missed_before))) {  // leads astray
        pose_ = before;
        at_ = from;
        linearise();
        break;
      }
      step = next;
      moved_back = residual_ + H_ * step;
      if (missed < kConverged) break;
    }
    if (params_.second_order_noise) add_second_order_noise(wheels);
    factor.set_rows(3);
    factor.H.leftCols(H_.cols()) = H_;
    const auto wandering = factor.H.cols() - H_.cols();
    factor.H.rightCols(wandering) = H_.rightCols(wandering);
    factor.residual.head<3>() = moved_back;
    factor.R = R_;
    factor.gate_probability = params_.gate_probability;
    factor.heavy_tailed = true;
    factor.noise = noise_.enabled() ? &noise_ : nullptr;
  }

  /// (WO-11), for the mount and the time offset, crossed with all of the geometry.
  void add_second_order_noise(const WheelsView& wheels) {
    if (wheels.extrinsics_column < 0 && wheels.time_offset_column < 0) return;
    std::array<GeometryMatrix, 3>& second = second_derivative_;
    for (GeometryMatrix& D : second) D.setZero();
    const PoseJacobian here = relative_pose_jacobian(at_.first, at_.last, at_.mount);
    for (int k = kMountTheta; k < kGeometrySize; ++k) {
      Extrinsics mount = at_.mount;
      MovingPose first = at_.first;
      MovingPose last = at_.last;
      Eigen::Vector3d d = Eigen::Vector3d::Zero();
      if (k == kTimeOffset) {
        first.after_s += kSecondDerivativeStep;
        last.after_s += kSecondDerivativeStep;
      } else {
        d[k % 3] = kSecondDerivativeStep;
        if (k < kMountPosition) {
          mount.R_ItoO = exp_so3(-d) * mount.R_ItoO;
        } else {
          mount.p_IinO += d;
        }
      }
      const PoseJacobian change =
          (relative_pose_jacobian(first, last, mount) - here) / kSecondDerivativeStep;
      for (int a = 0; a < 3; ++a) {
        GeometryMatrix& D = second[static_cast<std::size_t>(a)];
        D.row(k) = change.row(a);
        D.col(k) = change.row(a).transpose();
      }
    }
    for (GeometryMatrix& D : second) D = (D * geometry_P_).eval();
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b <= a; ++b) {
        const double trace = second[static_cast<std::size_t>(a)]
                                 .cwiseProduct(second[static_cast<std::size_t>(b)].transpose())
                                 .sum();
        R_(a, b) += 0.5 * trace;
        R_(b, a) = R_(a, b);
      }
    }
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
  std::optional<Preintegrator> preintegrator_, shifted_preintegrator_;

  // Of the interval at hand.
  PreintegratedPose pose_, shifted_;
  Eigen::Vector3d g_rate_ = Eigen::Vector3d::Zero();  // rad/s, m/s
  bool rate_is_wheels_ = false;                       // else it is that of the IMU
  Point start_, at_;
  MovingPose first_fej_, last_fej_;
  std::array<int, kGeometrySize> geometry_{};  // the factor's leading columns in a PoseJacobian
  int n_geometry_ = 0;
  Square P_;
  GeometryMatrix geometry_P_ = GeometryMatrix::Zero();  // of the geometry, zero where held
  Eigen::Vector3d residual_ = Eigen::Vector3d::Zero();
  Eigen::Vector2d tilt_ = Eigen::Vector2d::Zero();  // [roll, pitch] of O over the interval
  wheel_odometry::GroundTilt ground_tilt_;
  wheel_odometry::SmallTurn small_turn_;
  Eigen::Vector3d lasting_ = Eigen::Vector3d::Zero();  // variance of pose_.g by the intrinsics
  wheel_odometry::IntrinsicCurvature curvature_;
  Eigen::Matrix3d curvature_noise_ = Eigen::Matrix3d::Zero();
  PoseJacobian geometry_jacobian_ = PoseJacobian::Zero();
  Jacobian H_;
  Eigen::Matrix3d R_ = Eigen::Matrix3d::Zero();
  std::array<GeometryMatrix, 3> second_derivative_{};
};

VIWO_REGISTER(Update, WheelOdometry, "wheel_odometry", "1.0.0",
              "relative planar pose between clones, preintegrated from the wheel encoders",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
