// Derivatives of a kinematic model against central differences of its rows.
#pragma once

#include "findings.hpp"
#include "viwo/robot/bench.hpp"

namespace viwo::conformance {

/// d(b - A xi)/d x_WI and (dA/d x_WI)^T e, at the measured signal and, where the rows hold, at the
/// fitted one.
void check_intrinsic_derivatives(const robot::Bench& bench, Findings& findings);
/// At the fitted signal of a reading that is a little off (docs/math/wheel_odometry.md, W-9).
void check_fitted_signal(const robot::Bench& bench, Findings& findings);
/// d(b - A xi)/d n and (dA/d n)^T e.
void check_noise_derivatives(const robot::Bench& bench, Findings& findings);
/// Every row that an entry or a noise source touches lies in its declared range, and nothing is
/// written outside of it.
void check_row_ranges(const robot::Bench& bench, Findings& findings);

}  // namespace viwo::conformance
