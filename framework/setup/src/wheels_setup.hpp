// The sections `wheels` and `wheel_sets` of a run configuration.
#pragma once

#include <span>

#include "section_params.hpp"
#include "viwo/setup/filter_setup.hpp"
#include "wrong_start.hpp"

namespace viwo {

/// Appends a wheel set from its `section` `wheels`, read as `p`, to `setup`. `set` has the model
/// and its name; intrinsics and their sigmas are those of the model, or of the calibration.yaml in
/// `context`.
void read_wheels(const WheelsParams& p, const config::Node& section, WheelSet set,
                 CalibrationError error, const ReadContext& context, FilterSetup& setup,
                 config::Errors& errors);

/// Further wheel sets: NAME: {kinematics: {...}, wheels: {...}}.
void read_wheel_sets(const config::Node& run, CalibrationError error, const ReadContext& context,
                     FilterSetup& setup, config::Node& resolved, config::Errors& errors);

/// A wheel set whose sensor does not exist would get no samples and never say so.
void check_wheel_sensors(const config::Node& run, const FilterSetup& setup, config::Errors& errors);

/// How the entries of all wheel sets hang together at the start (CAL-18).
PriorCorrelations correlations_of(std::span<const WheelSet> sets);

}  // namespace viwo
