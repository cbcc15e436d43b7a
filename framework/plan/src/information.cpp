#include "viwo/plan/information.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "viwo/api/status.hpp"
#include "viwo/wheel/held_gauge.hpp"

namespace viwo::plan {
namespace {

constexpr std::int64_t kSegment_ns = 1'000'000'000;
/// Length of the pieces whose straight lines add up to the path, as in the fit (CAL-13).
constexpr std::int64_t kPathPiece_ns = 50'000'000;
/// A base that spins or stands has no way to be longer or shorter.
constexpr double kNoWay_m = 1e-6;

Eigen::MatrixXd known_before(const WheelModel& model) {
  return prior_in_held_frame(model, model.nominal(), model.drawn_sigma());
}

PreintegrationOptions preintegration() {
  PreintegrationOptions options;
  options.twist.noise_weighted = true;
  return options;
}

}  // namespace

void KnowledgeParams::bind(ParamBinder& b) {
  b(VIWO_PARAM(gyro), {.help = "whether the turn is measured by a gyro"});
  b(VIWO_PARAM(sigma_gyro_rad_per_s_sqrt_hz),
    {.unit = "rad/s/sqrt(Hz)", .above = 0., .help = "its noise"});
  b(VIWO_PARAM(prior_sigma_gyro_bias_rad_per_s),
    {.unit = "rad/s", .above = 0., .help = "prior of its bias, one for the drive"});
  b(VIWO_PARAM(distance),
    {.help = "whether the path of O over the whole drive is measured (label distance_m of the "
             "recording)"});
  b(VIWO_PARAM(sigma_distance_m), {.unit = "m", .above = 0., .help = "how well"});
  b(VIWO_PARAM(wheel_noise_scale),
    {.above = 0.,
     .help = "how much larger the noise of the wheels is than the model's sigmas say, e.g. the "
             "parity residual of an earlier calibration"});
}

Intrinsics sigma_before(const WheelModel& model) {
  return known_before(model).diagonal().cwiseSqrt();
}

Information Information::zero(int n_intrinsics) {
  return {Eigen::MatrixXd::Zero(n_intrinsics + 1, n_intrinsics + 1),
          Eigen::VectorXd::Zero(n_intrinsics + 1)};
}

Information& Information::operator+=(const Information& other) {
  N += other.N;
  path += other.path;
  return *this;
}

Information& Information::operator*=(double factor) {
  N *= factor;
  path *= factor;
  return *this;
}

WheelInformation::WheelInformation(std::shared_ptr<const WheelModel> model,
                                   const KnowledgeParams& known)
    : model_(std::move(model)), known_(known), preintegrator_(model_, preintegration()) {
  preintegrator_.set_intrinsics(model_->nominal());
  set_known(known_before(*model_));
}

void WheelInformation::set_known(const Eigen::MatrixXd& P) {
  const Intrinsics prior = model_->prior_sigma();
  std::vector<int> free;
  for (int i = 0; i < prior.size(); ++i) {
    if (prior[i] > 0. && P(i, i) > 0.) free.push_back(i);
  }
  const Eigen::VectorXd scale = prior(free);
  const Eigen::MatrixXd inverse = scale.cwiseInverse().asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> llt(inverse * P(free, free) * inverse);
  if (llt.info() != Eigen::Success) throw InputError("a covariance that is not positive definite");
  const auto n = static_cast<Eigen::Index>(free.size());
  constexpr double kHeld = 1e12;
  before_.setIdentity(prior.size() + 1, prior.size() + 1);
  before_.diagonal().head(prior.size()).setConstant(kHeld);
  const Eigen::MatrixXd information = llt.solve(Eigen::MatrixXd::Identity(n, n));
  before_(free, free) = information;
}

Information WheelInformation::of(std::span<const EncoderSample> samples, std::int64_t begin_ns,
                                 std::int64_t end_ns) {
  const int n = model_->n_intrinsics();
  Information out = Information::zero(n);
  add_turns_and_parity(samples, begin_ns, end_ns, out);
  add_path(samples, begin_ns, end_ns, out);
  Eigen::VectorXd prior(n + 1);
  prior << model_->prior_sigma(), known_.prior_sigma_gyro_bias_rad_per_s;
  out.N = prior.asDiagonal() * out.N * prior.asDiagonal();
  out.path = prior.cwiseProduct(out.path);
  return out;
}

/// (PL-1) without the scaling by the prior.
void WheelInformation::add_turns_and_parity(std::span<const EncoderSample> samples,
                                            std::int64_t begin_ns, std::int64_t end_ns,
                                            Information& out) {
  const int n = model_->n_intrinsics();
  const double wheel_variance = known_.wheel_noise_scale * known_.wheel_noise_scale;
  const double gyro_variance =
      known_.sigma_gyro_rad_per_s_sqrt_hz * known_.sigma_gyro_rad_per_s_sqrt_hz;
  const std::int64_t count = 1 + (end_ns - begin_ns - 1) / kSegment_ns;
  for (std::int64_t k = 0; k < count; ++k) {
    const std::int64_t from_ns = begin_ns + (end_ns - begin_ns) * k / count;
    const std::int64_t to_ns = begin_ns + (end_ns - begin_ns) * (k + 1) / count;
    if (!preintegrator_.integrate(samples, from_ns, to_ns, segment_)) {
      throw std::logic_error("the samples do not cover the motion");
    }
    out.N.topLeftCorner(n, n) += segment_.parity.Lambda / wheel_variance;
    if (!known_.gyro) continue;
    Eigen::VectorXd turn(n + 1);
    turn << segment_.J_g_WI.row(0).transpose(), segment_.duration_s;
    const double variance =
        wheel_variance * segment_.P_g(0, 0) + gyro_variance * segment_.duration_s;
    out.N += turn * turn.transpose() / variance;
  }
}

void WheelInformation::add_path(std::span<const EncoderSample> samples, std::int64_t begin_ns,
                                std::int64_t end_ns, Information& out) {
  const int n = model_->n_intrinsics();
  for (std::int64_t t_ns = begin_ns; t_ns < end_ns; t_ns += kPathPiece_ns) {
    preintegrator_.integrate(samples, t_ns, std::min(t_ns + kPathPiece_ns, end_ns), segment_);
    const double length_m = segment_.g.tail<2>().norm();
    if (!(length_m > kNoWay_m)) continue;
    out.path.head(n) +=
        segment_.J_g_WI.bottomRows<2>().transpose() * segment_.g.tail<2>() / length_m;
  }
}

Eigen::MatrixXd WheelInformation::covariance(const Information& drive) const {
  const Eigen::Index size = drive.N.rows();
  Eigen::MatrixXd N = before_ + drive.N;  // (PL-2)
  if (known_.distance) {
    N += drive.path * drive.path.transpose() / (known_.sigma_distance_m * known_.sigma_distance_m);
  }
  return N.llt().solve(Eigen::MatrixXd::Identity(size, size));
}

Intrinsics WheelInformation::sigma(const Information& drive) const {
  const Eigen::MatrixXd P = covariance(drive);
  return model_->prior_sigma().cwiseProduct(
      Intrinsics(P.diagonal().head(model_->n_intrinsics()).cwiseSqrt()));
}

}  // namespace viwo::plan
