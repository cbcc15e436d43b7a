#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {

std::string full_name(const PluginInfo& info) {
  return info.kind + " plugin '" + info.name + "' " + info.version + " (" + info.file.string() +
         ")";
}

PluginRefused::PluginRefused(std::filesystem::path file, const std::string& reason)
    : InputError("refusing " + file.string() + ": " + reason),
      file_(std::move(file)),
      reason_(reason) {}
PluginRefused::~PluginRefused() = default;

PluginUnavailable::~PluginUnavailable() = default;

PluginFailure::PluginFailure(const PluginInfo& info, std::string_view phase,
                             const std::string& text)
    : std::runtime_error(full_name(info) + " failed in " + std::string(phase) + ": " + text),
      name_(info.name),
      version_(info.version),
      file_(info.file),
      phase_(phase),
      text_(text) {}
PluginFailure::~PluginFailure() = default;

}  // namespace viwo
