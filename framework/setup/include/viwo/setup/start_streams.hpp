// The streams that a start without a reference looks at.
#pragma once

#include <span>
#include <vector>

#include "viwo/setup/filter_setup.hpp"

namespace viwo {

/// The stream of tracks that updates take, of the first sensor if there are several; null without.
const SharedStream* tracks_of(std::span<const SharedStream> streams);

/// What starts without a reference want to see beside the IMU: encoder samples of each wheel set,
/// then the tracks that updates take, if any do. `streams`: those that updates take.
std::vector<ExtraStream> start_streams(const FilterSetup& setup,
                                       std::span<const SharedStream> streams);

}  // namespace viwo
