// Counting what is not used: never silently.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/export.hpp"

namespace viwo {

/// One kind of datum that was dropped, and how often.
struct RejectionCount {
  std::string reason;      ///< "stamp not after the previous one", ...
  std::int64_t count = 0;  ///< how often
  std::string first;       ///< where it happened first, e.g. "odom_1.csv.gz:17"
  std::int64_t of = 0;     ///< out of how many, for what is suspicious when it is most; 0: unsaid
};

/// "stamp 1403715273262142976 ns".
VIWO_API std::string stamp_text(std::int64_t t_ns);

/// Counts by reason, in the order of their first times. Allocates for a reason that is new only.
/// Texts of others, as in messages, may be part of a reason: beyond kMostReasons all that are new
/// are one, and of each kLongestReason bytes are kept.
class VIWO_API Rejections {
 public:
  static constexpr std::size_t kMostReasons = 200, kLongestReason = 1000;

  /// True for a reason that is new, and is not one too many. `where` gives the text of the place,
  /// asked for then only.
  template <class Where>
  requires requires(const Where& where) { std::string(where()); }
  bool add(std::string_view reason, const Where& where, std::int64_t count = 1) {
    if (RejectionCount* known = find(reason)) {
      known->count += count;
      return false;
    }
    counts_.push_back({std::string(reason.substr(0, kLongestReason)), count, where()});
    return true;
  }
  /// The place is a stamp.
  bool add(std::string_view reason, std::int64_t t_ns) {
    return add(reason, [t_ns] { return stamp_text(t_ns); });
  }
  /// What another part of a run has counted.
  void add(const RejectionCount& part) {
    add(
        part.reason, [&part] { return part.first; }, part.count);
    find(part.reason)->of += part.of;
  }

  const std::vector<RejectionCount>& counts() const { return counts_; }
  void append_to(std::vector<RejectionCount>& out) const {
    out.insert(out.end(), counts_.begin(), counts_.end());
  }

 private:
  /// The last one where there are too many to have one of its own.
  RejectionCount* find(std::string_view reason);

  std::vector<RejectionCount> counts_;
};

}  // namespace viwo
