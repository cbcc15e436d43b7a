#include "viwo/plausibility/periods.hpp"

#include <algorithm>
#include <vector>

#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {

std::string fault_of_times(std::span<const EncoderSample> wheels, double epoch_s) {
  const double span_s = seconds_between(wheels.front().begin_ns, wheels.back().end_ns);
  const auto epochs = static_cast<std::int64_t>(span_s / epoch_s);
  const std::string times =
      "are " + std::to_string(wheels.size()) + " in " + significant(span_s, 3) + " s";
  if (are_of_two_clocks(std::ssize(wheels), epochs)) {
    return times + ": their stamps are of two clocks, or of another unit";
  }
  std::vector<double> lasts_s;
  for (const EncoderSample& sample : wheels) {
    lasts_s.push_back(seconds_between(sample.begin_ns, sample.end_ns));
  }
  const auto middle = lasts_s.begin() + std::ssize(lasts_s) / 2;
  std::nth_element(lasts_s.begin(), middle, lasts_s.end());
  if (*middle > kLongestEncoderPeriod_s) {
    return "last " + significant(*middle, 3) +
           " s each: no sensor of a robot gives so few, the unit of their stamps is another one "
           "(time_unit)";
  }
  if (epochs <= kMostEpochs) return {};
  return times + ", at most " + std::to_string(kMostEpochs) + " times " + significant(epoch_s, 3) +
         " s: cut the recording (or, in a run, set odometry.epoch_s)";
}

}  // namespace viwo
