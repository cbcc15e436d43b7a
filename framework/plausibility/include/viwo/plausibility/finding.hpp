// What cannot be true of what a sensor gives.
#pragma once

#include <string>
#include <vector>

namespace viwo {

struct Finding {
  std::string key;       ///< the same for the same fault, whatever its figures are by now
  std::string text;      ///< sensor, figure, most likely cause
  bool is_over = false;  ///< it was so for a while
};
using Findings = std::vector<Finding>;

}  // namespace viwo
