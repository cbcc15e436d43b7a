// Checks of a kinematic model beside its derivatives.
#pragma once

#include "findings.hpp"
#include "viwo/robot/bench.hpp"

namespace viwo::conformance {

/// Names, units, priors, sizes.
void check_description(const Subject& subject, Findings& findings);
/// Sources positive and in range, encoders before slip; row noise positive and independent between
/// blocks.
void check_noise_model(const robot::Bench& bench, Findings& findings);
/// constant_A is what it says.
void check_constant_A(const robot::Bench& bench, Findings& findings);
/// The rows of some reading tell the whole twist.
void check_rank(const robot::Bench& bench, Findings& findings);
/// Results depend on the arguments alone: the same bits again, whatever was called in between.
void check_repeatable(const Subject& subject, Findings& findings);
/// Two instances with different parameters do not see each other.
void check_independent(const Subject& subject, Findings& findings);
/// Const calls of several threads on one object give the same bits.
void check_concurrent(const robot::Bench& bench, Findings& findings);
/// Entries that hold the frame do that, and nothing else.
void check_gauge(const robot::Bench& bench, Findings& findings);
void check_move_frame(const robot::Bench& bench, Findings& findings);
void check_inverse(const robot::Bench& bench, Findings& findings);
/// Readings, intrinsics and twists that are not finite or absurd.
void check_hostile_readings(const robot::Bench& bench, Findings& findings);
void check_hostile_arguments(const robot::Bench& bench, Findings& findings);

}  // namespace viwo::conformance
