#include "covariance_track.hpp"

#include <cmath>
#include <utility>

namespace viwo::observability {
namespace {

constexpr int kEpochsPerSample = 5;

}  // namespace

CovarianceTrack::CovarianceTrack(std::vector<int> columns, Eigen::VectorXd prior_sigma,
                                 EstimatorObserver* next)
    : columns_(std::move(columns)), prior_sigma_(std::move(prior_sigma)), next_(next) {}

void CovarianceTrack::on_clone(const Filter& filter, const ImuMatrix& Phi) {
  if (next_ != nullptr) next_->on_clone(filter, Phi);
  if (epoch_ == 0) begin_ns_ = filter.t_ns();
  if (epoch_++ % kEpochsPerSample != 0) return;
  const Eigen::MatrixXd P = filter.covariance()(columns_, columns_);
  const Eigen::VectorXd unit = prior_sigma_.cwiseInverse();
  P_.emplace_back(unit.asDiagonal() * P * unit.asDiagonal());
  t_s_.push_back(seconds_between(begin_ns_, filter.t_ns()));
}

void CovarianceTrack::on_factor(const Filter& filter, const UpdateEntry& update,
                                const ResidualFactor& factor) {
  if (next_ != nullptr) next_->on_factor(filter, update, factor);
}

void CovarianceTrack::on_factor(const Filter& filter, const UpdateEntry& update,
                                const InformationFactor& factor) {
  if (next_ != nullptr) next_->on_factor(filter, update, factor);
}

SigmaOverTime CovarianceTrack::along(const Eigen::MatrixXd& hidden) const {
  SigmaOverTime out;
  out.t_s = t_s_;
  const auto n = static_cast<double>(columns_.size());
  const auto k = static_cast<double>(hidden.cols());
  for (const Eigen::MatrixXd& P : P_) {
    const double along = k > 0. ? (hidden.transpose() * P * hidden).trace() : 0.;
    out.hidden.push_back(k > 0. ? std::sqrt(along / k) : std::nan(""));
    out.others.push_back(n > k ? std::sqrt((P.trace() - along) / (n - k)) : std::nan(""));
  }
  return out;
}

}  // namespace viwo::observability
