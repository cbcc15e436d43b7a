// What a run configuration may contain, for people and for editors.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "viwo/api/params.hpp"
#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {

/// A section that is the host's own.
struct HostSection {
  std::string name;  ///< "run": the keys outside of sections
  std::string summary;
  std::vector<ParamSpec> params;
};

std::vector<HostSection> host_sections();

/// JSON Schema (draft 2020-12) of a run configuration with these plugins.
nlohmann::json run_schema(const std::vector<PluginInfo>& plugins);

}  // namespace viwo
