// A recording looked at before any filter: what its sensors gave, what is wrong with it, and what
// to write into the configuration.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "viwo/checks/finding.hpp"
#include "viwo/report/document.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo::inspect {

struct Inspection {
  std::string name;
  Findings findings;                ///< sensor by sensor
  std::vector<report::Plot> plots;  ///< for the page
  bool has_faults() const;
};

/// Reads the sensors of a run to their end and checks what they gave; those that work on images
/// make their tracks. A sensor that breaks off is a finding. Throws InputError for a live sensor.
Inspection inspect(RunSetup& setup);

/// For the terminal: a verdict for each sensor, then what is wrong and what to write.
std::string describe(const Inspection& inspection);
nlohmann::json to_json(const Inspection& inspection);
report::Document report_of(const Inspection& inspection);

/// What an inspection leaves behind.
inline constexpr std::initializer_list<const char*> kResults = {"inspection.json", "report.html"};

/// Writes them into a folder that is there.
void write_inspection(const std::filesystem::path& folder, const Inspection& inspection);

/// The resolved configuration with all remedies written into it, each with its reason as a comment.
/// InputError when that is no valid configuration (any more).
std::string fixed_configuration(const RunSetup& setup, const Inspection& inspection,
                                PluginRegistry& plugins);

}  // namespace viwo::inspect
