// Which change of the channels, undone, stops wheels from contradicting each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "viwo/plausibility/channel_change.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {

class ChangeTrial {
 public:
  /// `changes`: the first is none. Nothing is tried of models whose rows cannot contradict each
  /// other.
  ChangeTrial(const std::shared_ptr<const WheelModel>& model, const Intrinsics& x_WI,
              const std::vector<ChannelChange>& changes);

  void add(const EncoderSample& sample);
  /// Changes that make the contradictions vanish, to a tenth of what they are; the best is first,
  /// and beside it those that leave less than three times as much. Empty where there is none, where
  /// some of them leave more than a tenth, or where the wheels fit as they are.
  std::vector<ChannelChange> explaining() const;

 private:
  struct Tried {
    ChannelChange change;
    double residual = 0.;   ///< sum of the squares of the parity residuals
    double of_sample = 0.;  ///< of the one at hand
  };

  static constexpr double kAsWell = 3.;

  bool solves(Tried& tried, const EncoderSample& sample);
  bool is_next_to_none(const Tried& tried) const;

  TwistSolver solver_;
  TwistSolution solution_;
  std::vector<Tried> changes_;
  Tried no_steering_;   ///< what angles in degrees have to be told from
  double signal_ = 0.;  ///< of what the rows say as they are, (m/s)^2
  std::int64_t tried_ = 0;
};

}  // namespace viwo
