// What cannot be true of what a sensor gives.
#pragma once

#include <string>
#include <vector>

namespace viwo {

/// What to write into the run configuration: `key: value`.
struct Remedy {
  std::string key;    ///< dotted path
  std::string value;  ///< YAML
};

struct Finding {
  std::string key;                    ///< the same for the same fault, whatever its figures are now
  std::string text;                   ///< sensor, figure, most likely cause
  bool is_over = false;               ///< it was so for a while
  std::vector<Remedy> remedies = {};  ///< of a cause that a configuration can undo
  bool is_doubt = false;              ///< what is made of it is not to be trusted

  /// Whom the text begins with.
  std::string sensor() const { return text.substr(0, text.find(": ")); }
};
using Findings = std::vector<Finding>;

}  // namespace viwo
