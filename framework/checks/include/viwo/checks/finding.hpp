// What a check of a recording says.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "viwo/plausibility/finding.hpp"

namespace viwo::inspect {

enum class Severity {
  kFits,   ///< as it should be
  kNote,   ///< worth knowing, nothing that spoils a run
  kFault,  ///< a run with it is worse than it need be, or wrong
};
const char* name(Severity severity);

struct Figure {
  std::string name;
  double value = 0.;  ///< NaN: there is none
  std::string unit;   ///< "" for none
};

/// What one check says of one sensor.
struct Finding {
  std::string sensor;
  Severity severity = Severity::kFits;
  std::string check;  ///< "stamps", "gravity", ...: the same for the same thing in every recording
  std::string what;   ///< in words
  std::vector<Figure> figures = {};
  std::vector<Remedy> remedies = {};
};
using Findings = std::vector<Finding>;

/// Whether `check` has found a fault of a sensor already.
bool is_fault(const Findings& findings, std::string_view sensor, std::string_view check);

}  // namespace viwo::inspect
