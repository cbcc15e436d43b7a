// Samples that no filter looks at before they are used: a reference, and all of wheels alone.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "viwo/api/rejections.hpp"
#include "viwo/api/sample.hpp"

namespace viwo {

/// Passes those whose numbers are numbers, and whose times follow each other; counts the others.
/// Sensors of viwo give no other ones; those of others may.
class SampleGate {
 public:
  bool accept(const std::string& sensor, SampleView sample);
  void append_to(std::vector<std::pair<std::string, RejectionCount>>& out) const;

 private:
  struct Kind {
    std::string sensor;
    const SampleType* type;
    int channel;
    std::optional<SampleExtent> last;
    Rejections rejections;
  };
  Kind& kind_of(const std::string& sensor, SampleView sample);

  std::vector<Kind> kinds_;
};

}  // namespace viwo
