// What is wrong with what an update hands to the filter; "" for nothing.
#pragma once

#include <string>

#include "viwo/api/update.hpp"

namespace viwo::conformance {

/// `numbers_matter`: what is absurd may give absurd factors, which the filter drops and counts.
std::string fault_of(const ResidualFactor& factor, int state_size, bool numbers_matter);
std::string fault_of(const InformationFactor& factor, int state_size, bool numbers_matter);

/// An empty sink, with marks in the storage of all residual factors that it has room for: by them
/// overrun_of() tells what is written outside of the sizes given to set_rows().
void clear_and_mark(FactorSink& sink, int max_residual_factors);
std::string overrun_of(const ResidualFactor& factor);

/// A new block: the information factor of its call must tell it.
std::string fault_of(const AddedBlock& block, const FilterView& filter, const FactorSink& sink,
                     bool numbers_matter);

}  // namespace viwo::conformance
