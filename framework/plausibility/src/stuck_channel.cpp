#include "stuck_channel.hpp"

#include "viwo/api/measurement.hpp"

namespace viwo {

void StuckChannel::add(double value, std::int64_t t_ns, bool goes_on) {
  if (is_first_ || value != last_) {
    if (!is_first_) {
      ++n_changes_;
      n_steps_ += 1 + (repeated_ < kMostRepeated ? repeated_ : 0);
    }
    is_first_ = false;
    repeated_ = 0;
    since_ns_ = t_ns;
    last_ = value;
    return;
  }
  if (!goes_on) return;
  ++repeated_;
  const bool changes = n_changes_ >= kMostRepeated && 4 * n_changes_ >= 3 * n_steps_;
  const bool is_long = seconds_between(since_ns_, t_ns) >= kLongest_s;
  if (!changes || !is_long || repeated_ < kMostRepeated || repeated_ <= longest_) return;
  longest_ = repeated_;
  value_ = value;
  from_ns_ = since_ns_;
  to_ns_ = t_ns;
}

}  // namespace viwo
