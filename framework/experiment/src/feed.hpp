// Hands what the sensors of a run gave to the estimator.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "stream.hpp"
#include "viwo/experiment/run.hpp"

namespace viwo::experiment {

/// All measurements of a run, handed to the estimator in the order of their stamps.
class Feed {
 public:
  Feed(const RunSetup& setup, const RunData& data) : data_(data) {
    for (const WheelSet& wheels : setup.filter->wheels) {
      const auto other = data.other_wheels.find(wheels.sensor);
      wheels_.push_back(other != data.other_wheels.end() ? &other->second : &data.samples);
    }
    next_wheel_.resize(wheels_.size(), 0);
    poses_.resize(setup.filter->pose_sensors.size(), nullptr);
    for (const FilterSetup::Entry& update : setup.filter->updates) {
      if (update.poses < 0) continue;
      const auto stream = static_cast<std::size_t>(update.poses);
      const auto found = data.poses.find(setup.filter->pose_sensors[stream]);
      if (found != data.poses.end()) poses_[stream] = &found->second;
    }
    next_pose_.resize(poses_.size(), 0);
    for (const SensorStream& stream : data.streams) {
      streams_.push_back(std::make_unique<Prefetch>(stream));
    }
  }

  /// Sensors that are read while the filter runs.
  std::span<const std::unique_ptr<Prefetch>> streams() const { return streams_; }

  /// False when there is nothing left.
  bool next(Estimator& estimator) {
    constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
    const auto stamp = [](const auto& samples, std::size_t i) {
      return i < samples.size() ? samples[i].t_ns : kNone;
    };
    std::int64_t first = std::min(stamp(data_.imu, next_imu_), stamp(data_.images, next_image_));
    for (std::size_t k = 0; k < wheels_.size(); ++k) {
      first = std::min(first, stamp(*wheels_[k], next_wheel_[k]));
    }
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      if (poses_[k] != nullptr) first = std::min(first, stamp(*poses_[k], next_pose_[k]));
    }
    Prefetch* streamed = nullptr;
    for (const auto& stream : streams_) {
      const Measurement* head = stream->head();
      if (head == nullptr || stamp_ns(*head) >= first) continue;
      first = stamp_ns(*head);
      streamed = stream.get();
    }
    if (streamed != nullptr) {
      add_streamed(*streamed, estimator);
      return true;
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

 private:
  static void add_streamed(Prefetch& stream, Estimator& estimator) {
    const auto* image = std::get_if<FeatureSample>(stream.head());
    if (image == nullptr) {
      throw InputError("sensor '" + stream.name() +
                       "', which takes an input, gives something else than tracks of features - "
                       "only those are used while the filter runs");
    }
    estimator.add(*image);
    stream.pop();
  }

  const RunData& data_;
  std::vector<const std::vector<EncoderSample>*> wheels_;
  std::vector<std::size_t> next_wheel_;
  std::vector<const std::vector<PoseSample>*> poses_;  // null: none, or nobody uses them
  std::vector<std::size_t> next_pose_;
  std::size_t next_imu_ = 0;
  std::size_t next_image_ = 0;
  std::vector<std::unique_ptr<Prefetch>> streams_;
};

/// Estimator::step(); what a kinematic model throws becomes the cause of a run that failed.
inline bool step(Estimator& estimator, std::string& cause) {
  try {
    return estimator.step();
  } catch (const PluginFailure& failure) {
    cause = std::string(failure.what()) + " (epoch " + std::to_string(estimator.epochs() + 1) + ")";
    return false;
  }
}

}  // namespace viwo::experiment
