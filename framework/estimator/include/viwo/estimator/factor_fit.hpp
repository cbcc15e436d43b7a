// Whether a factor that an update made fits the state, and its parts each other.
#pragma once

#include <string>

#include "viwo/api/update.hpp"

namespace viwo {

/// What of the columns is not in the state, or there twice; "" for nothing.
std::string misfit_of(const FactorColumns& columns, int state_size);

/// Likewise, and which sizes contradict each other. Numbers are not looked at.
std::string misfit_of(const ResidualFactor& factor, int state_size);
std::string misfit_of(const InformationFactor& factor, int state_size);

}  // namespace viwo
