#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "feed.hpp"
#include "sources.hpp"
#include "stream.hpp"

namespace viwo::experiment {
namespace {

class RecordedFeed final : public Feed {
 public:
  RecordedFeed(const RunSetup& setup, const RunData& data)
      : setup_(setup), data_(data), tracks_name_(data.tracks_name) {
    for (const WheelSet& wheels : setup.filter->wheels) {
      wheels_.push_back(&encoder_samples(data, wheels.sensor));
    }
    next_wheel_.resize(wheels_.size(), 0);
    poses_.resize(setup.filter->pose_sensors.size(), nullptr);
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      if (!is_measured(*setup.filter, k)) continue;
      poses_[k] = &pose_samples(data, setup.filter->pose_sensors[k]);
    }
    next_pose_.resize(poses_.size(), 0);
    for (const SensorStream& stream : data.streams) {
      streams_.push_back(std::make_unique<Prefetch>(stream));
    }
  }

  bool next(Estimator& estimator) override {
    const std::int64_t first = first_stamp();
    for (const auto& stream : streams_) {
      const Measurement* head = stream->head();
      // Behind what was recorded at the same stamp.
      if (head != nullptr && stamp_ns(*head) < first && is_first(*stream)) {
        add_streamed(*stream, estimator);
        return true;
      }
    }
    if (first == kNone) return false;
    // Before the IMU of the same stamp: nothing waits for poses.
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      if (poses_[k] == nullptr || stamp(*poses_[k], next_pose_[k]) != first) continue;
      estimator.add((*poses_[k])[next_pose_[k]++], static_cast<int>(k));
      return true;
    }
    if (stamp(data_.imu, next_imu_) == first) {
      estimator.add(data_.imu[next_imu_++]);
      return true;
    }
    for (std::size_t k = 0; k < wheels_.size(); ++k) {
      if (stamp(*wheels_[k], next_wheel_[k]) != first) continue;
      estimator.add((*wheels_[k])[next_wheel_[k]++], static_cast<int>(k));
      return true;
    }
    estimator.add(data_.images[next_image_++]);
    return true;
  }

  void finish(RunResult& result) override {
    result.reference = data_.reference;
    for (const auto& stream : streams_) {
      stream->stop();
      // Not part of the time of an epoch: it passes beside it.
      result.stages.emplace_back("sensor " + stream->name(), stage_time(stream->ms_per_stamp()));
      for (RejectionCount& rejection : stream->rejections()) {
        result.rejections.emplace_back(stream->name(), std::move(rejection));
      }
    }
  }

 private:
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();

  template <class Sample>
  static std::int64_t stamp(const std::vector<Sample>& samples, std::size_t i) {
    return i < samples.size() ? samples[i].t_ns : kNone;
  }

  /// Of everything that was recorded.
  std::int64_t first_stamp() const {
    std::int64_t first = std::min(stamp(data_.imu, next_imu_), stamp(data_.images, next_image_));
    for (std::size_t k = 0; k < wheels_.size(); ++k) {
      first = std::min(first, stamp(*wheels_[k], next_wheel_[k]));
    }
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      if (poses_[k] != nullptr) first = std::min(first, stamp(*poses_[k], next_pose_[k]));
    }
    return first;
  }

  /// Whether no other stream has an earlier stamp.
  bool is_first(Prefetch& stream) const {
    const std::int64_t t_ns = stamp_ns(*stream.head());
    return std::all_of(streams_.begin(), streams_.end(), [t_ns](const auto& other) {
      const Measurement* head = other->head();
      return head == nullptr || stamp_ns(*head) >= t_ns;
    });
  }

  void add_streamed(Prefetch& stream, Estimator& estimator) {
    const auto* image = std::get_if<FeatureSample>(stream.head());
    if (image == nullptr) {
      throw InputError("sensor '" + stream.name() +
                       "', which takes an input, gives something else than tracks of features - "
                       "only those are used while the filter runs");
    }
    claim(tracks_name_, stream.name(), kTracks, setup_.sensors_mark);
    estimator.add(*image);
    stream.pop();
  }

  const RunSetup& setup_;
  const RunData& data_;
  std::string tracks_name_;
  std::vector<const std::vector<EncoderSample>*> wheels_;
  std::vector<std::size_t> next_wheel_;
  std::vector<const std::vector<PoseSample>*> poses_;  // null: nobody uses them
  std::vector<std::size_t> next_pose_;
  std::size_t next_imu_ = 0;
  std::size_t next_image_ = 0;
  std::vector<std::unique_ptr<Prefetch>> streams_;
};

}  // namespace

std::unique_ptr<Feed> feed_recorded(const RunSetup& setup, const RunData& data) {
  return std::make_unique<RecordedFeed>(setup, data);
}

}  // namespace viwo::experiment
