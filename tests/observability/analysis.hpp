// Analyses of delivered configurations, and what is looked up in them.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "registry.hpp"
#include "viwo/experiment/observability.hpp"

namespace viwo::testing {

inline experiment::ObservabilityReport analyse(const std::string& name,
                                               std::vector<std::string> assignments = {}) {
  experiment::ExperimentOptions options;
  options.assignments = std::move(assignments);
  return experiment::analyse(experiment::read_observability(configuration(name), options),
                             registry());
}

inline const experiment::ObservabilityResult& find(const experiment::ObservabilityReport& report,
                                                   std::string_view motion,
                                                   std::string_view variant) {
  for (const experiment::ObservabilityResult& result : report.results) {
    if (report.setup.recordings[result.motion].name == motion &&
        report.setup.variants[result.variant].name == variant) {
      return result;
    }
  }
  throw std::invalid_argument("no " + std::string(motion) + " " + std::string(variant));
}

/// The named set, as it lies to the null space of a state.
inline const experiment::ExplainedDirections& find(const experiment::Observability& state,
                                                   std::string_view set) {
  for (const experiment::ExplainedDirections& explained : state.explained) {
    if (explained.name == set) return explained;
  }
  throw std::invalid_argument("no " + std::string(set));
}

}  // namespace viwo::testing
