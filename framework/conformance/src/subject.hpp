// The plugin under test: how objects of it are made, with which parameters.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "viwo/config/node.hpp"
#include "viwo/conformance/conformance.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo::conformance {

class Subject {
 public:
  /// Loads the file like any host does. Throws PluginRefused.
  Subject(const std::filesystem::path& file, const Options& options);

  const PluginInfo& info() const { return info_; }

  /// The section that the checks use: that of `options.config`, or one with made-up values for what
  /// has no default. Throws InputError if there is none.
  const config::Node& section() const { return section_; }
  void choose_section(const Options& options);
  /// Why choose_section() found none.
  const std::string& no_section() const { return no_section_; }

  /// An object, or InputError with what the host says about the section.
  template <class Interface>
  Loaded<Interface> make(const config::Node& section, std::uint64_t seed = 1) const;
  template <class Interface>
  Loaded<Interface> make() const {
    return make<Interface>(section_);
  }
  /// An update whose rows are to be derivatives (HostServices::exact).
  Loaded<Update> make_exact_update() const;
  /// Makes an object of the plugin's kind and drops it; "" or what the host says about the section.
  std::string try_section(const config::Node& section) const;

 private:
  std::shared_ptr<PluginRegistry> registry_;
  PluginInfo info_;
  config::Node section_;
  std::string no_section_;
};

template <>
Loaded<KinematicModel> Subject::make(const config::Node& section, std::uint64_t seed) const;
template <>
Loaded<Sensor> Subject::make(const config::Node& section, std::uint64_t seed) const;
template <>
Loaded<Update> Subject::make(const config::Node& section, std::uint64_t seed) const;

/// Sections to try, `type` and a value for every parameter without a default; empty when one of
/// them cannot be made up, then `missing` names it.
std::vector<config::Node> made_up_sections(const PluginInfo& info, std::string& missing);

}  // namespace viwo::conformance
