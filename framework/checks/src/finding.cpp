#include "viwo/checks/finding.hpp"

#include <algorithm>

namespace viwo::inspect {

bool is_fault(const Findings& findings, std::string_view sensor, std::string_view check) {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding& f) {
    return f.severity == Severity::kFault && f.sensor == sensor && f.check == check;
  });
}

const char* name(Severity severity) {
  switch (severity) {
    case Severity::kFits:
      return "fits";
    case Severity::kNote:
      return "note";
    case Severity::kFault:
      break;
  }
  return "fault";
}

}  // namespace viwo::inspect
