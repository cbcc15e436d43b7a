// What an update declares.
#pragma once

#include <string>

#include "findings.hpp"
#include "subject.hpp"

namespace viwo::conformance {

/// Two instances declare the same, and what the host accepts.
void check_declarations(const Subject& subject, Findings& findings);

/// What the update needs that the robot of the checks does not have: "takes 'range', ..."; "" for
/// nothing.
struct Unmet {
  std::string blocks;   ///< of updates of others: it cannot be started without
  std::string samples;  ///< of kinds of others: it can, but has nothing to do
};
Unmet unmet_needs(const Subject& subject);

}  // namespace viwo::conformance
