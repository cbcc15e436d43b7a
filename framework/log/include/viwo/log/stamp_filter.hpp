// The order of stamps (stamp_order.hpp) of the rows of a text file, and why rows are dropped.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/stamp_order.hpp"
#include "viwo/log/table_reader.hpp"
#include "viwo/log/text_reader.hpp"

namespace viwo::log {

inline constexpr const char* kLastLineCutShort = "last line cut short";
inline constexpr const char* kUnreadable = "row that cannot be read";
inline constexpr const char* kNotFinite = "value that is not finite";
inline constexpr const char* kIdTwice = "point whose id the image already has";
inline constexpr const char* kTooFar = "position beyond 1e9 m";
inline constexpr double kFarthest_m = 1e9;
inline constexpr const char* kNotUnit = "quaternion that is not of unit norm";

class StampFilter {
 public:
  explicit StampFilter(const LogLimits& limits) : order_(limits) {}

  /// As StampOrder has it; `at` is at the datum.
  bool accept(std::int64_t t_ns, const TextReader& at) { return order_.accept(t_ns, Place{at}); }
  bool accept_or_same(std::int64_t t_ns, const TextReader& at) {
    return order_.accept_or_same(t_ns, Place{at});
  }
  void reject(std::string_view reason, const TextReader& at) { order_.reject(reason, Place{at}); }
  void reject_last(std::string_view reason, const TextReader& at) {
    order_.reject_last(reason, Place{at});
  }

  /// Counts a row that cannot be read; the first with what is wrong.
  void reject_row(const BadRow& bad, const TextReader& at) {
    order_.reject(kUnreadable, [&] { return at.where() + "  " + bad.text(); });
  }

  /// To be called once at the end of the file: InputError when nothing was accepted or more than
  /// max_rejected_fraction of the data were rejected. A last line that was left out counts.
  void finish(const TextReader& at);

  const std::vector<RejectionCount>& counts() const { return order_.counts(); }

 private:
  struct Place {
    const TextReader& at;
    std::string operator()() const { return at.where(); }
  };

  StampOrder order_;
};

}  // namespace viwo::log
