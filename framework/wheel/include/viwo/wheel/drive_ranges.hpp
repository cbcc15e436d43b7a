// What the drives read over a recording, to see one that is not connected, or not read, and what no
// encoder read.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "viwo/api/measurement.hpp"

namespace viwo {

/// The largest rate of all drives, forwards or backwards, rad/s.
inline double fastest_of(const EncoderSample& sample) {
  double fastest = 0.;
  for (const double rate : sample.drive_rad_per_s) fastest = std::max(fastest, std::abs(rate));
  return fastest;
}

class DriveRanges {
 public:
  explicit DriveRanges(int n_drive) : ranges_(static_cast<std::size_t>(n_drive)) {}

  void add(const EncoderSample& sample) {
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      ranges_[i].lowest = std::min(ranges_[i].lowest, sample.drive_rad_per_s[i]);
      ranges_[i].highest = std::max(ranges_[i].highest, sample.drive_rad_per_s[i]);
    }
  }
  /// The largest rate of all, forwards or backwards, rad/s.
  double fastest() const {
    double fastest = 0.;
    for (const Range& range : ranges_) {
      fastest = std::max({fastest, std::abs(range.lowest), std::abs(range.highest)});
    }
    return fastest;
  }
  /// Of the drive that changes most, rad/s.
  double largest_change() const {
    double change = 0.;
    for (const Range& range : ranges_) change = std::max(change, range.highest - range.lowest);
    return change;
  }
  /// Drives that read one number all the time, and which, rad/s.
  struct Stuck {
    std::size_t drive = 0;
    double value = 0.;
  };
  std::vector<Stuck> stuck() const {
    std::vector<Stuck> all;
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      if (ranges_[i].highest == ranges_[i].lowest) all.push_back({i, ranges_[i].lowest});
    }
    return all;
  }

 private:
  struct Range {
    double lowest = std::numeric_limits<double>::infinity();
    double highest = -lowest;
  };
  std::vector<Range> ranges_;
};

/// Rows of wheels that roll on a floor never agree to this part of their speed: encoders have steps
/// and floors are not flat. What a program commands does, and so do copies of one reading.
inline constexpr double kExactly = 1e-5;

inline constexpr const char* kSetpoints =
    "exactly, as no wheels do: what the program commanded (setpoints, targets) in place of what "
    "the "
    "encoders read, or a simulation without noise; of the robot it tells nothing";

/// Whether two drives read the same all the time.
inline bool has_copies(std::span<const EncoderSample> samples, int n_drive) {
  const auto n = static_cast<std::size_t>(n_drive);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = i + 1; k < n; ++k) {
      if (std::all_of(samples.begin(), samples.end(), [&](const EncoderSample& sample) {
            return sample.drive_rad_per_s[i] == sample.drive_rad_per_s[k];
          })) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace viwo
