// What is wrong with a run, said when it is first seen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>

#include "finding.hpp"
#include "viwo/experiment/run.hpp"

namespace viwo::experiment {

class RunningWarnings {
 public:
  /// After each epoch: tells hooks.on_warning what is new. Each thing is said once in a run.
  void epoch(const RunResult& result, const Estimator& estimator, const RunHooks& hooks);
  /// The same of what is found in samples, `now_s` after the start of the run.
  void say(double now_s, const Findings& findings, const RunHooks& hooks);

 private:
  std::set<std::string> said_;
  std::size_t monitor_seen_ = 0;  ///< of the monitor's warnings
};

}  // namespace viwo::experiment
