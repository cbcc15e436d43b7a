// The section `correlations` of a calibration.yaml: a lower triangle, row by row.
#pragma once

#include <functional>
#include <string>

#include "viwo/config/errors.hpp"
#include "viwo/config/node.hpp"
#include "viwo/filter/state_blocks.hpp"

namespace viwo {

/// Up to the first thing in `rows` that is wrong, which is appended to `errors`. `has_sigma`:
/// whether a parameter can have a row.
PriorCorrelations correlations_in(const config::Node& rows,
                                  const std::function<bool(const std::string&)>& has_sigma,
                                  config::Errors& errors);

config::Node correlations_node(const PriorCorrelations& correlations);

}  // namespace viwo
