// Cuts the stream of encoder samples at the clones of the filter: which interval of the wheel clock
// belongs between which two clones, so that every sample is used exactly once even while the time
// offset is being estimated (wheel_odometry/model.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tally.hpp"
#include "viwo/api/update.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo {

/// Encoder time [begin_ns, end_ns] (wheel clock) between two clones of FilterView::clones.
struct EncoderInterval {
  std::size_t first_clone = 0;
  std::size_t last_clone = 0;
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
};

/// Yields the intervals, one epoch after the other. The first cut is made where the clock offset
/// says that a clone is; each interval begins where the last one ended. What one epoch cannot use
/// because samples are late belongs to the next interval, as long as its first clone lives.
class EncoderIntervals {
 public:
  /// The interval that ends now, if the samples reach; the next one begins at its end. It is put
  /// off while it is shorter than `at_least_s` and its first clone stays. The filter must have at
  /// least one clone.
  std::optional<EncoderInterval> next(const FilterView& filter, double t_OtoI_s,
                                      std::span<const EncoderSample> encoders,
                                      double at_least_s = 0.) {
    const CloneState& now = filter.clones.back();
    ++epochs_;
    ++waited_;
    const std::int64_t cut_ns = now.t_ns - to_ns(t_OtoI_s);  // (WO-1)
    if (!started_) {
      start_at(now, cut_ns);
      return std::nullopt;
    }
    const std::optional<std::size_t> first = find_start(filter);
    if (!first.has_value()) {
      clone_left_.add(waited_, now.t_ns);
      start_at(now, cut_ns);
      return std::nullopt;
    }
    if (encoders.empty() || encoders.back().end_ns < cut_ns || cut_ns <= begin_ns_ ||
        *first + 1 == filter.clones.size()) {
      return std::nullopt;
    }
    const bool last_chance = *first == 0 && filter.oldest_leaves;
    if (!last_chance && seconds_between(begin_ns_, cut_ns) < at_least_s) return std::nullopt;
    if (encoders.front().begin_ns > begin_ns_) {
      no_samples_.add(waited_, now.t_ns);
      start_at(now, cut_ns);
      return std::nullopt;
    }
    const EncoderInterval interval{*first, filter.clones.size() - 1, begin_ns_, cut_ns};
    start_at(now, cut_ns);
    return interval;
  }

  void append_rejections(std::vector<RejectionCount>& out) const {
    clone_left_.append_to(out, epochs_);
    no_samples_.append_to(out, epochs_);
  }

 private:
  void start_at(const CloneState& clone, std::int64_t cut_ns) {
    started_ = true;
    start_t_ns_ = clone.t_ns;
    start_slot_ = clone.slot;
    begin_ns_ = cut_ns;
    waited_ = 0;
  }

  std::optional<std::size_t> find_start(const FilterView& filter) const {
    for (std::size_t i = filter.clones.size(); i-- > 0;) {
      const CloneState& clone = filter.clones[i];
      if (clone.t_ns == start_t_ns_ && clone.slot == start_slot_) return i;
    }
    return std::nullopt;
  }

  bool started_ = false;
  std::int64_t epochs_ = 0, waited_ = 0;  // in all; since the interval began
  std::int64_t start_t_ns_ = 0;
  int start_slot_ = 0;
  std::int64_t begin_ns_ = 0;  // wheel clock
  Tally clone_left_{
      "epochs lost: the encoder samples came when the first clone had left (estimator.max_wait_s)"};
  Tally no_samples_{"epochs lost: the encoder samples begin after them"};
};

/// What the preintegration of an interval left out.
class SampleTallies {
 public:
  void add(const PreintegratedPose& pose, std::int64_t t_ns) {
    samples_ += pose.samples;
    rejected_.add(pose.rejected, t_ns);
    gated_.add(pose.gated, t_ns);
    rank_deficient_.add(pose.rank_deficient, t_ns);
  }
  void append_rejections(std::vector<RejectionCount>& out) const {
    rejected_.append_to(out, samples_);
    gated_.append_to(out);
    rank_deficient_.append_to(out);
  }

 private:
  std::int64_t samples_ = 0;
  Tally rejected_{
      "encoder sample refused by the kinematic model, or with no wheel to be believed (bridged)"};
  Tally gated_{"encoder sample whose wheels contradict each other (bridged)"};
  Tally rank_deficient_{"encoder sample that does not tell the whole twist (used)"};
};

/// The host's kinematic model, which outlives the updates, as the wheel module wants it.
inline std::shared_ptr<const WheelModel> wheel_model_of(const WheelsBlocks& wheels) {
  return std::make_shared<const WheelModel>(
      std::shared_ptr<const KinematicModel>(wheels.model, [](const KinematicModel*) {}));
}

}  // namespace viwo
