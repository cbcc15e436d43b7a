// How large a noise is, found from what residuals leave: a factor on its configured standard
// deviation. Equations: docs/math/filter.md, F-29 .. F-31.
#pragma once

#include <cstdint>
#include <string>

#include "viwo/api/export.hpp"

namespace viwo {

/// What an update has found about a noise of its configuration.
struct NoiseFound {
  std::string name;        ///< its parameter, or what it is the noise of
  std::string unit;        ///< of `configured` and `found`
  double configured = 0.;  ///< standard deviation, or a factor on one
  double found = 0.;       ///< the same, over all of the run
  std::int64_t count = 0;  ///< measurements that it was found from
};

/// Scale s of a noise of covariance s^2 R: what the latest residuals say of it, from 1 on. An
/// update that puts one into its factors (ResidualFactor::noise) lets the host weigh them by what
/// it finds.
class VIWO_API NoiseScale {
 public:
  /// `believed`: how many measurements the configured value is worth at the start; `memory`: how
  /// many are remembered; `most`: nobody's guess is farther off.
  explicit NoiseScale(double believed = 20., double memory = 100., double most = 30.)
      : memory_(memory),
        most_(most),
        sum_(believed),
        weight_(believed),
        total_(believed),
        total_weight_(believed) {}

  /// Off: stays at 1.
  void set_enabled(bool enabled) { enabled_ = enabled; }
  bool enabled() const { return enabled_; }

  double variance() const { return variance_; }  ///< s^2
  double scale() const;                          ///< s, within 1 .. most

  /// One measurement: what it says of s^2, and how much that is worth: 1 when all of its residual
  /// is noise (F-30).
  void add(double variance, double weight = 1.);
  /// One measurement that was less likely than its gate, which is `times` what was expected of its
  /// square: counts as one at its gate, however far off it is (F-31).
  void add_beyond(double times) { add(variance_ * times); }

  /// Over all that was measured, without forgetting; where that says little, about 1.
  double found() const;
  std::int64_t count() const { return count_; }

 private:
  double bounded(double variance) const;

  double memory_, most_;
  bool enabled_ = true;
  double variance_ = 1.;
  double sum_, weight_;  ///< remembered
  double total_, total_weight_;
  std::int64_t count_ = 0;
};

}  // namespace viwo
