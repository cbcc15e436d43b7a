// What a lag between two sensors means for the configuration.
#pragma once

#include <string>

#include "viwo/checks/finding.hpp"
#include "viwo/series/lag.hpp"

namespace viwo::inspect {

struct ClockWords {
  std::string check;         ///< Finding::check
  std::string clock;         ///< what is compared: "clock"
  std::string key;           ///< that says the offset, t_other = t + offset; "": there is none
  std::string other;         ///< sensor it is compared with
  double configured_s = 0.;  ///< that has been added to the stamps before
};

/// Of rates compared after what is configured: fits, a fault with the offset to write, or a note
/// that the two cannot be compared. `sigma_prior_s`: how uncertain the configuration says it is;
/// `period_s`: the longer sample interval of the two.
Finding clock_finding(const std::string& label, const ClockWords& words, const series::Lag& lag,
                      double sigma_prior_s, double period_s);

/// Whether one of the two counts other seconds.
bool drifts(const series::Lag& lag);

}  // namespace viwo::inspect
