// The encoder samples of an update, without the channels that the other wheels contradict.
#pragma once

#include <algorithm>
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
  }

  /// `encoders`, which reach from the oldest clone to behind the end of the epoch, at the present
  /// calibration.
  std::span<const EncoderSample> next(std::span<const EncoderSample> encoders,
                                      const WheelsView& wheels, const FilterView::Covariance& P) {
    const auto is_old = [&](const EncoderSample& y) {
      return encoders.empty() || y.t_ns < encoders.front().t_ns;
    };
    samples_.erase(samples_.begin(),
                   std::partition_point(samples_.begin(), samples_.end(), is_old));
    const auto n = wheels.x_WI.size();
    IntrinsicMatrix P_x = IntrinsicMatrix::Zero(n, n);
    const int first = wheels.intrinsics_column;
    if (first >= 0) P_x = P.block(first, first, n, n);
    check_->set_calibration(wheels.x_WI, P_x);
    for (std::size_t i = samples_.size(); i < encoders.size(); ++i) {
      samples_.push_back(encoders[i]);
      check_->check(samples_.back());
    }
    return samples_;
  }

  void append_rejections(std::vector<RejectionCount>& out) const { check_->rejections(out); }

 private:
  std::optional<WheelCheck> check_;
  std::vector<EncoderSample> samples_;
};

}  // namespace viwo
