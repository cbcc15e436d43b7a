// The kinds of samples that a host has met: libraries exchange samples only if they were compiled
// with the same ones.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "viwo/api/sample.hpp"
#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {

/// Those of viwo/api/measurement.hpp.
SampleTypes built_in_sample_types();

/// Kinds by name, each as who came with it first was compiled with it. Calls may run concurrently.
class SampleKinds {
 public:
  /// Knows viwo's own.
  SampleKinds();

  /// InputError, which names both, when somebody else came with a kind of that name in another
  /// version or layout.
  void require(const SampleType& type, const PluginInfo& whose);

 private:
  struct Known {
    const SampleType* type;  ///< of a library, which stays loaded until the process exits
    std::string whose;       ///< empty: viwo's
  };

  std::mutex mutex_;
  std::map<std::string, Known, std::less<>> known_;
};

}  // namespace viwo
