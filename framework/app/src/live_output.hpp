// What a live run has beside others: results are on disk as they come, and what is wrong is said
// when it is seen.
#pragma once

#include <filesystem>

#include "viwo/results/run_stream.hpp"
#include "viwo/run/run.hpp"

namespace viwo::app {

class LiveOutput {
 public:
  /// Watches a run by its hooks. What is there of an earlier one in `folder` goes now, before the
  /// first epoch, for this one may be killed. std::runtime_error when that cannot be written to.
  LiveOutput(const RunSetup& setup, const std::filesystem::path& folder, RunHooks& hooks);

  /// At the end of the run.
  void finish(RunResult& result);

 private:
  RunStream stream_;
};

}  // namespace viwo::app
