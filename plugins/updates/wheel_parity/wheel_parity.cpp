// What the wheels contradict each other by, as information about the intrinsics: one information
// factor per epoch, linearised where prior and wheels meet. Equations: model.md beside this file.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "checked_encoders.hpp"
#include "curvature.hpp"
#include "encoder_intervals.hpp"
#include "encoders.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/wheel/wheel_noise.hpp"
#include "wheel_params.hpp"

namespace viwo {
namespace {

struct Params : WheelUpdateParams {
  double noise_scale = 1.;
  double period_s = 0.5;
  int max_iterations = 20;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(noise_scale),
      {.above = 0.,
       .help = "factor on the standard deviation of the parity noise, for encoders whose "
               "noise is not white"});
    b(VIWO_PARAM(period_s),
      {.unit = "s",
       .min = 0.,
       .help = "how much is taken together, at most what the clones reach over; 0: every "
               "epoch by itself"});
    b(VIWO_PARAM(max_iterations),
      {.min = 1, .max = 100, .help = "linearisations per interval at most; 1: a plain EKF update"});
    WheelUpdateParams::bind(b);
  }

  void make_exact() {
    WheelUpdateParams::make_exact();
    max_iterations = 1;
  }
};

using Square = IntrinsicMatrix;

/// Squared step, in units of the uncertainty after the update, below which no further linearisation
/// is needed.
constexpr double kConverged = 1e-2;

/// Information about a direction, relative to the prior, that is not worth being corrected for
/// curvature, and that is but rounding.
constexpr double kNegligibleInformation = 1e-4;
constexpr double kNoInformation = 1e-12;
/// Of the share that noise has in what an interval tells: taken so many of its sigmas larger.
constexpr double kShareSigmas = 2.;
/// Epochs do not come to the nanosecond: a period may end a little early.
constexpr double kPeriodSlackS = 0.02;

/// An interval has hundreds of contradictions: few of them tell the noise, and a gate on so many is
/// narrow, so that what is beyond it may be many times beyond.
constexpr int kFirstIntervals = 5;
constexpr double kBelievedIntervals = 3.;
constexpr double kRememberedIntervals = 20.;
constexpr double kMostNoise = 100.;
constexpr double kMostBeyond = 4.;

class WheelParity final : public Update {
 public:
  WheelParity(const Params& params, const HostServices& services) : params_(params) {
    if (services.exact) params_.make_exact();
    noise_.set_enabled(params_.find_noise);
    options_.twist.noise_weighted = true;
    options_.twist.motion_sigmas = params_.motion_sigmas;
    options_.parity_gate_probability = params.sample_gate_probability;
    options_.parity = true;
  }

  void declare(Declarations& host) override {
    blocks_ = declare_wheels(host);
    encoders_ = declare_encoders(host, blocks_);
  }

  void start(const UpdateSetup& /*setup*/) override {
    noise_.reset();
    checked_.start(wheel_model_of(blocks_), params_.wheel_check_probability);
    preintegrator_.emplace(wheel_model_of(blocks_), options_);
    if (noise_.enabled()) wheel_noise_.emplace(wheel_model_of(blocks_));
  }

  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    if (filter.clones.empty()) return;
    const WheelsView wheels = blocks_.view(filter);
    const auto samples = data.samples<EncoderSample>(encoders_);
    const std::optional<EncoderInterval> interval =
        intervals_.next(filter, wheels.t_OtoI_s, samples, params_.period_s - kPeriodSlackS);
    if (!interval.has_value()) return;
    if (wheels.intrinsics_column < 0 && wheels.wander_column < 0) return;
    if (!has_channels(preintegrator_->model().description(), samples.back())) {
      other_channels_.add(1, filter.clones.back().t_ns);
      return;
    }
    const auto encoders = checked_.next(samples, wheels, filter.P());
    if (wheel_noise_.has_value()) {
      for (const EncoderSample& y : encoders.last(checked_.n_new())) {
        wheel_noise_->add(y, wheels.x_WI, checked_.P_x());
      }
    }
    find_free(checked_.P_x());
    if (n_free_ == 0) return;
    const double gain = iterate(wheels.x_WI, encoders, *interval);
    if (std::isnan(gain)) {
      tallies_.add(pose_, data.end_ns);
      return;
    }
    // (WP-5): what no change of the intrinsics within their prior explains.
    const double dof = pose_.parity.dof;
    const double threshold = gate(dof);
    const bool believed = cost_ - gain <= threshold;
    if (++intervals_seen_ <= kFirstIntervals) {
      // Nothing is known well enough yet for the linearisation to be that good.
    } else if (believed) {
      noise_.add(noise_.variance() * (cost_ - gain) / dof);
    } else {
      noise_.add_beyond(std::min(cost_ - gain, kMostBeyond * threshold) / dof);
    }
    sink.count(believed ? 1 : 0, believed ? 0 : 1);
    if (!believed) {
      gated_.add(1, data.end_ns);  // one by one its samples mean nothing where it was linearised
      return;
    }
    tallies_.add(pose_, data.end_ns);
    ++intervals_used_;
    Square curvature = Square::Zero(n_free_, n_free_);
    if (params_.second_order_noise && --unchecked_ < 0) {
      curvature = intervals_alike(intervals_used_, wheels.wander_time_s, pose_.duration_s) *
                  second_order_noise(encoders, *interval);
    }
    weigh(curvature);
    emit(wheels, sink.add_information());
  }

  void rejections(std::vector<RejectionCount>& out) const override {
    other_channels_.append_to(out);
    intervals_.append_rejections(out);
    tallies_.append_rejections(out);
    gated_.append_to(out);
    checked_.append_rejections(out);
  }

  void noises(std::vector<NoiseFound>& out) const override {
    noise_.append_to("noise_scale", "", params_.noise_scale, out);
    if (wheel_noise_.has_value()) wheel_noise_->append_to(out);
  }

 private:
  /// The intrinsics that have a variance, their sigmas and correlations.
  void find_free(const IntrinsicMatrix& P) {
    n_free_ = 0;
    for (int i = 0; i < P.cols(); ++i) {
      if (P(i, i) > 0.) free_[static_cast<std::size_t>(n_free_++)] = i;
    }
    sigma_.resize(n_free_);
    C_.resize(n_free_, n_free_);
    for (int i = 0; i < n_free_; ++i) {
      sigma_[i] = std::sqrt(P(free(i), free(i)));
      for (int k = 0; k < n_free_; ++k) C_(i, k) = P(free(i), free(k)) / sigma_[i];
    }
    for (int k = 0; k < n_free_; ++k) C_.col(k) /= sigma_[k];
  }

  int free(int i) const { return free_[static_cast<std::size_t>(i)]; }

  /// Gauss-Newton until the step is small: Lambda_, eta_ and cost_ are then those of the last
  /// linearisation, at at_, but about x0. Returns by how much the best change lowers the cost; NaN
  /// when the interval tells nothing.
  double iterate(const Intrinsics& x0, std::span<const EncoderSample> encoders,
                 const EncoderInterval& interval) {
    Intrinsics& x = at_;
    x = x0;
    Intrinsics z_before = Intrinsics::Zero(n_free_);
    double gain = std::numeric_limits<double>::quiet_NaN();
    for (int i = 0; i < params_.max_iterations; ++i) {
      preintegrator_->set_intrinsics(x);
      preintegrator_->integrate(encoders, interval.begin_ns, interval.end_ns, pose_);
      if (pose_.parity.dof == 0. || !pose_.parity.eta.allFinite()) break;
      linearise(x0, x);
      // (WP-4): the step is C z in units of sigma.
      Square M = Lambda_ * C_;
      M.diagonal().array() += 1.;
      const Intrinsics z = M.partialPivLu().solve(eta_);
      const Intrinsics step = C_ * z;
      if (!step.allFinite()) break;
      gain = eta_.dot(step);
      if (i + 1 == params_.max_iterations) break;
      const Intrinsics change = z - z_before;
      const Intrinsics further = C_ * change;
      if (further.dot(Lambda_ * further) + change.dot(further) < kConverged) break;
      z_before = z;
      for (int k = 0; k < n_free_; ++k) x[free(k)] = x0[free(k)] + sigma_[k] * step[k];
    }
    return gain;
  }

  /// Of the parity information, which is that of the encoders' own noise.
  double parity_weight() const {
    return 1. / (params_.noise_scale * params_.noise_scale * noise_.variance());
  }

  /// `weight` times information of the free intrinsics, in units of their sigma.
  Square in_sigmas(const IntrinsicMatrix& information, double weight) const {
    Square out(n_free_, n_free_);
    for (int k = 0; k < n_free_; ++k) {
      for (int i = 0; i < n_free_; ++i) {
        out(i, k) = weight * sigma_[i] * sigma_[k] * information(free(i), free(k));
      }
    }
    return out;
  }

  /// (WP-1), (WP-2), (WP-3): the parity information at x as a cost of errors about x0, in units
  /// of sigma.
  void linearise(const Intrinsics& x0, const Intrinsics& x) {
    const ParityInformation& parity = pose_.parity;
    const double weight = parity_weight();
    Lambda_ = in_sigmas(parity.Lambda, weight);
    Intrinsics back(n_free_);
    Intrinsics eta_at_x(n_free_);
    for (int k = 0; k < n_free_; ++k) {
      eta_at_x[k] = weight * sigma_[k] * parity.eta[free(k)];
      back[k] = (x0[free(k)] - x[free(k)]) / sigma_[k];
    }
    const Intrinsics Lambda_back = Lambda_ * back;
    eta_ = -(eta_at_x + Lambda_back);
    cost_ = weight * parity.chi2 + back.dot(2. * eta_at_x + Lambda_back);
  }

  /// (WP-6): by how much the noise of eta_ grows for what the curvature makes of the prior
  /// uncertainty.
  Square second_order_noise(std::span<const EncoderSample> encoders,
                            const EncoderInterval& interval) {
    const Square L = directions_of(C_, eigen_);
    Square noise = Square::Zero(n_free_, n_free_);
    Intrinsics mean = Intrinsics::Zero(n_free_);
    for (int i = 0; i < n_free_; ++i) {
      Intrinsics x = at_;
      for (int k = 0; k < n_free_; ++k) x[free(k)] += kCurvatureStep * sigma_[k] * L(k, i);
      preintegrator_->move_intrinsics(x);
      preintegrator_->integrate(encoders, interval.begin_ns, interval.end_ns, moved_);
      const Square M =
          (in_sigmas(moved_.parity.Lambda, parity_weight()) - Lambda_) / kCurvatureStep;
      const Square h = M * L;
      noise += 0.5 * h * h.transpose();
      mean += 0.5 * h.col(i);
    }
    noise += mean * mean.transpose();
    if (!noise.allFinite()) noise.setZero();
    return noise;
  }

  /// (WP-7), (WP-8), (WP-9): Lambda_ and eta_ where eta_ has the noise `curvature` besides that of
  /// the encoders, and tells of the intrinsics only what the motion does.
  void weigh(const Square& curvature) {
    const bool bends = !curvature.isZero();
    const double negligible = bends ? kNegligibleInformation : kNoInformation;
    eigen_.compute(Lambda_);
    const Intrinsics information = eigen_.eigenvalues();
    int dropped = 0;  // directions that the interval tells next to nothing about
    while (dropped < n_free_ && information[dropped] <= negligible) ++dropped;
    const int kept = n_free_ - dropped;
    if (kept == 0) return;
    // Directions whitened: unit noise before the curvature adds to it.
    const Intrinsics root = information.tail(kept).cwiseSqrt();
    const Square to_eta = eigen_.eigenvectors().rightCols(kept) * root.asDiagonal();
    const Square to_white =
        root.cwiseInverse().asDiagonal() * eigen_.eigenvectors().rightCols(kept).transpose();
    const Square S = to_white * in_sigmas(pose_.parity.of_noise, 1.) * to_white.transpose();
    eigen_.compute(S);
    // The samples of one interval tell the share of noise only so well.
    const auto n = static_cast<double>(std::max<std::int64_t>(pose_.samples, 1));
    const double at_most = 1. + kShareSigmas * std::sqrt(2. / n);
    const Intrinsics told = (1. - at_most * eigen_.eigenvalues().array()).max(0.);
    const Square T = eigen_.eigenvectors() * told.asDiagonal() * eigen_.eigenvectors().transpose();
    Square TW = T;
    if (bends) {
      // The same curvature bends every interval the same way as long as the excitation is the same,
      // so that it does not average out: after K intervals its share is K times that of one, and
      // the last one adds the difference of Lambda K / (1 + K R) (WP-8).
      Square R = to_white * curvature * to_white.transpose();
      if (R.trace() < kNegligibleCurvature) unchecked_ = kIntervalsUnchecked;
      R.diagonal().array() += 1.;
      const Square once = R.llt().solve(Square::Identity(kept, kept));
      TW = T * once * once;
    } else if (unchecked_ < 0) {
      unchecked_ = kIntervalsUnchecked;
    }
    const Intrinsics white = to_white * eta_;
    eta_ = to_eta * (TW * white);
    Lambda_ = to_eta * TW * T * to_eta.transpose();
  }

  double gate(double dof) {
    if (params_.gate_probability <= 0.) return std::numeric_limits<double>::infinity();
    if (dof != gate_dof_) {
      gate_dof_ = dof;
      gate_ = chi2_quantile(1. - params_.gate_probability, dof);
    }
    return gate_;
  }

  /// Of what is constant, and the same of what wanders.
  void emit(const WheelsView& wheels, InformationFactor& factor) const {
    int times = 0;
    for (const int first_column : {wheels.intrinsics_column, wheels.wander_column}) {
      if (first_column < 0) continue;
      ++times;
      for (int i = 0; i < n_free_;) {
        int end = i + 1;
        while (end < n_free_ && free(end) == free(end - 1) + 1) ++end;
        factor.columns.add(first_column + free(i), end - i);
        i = end;
      }
    }
    for (int k = 0; k < times * n_free_; ++k) {
      const int b = k % n_free_;
      for (int i = 0; i < times * n_free_; ++i) {
        const int a = i % n_free_;
        factor.Lambda(i, k) = Lambda_(a, b) / (sigma_[a] * sigma_[b]);
      }
      factor.eta[k] = eta_[b] / sigma_[b];
    }
  }

  Params params_;
  PreintegrationOptions options_;

  WheelsBlocks blocks_;
  StreamId encoders_;
  Tally other_channels_{"interval left out: encoder samples without the channels of the model"};
  EncoderIntervals intervals_;
  CheckedEncoders checked_;
  NoiseScale noise_{kBelievedIntervals, kRememberedIntervals, kMostNoise};
  std::optional<WheelNoise> wheel_noise_;
  SampleTallies tallies_;
  Tally gated_{"interval dropped by the chi-square gate"};
  std::optional<Preintegrator> preintegrator_;
  double gate_ = 0.;
  double gate_dof_ = 0.;
  double intervals_used_ = 0.;
  int intervals_seen_ = 0;
  int unchecked_ = 0;  // intervals for which curvature needs no look

  // Of the interval at hand; entries of the free intrinsics, in units of their sigma.
  PreintegratedPose pose_, moved_;
  Intrinsics at_;  // where the last linearisation is
  std::array<int, kMaxIntrinsics> free_{};
  int n_free_ = 0;
  Intrinsics sigma_, eta_;
  Square C_, Lambda_;
  Eigen::SelfAdjointEigenSolver<Square> eigen_;
  double cost_ = 0.;
};

VIWO_REGISTER(Update, WheelParity, "wheel_parity", "1.0.0",
              "information about the wheel intrinsics from how the wheels contradict each other",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
