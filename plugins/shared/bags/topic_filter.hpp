// The order of stamps (viwo/api/stamp_order.hpp) of the messages of one topic.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bag.hpp"
#include "viwo/api/stamp_order.hpp"

namespace viwo::bag {

class TopicFilter {
 public:
  /// `topic` is for error messages.
  TopicFilter(const LogLimits& limits, const std::string& topic)
      : topic_(topic), order_(limits, topic + ": ") {}

  /// True for a stamp after all that were accepted before; others, and gaps, are counted.
  bool accept(std::int64_t t_ns, const Message& at) { return order_.accept(t_ns, Place{at}); }
  /// Counts a message that is dropped.
  void reject(std::string_view reason, const Message& at) { order_.reject(reason, Place{at}); }
  /// The same for the message that was accepted last.
  void reject_last(std::string_view reason, const Message& at) {
    order_.reject_last(reason, Place{at});
  }
  /// The same for one that says itself that it has nothing to say.
  void leave_out(std::string_view reason, const Message& at) {
    order_.leave_out(reason, Place{at});
  }
  /// At the end of the bag: InputError when nothing was accepted or too much was rejected; `lost`
  /// is said where there is nothing.
  void finish(const std::string& bag, const std::string& lost) const;

  const std::vector<RejectionCount>& counts() const { return order_.counts(); }
  const std::string& topic() const { return topic_; }

 private:
  struct Place {
    const Message& at;
    std::string operator()() const;
  };

  std::string topic_;
  StampOrder order_;
};

}  // namespace viwo::bag
