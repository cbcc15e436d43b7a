// What the messages of one topic must satisfy, as the rows of the logs of
// viwo/log/stamp_filter.hpp.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bag.hpp"
#include "viwo/api/sensor.hpp"
#include "viwo/log/stamp_filter.hpp"

namespace viwo::bag {

class TopicFilter {
 public:
  /// `topic` is for error messages.
  TopicFilter(const log::LogLimits& limits, std::string topic);

  /// True for a stamp after all that were accepted before; others, and gaps, are counted.
  bool accept(std::int64_t t_ns, const Message& at);
  /// Counts a message that is dropped.
  void reject(const std::string& reason, const Message& at);
  /// At the end of the bag: InputError when nothing was accepted or too much was rejected.
  void finish(const std::string& bag) const;

  const std::vector<RejectionCount>& counts() const { return counts_; }
  const std::string& topic() const { return topic_; }

 private:
  void count(const std::string& reason, const Message& at);

  log::LogLimits limits_;
  std::string topic_;
  std::string gap_reason_;
  std::optional<std::int64_t> last_ns_;
  std::int64_t accepted_ = 0;
  std::int64_t rejected_ = 0;
  std::vector<RejectionCount> counts_;
};

}  // namespace viwo::bag
