// What the data of one source must satisfy, whatever it is read from: stamps that increase. Single
// bad data are dropped and counted; too many of them are an error.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "viwo/api/export.hpp"
#include "viwo/api/rejections.hpp"

namespace viwo {

/// No stamp is further from zero, which is 126 years: differences, and a few seconds more, stay
/// within 64 bits.
inline constexpr std::int64_t kMaxStampNs = 4'000'000'000'000'000'000;

/// Says of increasing stamps which are not to be believed: one far ahead of the last, until another
/// one is behind it. Taken as it comes, a single broken stamp would make all that follow late. Who
/// has paused is believed the next time, for twice as long.
class StampJump {
 public:
  /// Far is more than `far_s`, and more than `times` the longest spacing so far: sources whose data
  /// are further apart have shown it before.
  explicit StampJump(double far_s = 10., std::uint64_t times = 10)
      : far_ns_(static_cast<std::uint64_t>(1e9 * far_s)), times_(times) {}

  /// `t_ns`: after the last stamp that was believed.
  bool is_believed(std::int64_t t_ns) {
    const bool is_confirmed = suspect_ns_ && t_ns > *suspect_ns_;
    const std::uint64_t ahead_ns = distance_ns(is_confirmed ? *suspect_ns_ : last_ns_, t_ns);
    if (is_first_ || is_confirmed || ahead_ns <= std::max(far_ns_, times_ * longest_ns_)) {
      if (!is_first_) {
        learn(ahead_ns);
        if (is_confirmed) learn(distance_ns(last_ns_, *suspect_ns_));
      }
      is_first_ = false;
      suspect_ns_.reset();
      last_ns_ = t_ns;
      return true;
    }
    suspect_ns_ = t_ns;
    return false;
  }

 private:
  static std::uint64_t distance_ns(std::int64_t from_ns, std::int64_t to_ns) {
    return static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(from_ns);
  }

  /// Of what is far already, so much that twice as far is believed.
  void learn(std::uint64_t ahead_ns) {
    if (times_ == 0) return;
    const std::uint64_t most_ns = std::max(far_ns_, ahead_ns / times_ * 2);
    longest_ns_ = std::clamp(std::min(ahead_ns, most_ns), longest_ns_, kLongestNs);
  }

  static constexpr std::uint64_t kLongestNs = 1'000'000'000'000'000'000;

  std::uint64_t far_ns_, times_;
  bool is_first_ = true;
  std::int64_t last_ns_ = 0;
  std::uint64_t longest_ns_ = 0;  ///< between stamps that were believed
  std::optional<std::int64_t> suspect_ns_;
};

/// Limits on how bad a log may be.
struct LogLimits {
  double max_gap_s = 0.2;              ///< longer spacings are counted as gaps
  double max_rejected_fraction = 0.1;  ///< more rejected data than this are an InputError
};

inline constexpr const char* kStampNotAfter = "stamp not after the previous one";
inline constexpr const char* kNoStamp = "stamp of another century";
inline constexpr const char* kStampFarAhead = "stamp far ahead of the previous one";

/// "gap longer than 0.2 s"
VIWO_API std::string gap_reason(double max_gap_s);

/// `where` gives the text of the place of a datum, asked for when it is the first of its kind.
class VIWO_API StampOrder {
 public:
  /// `prefix` stands before all reasons.
  explicit StampOrder(const LogLimits& limits, std::string prefix = "");

  /// True for a stamp within +-kMaxStampNs, after all stamps accepted before and not far ahead of
  /// them (StampJump); otherwise it is rejected and counted. A gap before an accepted stamp is
  /// counted, too.
  template <class Where>
  bool accept(std::int64_t t_ns, const Where& where) {
    if (t_ns < -kMaxStampNs || t_ns > kMaxStampNs) {
      reject(kNoStamp, where);
      return false;
    }
    if (last_ns_ && t_ns <= *last_ns_) {
      reject(kStampNotAfter, where);
      return false;
    }
    if (has_rate_ && !jump_.is_believed(t_ns)) {
      reject(kStampFarAhead, where);
      return false;
    }
    if (is_behind_gap(t_ns)) counts_.add(gap_reason_, where);
    last_ns_ = t_ns;
    ++accepted_;
    return true;
  }
  /// True also for the stamp that was accepted last: several data of one time.
  template <class Where>
  bool accept_or_same(std::int64_t t_ns, const Where& where) {
    if (last_ns_ != t_ns) return accept(t_ns, where);
    ++accepted_;
    return true;
  }
  /// Counts a datum that is dropped.
  template <class Where>
  void reject(std::string_view reason, const Where& where) {
    ++rejected_;
    counts_.add(prefix_.empty() ? std::string(reason) : prefix_ + std::string(reason), where);
  }

  /// The same for the datum that was accepted last: its stamp was right, and it was not.
  template <class Where>
  void reject_last(std::string_view reason, const Where& where) {
    --accepted_;
    reject(reason, where);
  }

  /// Counts a datum that is not used, and is no fault of the source: for no limit.
  template <class Where>
  void leave_out(std::string_view reason, const Where& where) {
    counts_.add(prefix_ + std::string(reason), where);
  }

  bool empty() const { return accepted_ + rejected_ == 0; }
  /// InputError "source  n of m data rejected, ..." when nothing was accepted or more than
  /// max_rejected_fraction were rejected; `data` is what they are called.
  void require_enough(const std::string& source, const char* data) const;

  /// Rejected data and gaps by reason, in order of first occurrence.
  const std::vector<RejectionCount>& counts() const { return counts_.counts(); }

 private:
  bool is_behind_gap(std::int64_t t_ns) const;

  LogLimits limits_;
  std::string prefix_;
  std::string gap_reason_;
  std::optional<std::int64_t> last_ns_;
  bool has_rate_;  ///< not of data without any, for which nothing is a gap
  StampJump jump_;
  std::int64_t accepted_ = 0;
  std::int64_t rejected_ = 0;
  Rejections counts_;
};

}  // namespace viwo
