// What a filter knows of its calibration, by name.
#include <string>
#include <vector>

#include "viwo/setup/filter_setup.hpp"

namespace viwo {

std::vector<std::string> calibration_names(const Filter& filter) {
  std::vector<std::string> names;
  for (const BlockSpec& block : filter.blocks().specs()) {
    for (const BlockEntry& entry : block.entries) names.push_back(entry.name);
  }
  return names;
}

std::vector<BlockEstimate> calibration_of(const Filter& filter) {
  std::vector<BlockEstimate> estimates;
  for (std::size_t i = 0; i < filter.blocks().specs().size(); ++i) {
    filter.estimates({static_cast<int>(i)}, estimates);
  }
  return estimates;
}

}  // namespace viwo
