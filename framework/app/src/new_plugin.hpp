// viwo plugins new: the source of a plugin to start from.
#pragma once

#include <filesystem>
#include <string>

#include "viwo/plugin_host/registry.hpp"

namespace viwo::app {

/// Writes a complete plugin into the new folder `folder`, from the templates of this installation
/// (../share/viwo/templates beside the folder of the program): common/ and `kind`/, each file
/// NAME.in as NAME, with @name@ and the like replaced in names and contents. Throws InputError for
/// an unknown kind, a name that is none or that is taken, and a folder that exists.
void write_new_plugin(PluginRegistry& plugins, const std::string& kind, const std::string& name,
                      const std::filesystem::path& folder);

}  // namespace viwo::app
