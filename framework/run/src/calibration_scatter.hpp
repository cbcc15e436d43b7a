// Whether the estimate of what never changes moves as little as its sigma says. Equations:
// docs/math/filter.md.
#pragma once

#include <cstdint>
#include <vector>

#include "viwo/estimator/estimator.hpp"

namespace viwo {

/// Of all entries of the declared blocks (F-42). Noise that lasts (of tyres that give way, of
/// corners that are found a little off as long as they are seen from one side) makes a filter that
/// takes it for white surer of them, with every second, than it ought to be.
class CalibrationScatter {
 public:
  explicit CalibrationScatter(const StateBlocks& blocks);

  /// An epoch is done. Whether the factors may be others than before.
  bool epoch(const Filter& filter);
  /// Another filter goes on; what was found stays.
  void begin_anew() { is_new_ = true; }
  /// By how many times its sigma each entry scatters, in the order of the blocks; 1 where that may
  /// be chance, or where it is not constant.
  std::vector<double> factors() const;

 private:
  struct Entry {
    bool is_settled = false;  ///< the first stretch of time is over: what has only now begun jumps
    double value = 0.;        ///< where the present stretch began
    double variance = 0.;     ///< likewise
    double squares = 0.;      ///< sum over the stretches that are over
    int stretches = 0;
  };
  void look(const Filter& filter);
  void look(Entry& entry, double value, double variance) const;

  std::vector<Entry> entries_;
  bool is_new_ = true;
  std::int64_t looked_ns_ = 0;
};

}  // namespace viwo
