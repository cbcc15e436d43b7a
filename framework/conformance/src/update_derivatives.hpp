// The Jacobians of an update against differences of what it emits.
#pragma once

#include "findings.hpp"
#include "subject.hpp"

namespace viwo::conformance {

/// Over short drives: with the estimate of one epoch moved along one column after the other,
/// residuals must go by -H, and eta by -Lambda. What is weighed or chosen anew is left out.
void check_update_derivatives(const Subject& subject, Findings& findings);

}  // namespace viwo::conformance
