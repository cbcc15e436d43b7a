// Analyses of delivered configurations, and what is looked up in them.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "registry.hpp"
#include "viwo/observability/observability.hpp"

namespace viwo::testing {

inline observability::ObservabilityReport analyse(const std::string& name,
                                                  std::vector<std::string> assignments = {}) {
  experiment::ExperimentOptions options;
  options.assignments = std::move(assignments);
  return observability::analyse(observability::read_observability(configuration(name), options),
                                registry());
}

inline const observability::ObservabilityResult& find(
    const observability::ObservabilityReport& report, std::string_view motion,
    std::string_view variant) {
  for (const observability::ObservabilityResult& result : report.results) {
    if (report.setup.recordings[result.motion].name == motion &&
        report.setup.variants[result.variant].name == variant) {
      return result;
    }
  }
  throw std::invalid_argument("no " + std::string(motion) + " " + std::string(variant));
}

/// The named set, as it lies to the null space of a state.
inline const observability::ExplainedDirections& find(const observability::Observability& state,
                                                      std::string_view set) {
  for (const observability::ExplainedDirections& explained : state.explained) {
    if (explained.name == set) return explained;
  }
  throw std::invalid_argument("no " + std::string(set));
}

}  // namespace viwo::testing
