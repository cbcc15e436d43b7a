// What a log must satisfy datum by datum: stamps that increase, values that are finite. Single bad
// data are dropped and counted; too many of them are an error.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "viwo/api/sensor.hpp"
#include "viwo/log/text_reader.hpp"

namespace viwo::log {

/// Limits on how bad a log may be.
struct LogLimits {
  double max_gap_s = 0.2;              ///< longer spacings are counted as gaps
  double max_rejected_fraction = 0.1;  ///< more rejected data than this are an InputError
};

inline constexpr const char* kStampNotAfter = "stamp not after the previous one";
inline constexpr const char* kLastLineCutShort = "last line cut short";
inline constexpr const char* kNotFinite = "value that is not finite";
inline constexpr const char* kIdTwice = "point whose id the image already has";
inline constexpr const char* kNotUnit = "quaternion that is not of unit norm";

class StampFilter {
 public:
  explicit StampFilter(const LogLimits& limits);

  /// True for a stamp after all stamps accepted before; otherwise it is rejected and counted. A gap
  /// before an accepted stamp is counted, too. `at` is at the datum.
  bool accept(std::int64_t t_ns, const TextReader& at);
  /// True also for the stamp that was accepted last: several data of one time.
  bool accept_or_same(std::int64_t t_ns, const TextReader& at);
  /// Counts a datum that is dropped.
  void reject(const std::string& reason, const TextReader& at);

  /// To be called once at the end of the file: InputError when nothing was accepted or more than
  /// max_rejected_fraction of the data were rejected. A last line that was left out counts.
  void finish(const TextReader& at);

  /// Rejected data and gaps by reason, in order of first occurrence.
  const std::vector<RejectionCount>& counts() const { return counts_; }

 private:
  void count(const std::string& reason, const TextReader& at);

  LogLimits limits_;
  std::string gap_reason_;
  std::optional<std::int64_t> last_ns_;
  std::int64_t accepted_ = 0;
  std::int64_t rejected_ = 0;
  std::vector<RejectionCount> counts_;
};

}  // namespace viwo::log
