// Whole recordings smoothed: the factors of the filter's updates, linearised again at what all of
// them say together, until nothing moves. Equations: docs/math/smoother.md.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "viwo/config/node.hpp"
#include "viwo/plugin_host/registry.hpp"
#include "viwo/run/run.hpp"
#include "viwo/run/work_progress.hpp"

namespace viwo::smoother {

/// A recording, as the run configuration of a filter describes it, without placeholders.
struct Input {
  std::string name;  ///< for messages: "recording '1'"
  config::Node run;
};

struct Smoothed {
  /// Of wheels and cameras, from all recordings; `nominal` are the values of the configuration.
  CalibrationFile calibration;
  CalibrationFile before;  ///< the same as it was known before
  /// The last pass over each recording, along its smoothed path. What it says of the calibration is
  /// that of a filter that is linearised there.
  std::vector<RunResult> runs;
  std::vector<std::string> warnings;  ///< of these passes
  int iterations = 0;
  bool converged = false;
  double left = 0.;       ///< square of the last step of the calibration, in its sigmas
  long residuals = 0;     ///< factors with a residual, in the last pass
  long weighed_down = 0;  ///< those beyond their gates
};

/// Throws InputError for what is wrong in a configuration or in a recording, and when the filter
/// that it begins with does not end well.
Smoothed smooth(std::span<const Input> inputs, PluginRegistry& plugins,
                WorkProgress& progress = no_progress());

}  // namespace viwo::smoother
