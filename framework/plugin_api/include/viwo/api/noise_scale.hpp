// How large a noise is, found from what residuals leave: a factor on its configured standard
// deviation. Equations: docs/math/filter.md, F-29 .. F-31, F-39.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

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
      : believed_(believed), memory_(memory), most_(most) {
    reset();
  }

  /// As it was made: nothing is known of what was before.
  void reset();

  /// Off: stays at 1.
  void set_enabled(bool enabled) { enabled_ = enabled; }
  bool enabled() const { return enabled_; }

  double variance() const { return variance_; }  ///< s^2
  double scale() const;                          ///< s, within 1 .. most

  /// One measurement: what it says of s^2, and how much that is worth: 1 when all of its residual
  /// is noise (F-30).
  void add(double variance, double weight = 1.);
  /// One measurement that was less likely than its gate, which is `gate` times what was expected of
  /// its square: counts as one at its gate, however far off it is (F-31).
  void add_beyond(double gate) { add(variance_ * gate); }
  /// The same of measurements that come one after the other: two of three in a row are no outliers
  /// but another noise, and little is remembered but them (F-39).
  void add_beyond_in_turn(double gate);

  /// Over all that was measured, without forgetting; where that says little, about 1.
  double found() const;
  std::int64_t count() const { return count_; }
  /// Appends what was found, if there was anything to find it from, of the parameter `name` that is
  /// `configured`.
  void append_to(const char* name, const char* unit, double configured,
                 std::vector<NoiseFound>& out) const;

 private:
  void remember(double variance, double weight, double kept);
  double bounded(double variance) const;

  double believed_, memory_, most_;
  bool enabled_ = true;
  double variance_ = 1.;
  double sum_ = 0., weight_ = 0.;  ///< remembered
  double total_ = 0., total_weight_ = 0.;
  double beyond_ = 0.;  ///< s^2 that the last one said, if it was beyond its gate; or, negative,
                        ///< that the one before it said
  std::int64_t count_ = 0;
};

}  // namespace viwo
