// Readers of one topic each, for the kinds of messages.
#pragma once

#include <memory>
#include <string>

#include "bag.hpp"
#include "bag_options.hpp"
#include "bag_samples.hpp"
#include "messages.hpp"
#include "topic_filter.hpp"

namespace viwo::bag {

class TopicReader {
 public:
  TopicReader(const BagOptions& options, const std::string& topic)
      : TopicReader(options, topic, options.limits()) {}
  virtual ~TopicReader() = default;

  /// BrokenMessage when it is not what it says to be.
  virtual void take(FieldReader& in, const Message& message) = 0;
  void reject(const std::string& reason, const Message& message) {
    filter_.reject(reason, message);
  }
  /// Appends what was read; InputError when it is too little, with what the bag has `lost`.
  void finish(const std::string& bag, const std::string& lost, BagSamples& out);

 protected:
  TopicReader(const BagOptions& options, const std::string& topic, const LogLimits& limits)
      : filter_(limits, topic), by_reception_(options.by_reception()) {}
  virtual void move_samples(BagSamples& out) = 0;
  /// Before the number of messages is judged.
  virtual void check(const std::string& /*bag*/) const {}
  std::int64_t stamp(std::int64_t header_ns, const Message& message) const {
    return by_reception_ ? message.received_ns : header_ns;
  }

  TopicFilter filter_;

 private:
  bool by_reception_;
};

std::unique_ptr<TopicReader> make_imu_reader(const BagOptions& options);
std::unique_ptr<TopicReader> make_pose_reader(const BagOptions& options, Kind kind);
std::unique_ptr<TopicReader> make_joint_reader(const BagOptions& options, Kind kind);
std::unique_ptr<TopicReader> make_fix_reader(const BagOptions& options);
std::unique_ptr<TopicReader> make_image_reader(const BagOptions& options, Kind kind, int camera,
                                               const std::shared_ptr<const Bag>& bag);

}  // namespace viwo::bag
