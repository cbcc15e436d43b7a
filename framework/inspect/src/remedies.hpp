// What has to stand in a configuration, of what was found behind what stands there already.
#pragma once

#include <vector>

#include "viwo/config/node.hpp"
#include "viwo/inspect/inspection.hpp"

namespace viwo::inspect {

/// Which joint of the model each channel of the log is for, of the kind of joints that the remedy
/// changes (drives, steerings); empty where they are in order.
std::vector<double> channels_of(const config::Node& configuration, const Remedy& remedy);

/// Changes of joints become lists of the channels of the log with what the configuration does to
/// them already in it (J-1 .. J-4); units that the sensor has not taken are left out.
void put_into(const config::Node& configuration, std::vector<Remedy>& remedies);

}  // namespace viwo::inspect
