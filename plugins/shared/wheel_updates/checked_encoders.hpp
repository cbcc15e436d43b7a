// The encoder samples of an update, without the channels that the other wheels contradict.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "viwo/api/update.hpp"
#include "viwo/wheel/wheel_check.hpp"

namespace viwo {

/// Looks at each sample once, when it comes.
class CheckedEncoders {
 public:
  void start(std::shared_ptr<const WheelModel> model, double probability) {
    check_.emplace(std::move(model), probability);
    samples_.clear();
    n_new_ = 0;
    newest_ns_ = std::numeric_limits<std::int64_t>::min();
  }

  /// `encoders`, which reach from the oldest clone to behind the end of the epoch, at the present
  /// calibration.
  std::span<const EncoderSample> next(std::span<const EncoderSample> encoders,
                                      const WheelsView& wheels, const FilterView::Covariance& P) {
    const auto known = [this](const EncoderSample& y) { return y.t_ns <= newest_ns_; };
    const auto first_new = std::partition_point(encoders.begin(), encoders.end(), known);
    n_new_ = static_cast<std::size_t>(encoders.end() - first_new);
    if (!encoders.empty()) newest_ns_ = std::max(newest_ns_, encoders.back().t_ns);
    P_x_ = wheels.covariance(P);
    if (!check_->is_on()) return encoders;
    const auto is_old = [&](const EncoderSample& y) {
      return encoders.empty() || y.t_ns < encoders.front().t_ns;
    };
    samples_.erase(samples_.begin(),
                   std::partition_point(samples_.begin(), samples_.end(), is_old));
    check_->set_calibration(wheels.x_WI, P_x_);
    for (auto y = first_new; y != encoders.end(); ++y) {
      samples_.push_back(*y);
      check_->check(samples_.back());
    }
    return samples_;
  }

  /// How many of the last samples of next() are new.
  std::size_t n_new() const { return n_new_; }
  /// Covariance of the intrinsics, zero where they are held.
  const IntrinsicMatrix& P_x() const { return P_x_; }

  void append_rejections(std::vector<RejectionCount>& out) const { check_->rejections(out); }

 private:
  std::optional<WheelCheck> check_;
  std::vector<EncoderSample> samples_;
  std::size_t n_new_ = 0;
  std::int64_t newest_ns_ = std::numeric_limits<std::int64_t>::min();
  IntrinsicMatrix P_x_;
};

}  // namespace viwo
