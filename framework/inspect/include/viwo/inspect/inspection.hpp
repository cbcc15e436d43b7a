// A recording looked at before any filter: what its sensors gave, what is wrong with it, and what
// to write into the configuration.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "viwo/plausibility/finding.hpp"
#include "viwo/report/document.hpp"
#include "viwo/setup/run_setup.hpp"

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

struct Inspection {
  std::string name;
  Findings findings;                ///< sensor by sensor
  std::vector<report::Plot> plots;  ///< for the page
  bool has_faults() const;
};

/// Reads the sensors of a run to their end and checks what they gave. Sensors that work on images
/// are not read, nor are pixels. A sensor that breaks off is a finding. Throws InputError for a
/// live sensor.
Inspection inspect(RunSetup& setup);

/// For the terminal: a verdict for each sensor, then what is wrong and what to write.
std::string describe(const Inspection& inspection);
nlohmann::json to_json(const Inspection& inspection);
report::Document report_of(const Inspection& inspection);

/// Writes inspection.json and report.html into a folder that is there.
void write_inspection(const std::filesystem::path& folder, const Inspection& inspection);

/// The resolved configuration with all remedies written into it, each with its reason as a comment.
/// InputError when that is no valid configuration (any more).
std::string fixed_configuration(const RunSetup& setup, const Inspection& inspection,
                                PluginRegistry& plugins);

}  // namespace viwo::inspect
