// The checks of each kind of plugin, in the order in which they run.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "findings.hpp"
#include "subject.hpp"

namespace viwo::conformance {

using NamedCheck = std::pair<std::string, Check>;

/// Names, units, help and defaults of the parameter table; texts of the registration.
void check_schema(const PluginInfo& info, Findings& findings);

/// Values outside of the bounds are refused; those at the bounds, and lists of any length, are
/// answered by an object or by an error that names the parameter.
void check_parameters(const Subject& subject, Findings& findings);

std::vector<NamedCheck> kinematics_checks(const Subject& subject);
std::vector<NamedCheck> sensor_checks(const Subject& subject);
std::vector<NamedCheck> update_checks(const Subject& subject);

/// Whether `text` is words in small letters and digits, joined by '_'; names of frames and
/// rotations as in the code (R_ItoO, p_IinO) are words too.
bool is_snake_case(const std::string& text);

}  // namespace viwo::conformance
