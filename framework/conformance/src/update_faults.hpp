// What is wrong with what an update hands to the filter; "" for nothing.
#pragma once

#include <string>

#include "viwo/api/update.hpp"

namespace viwo::conformance {

/// `numbers_matter`: what is absurd may give absurd factors, which the filter drops and counts.
std::string fault_of(const ResidualFactor& factor, int state_size, bool numbers_matter);
std::string fault_of(const InformationFactor& factor, int state_size, bool numbers_matter);

/// A new block: the information factor of its call must tell it.
std::string fault_of(const AddedBlock& block, const FilterView& filter, const FactorSink& sink,
                     bool numbers_matter);

}  // namespace viwo::conformance
