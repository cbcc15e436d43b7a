// viwo plugins list | describe NAME | schema | check FILE | new KIND NAME
#include <algorithm>
#include <iostream>

#include "command_line.hpp"
#include "new_plugin.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/eval/json.hpp"
#include "viwo/plan/plan.hpp"
#include "viwo/setup/schema.hpp"

namespace viwo::app {
namespace {

void print_line(const PluginInfo& info) {
  std::cout << info.kind << "  " << info.name << "  " << info.version << "  " << info.summary
            << "\n    " << info.file.string() << "\n";
}

std::string refusal_of(const PluginListing& listing) {
  return "refusing " + listing.file.string() + ": " + listing.refusal;
}

int list(PluginRegistry& plugins) {
  const std::vector<PluginListing> listings = plugins.list();
  bool refused = false;
  for (const PluginListing& listing : listings) {
    if (listing.info) print_line(*listing.info);
    refused |= !listing.info;
  }
  if (!refused) return 0;
  int code = 0;
  std::cout << "\nrefused:\n";
  for (const PluginListing& listing : listings) {
    if (listing.info) continue;
    std::cout << listing.file.string() << "\n    " << listing.refusal << "\n";
    if (!listing.is_unavailable) continue;
    std::cerr << refusal_of(listing) << "\n";
    code = 1;
  }
  return code;
}

int describe(PluginRegistry& plugins, const std::string& name) {
  std::vector<std::string> names;
  std::string unavailable;
  bool found = false;
  std::vector<HostSection> sections = host_sections();
  sections.push_back({"calibration",
                      "a file of viwo calibrate, beside recordings or motions, and set",
                      calibration::calibration_params()});
  sections.push_back({"plan", "a file of viwo plan, beside kinematics and goals",
                      param_specs<plan::PlanParams>()});
  for (const HostSection& section : sections) {
    names.push_back(section.name);
    if (section.name != name) continue;
    found = true;
    std::cout << "# section of a configuration: " << section.summary << "\n"
              << config::describe_params(section.params);
  }
  for (const PluginListing& listing : plugins.list()) {
    if (listing.is_unavailable) unavailable += "\n" + refusal_of(listing);
    if (!listing.info) continue;
    names.push_back(listing.info->name);
    if (listing.info->name != name) continue;
    found = true;
    const PluginInfo& info = *listing.info;
    std::cout << "# " << info.kind << " " << info.name << " " << info.version << " ("
              << info.license << "): " << info.summary << "\n# " << info.file.string()
              << "\ntype: " << info.name << "\n"
              << config::describe_params(info.params);
  }
  if (!found) {
    throw InputError("no plugin or section '" + name + "'" + config::did_you_mean(name, names) +
                     unavailable);
  }
  return 0;
}

/// With the plugins that there are; whoever writes it to a file is told of the others.
int schema(PluginRegistry& plugins) {
  std::vector<PluginInfo> infos;
  int code = 0;
  for (const PluginListing& listing : plugins.list()) {
    if (listing.info) infos.push_back(*listing.info);
    if (!listing.info) std::cerr << refusal_of(listing) << "\n";
    if (listing.is_unavailable) code = 1;
  }
  std::cout << json_text(run_schema(infos));
  return code;
}

}  // namespace

int plugins_command(const Arguments& arguments) {
  PluginRegistry plugins = make_registry(arguments);
  const std::string& what = arguments.positional[0];
  const std::size_t n = arguments.positional.size();
  if (what == "new" && n == 3) {
    const std::string& name = arguments.positional[2];
    const auto folder = arguments.out.value_or(name);
    write_new_plugin(plugins, arguments.positional[1], name, folder);
    std::cout << "written: " << folder.string() << "; how to build and run it is in "
              << (folder / "README.md").string() << "\n";
    return 0;
  }
  if (arguments.out) throw InputError("viwo plugins: --out is for viwo plugins new KIND NAME");
  if (what == "list" && n == 1) return list(plugins);
  if (what == "describe" && n == 2) return describe(plugins, arguments.positional[1]);
  if (what == "schema" && n == 1) return schema(plugins);
  if (what == "check" && n == 2) {
    print_line(plugins.check(arguments.positional[1]));
    return 0;
  }
  const std::vector<std::string> verbs{"list", "describe", "schema", "check", "new"};
  if (std::find(verbs.begin(), verbs.end(), what) == verbs.end()) {
    throw InputError("viwo plugins: unknown '" + what + "'" + config::did_you_mean(what, verbs));
  }
  throw InputError(
      "viwo plugins: usage: viwo plugins list | describe NAME | schema | check FILE | new KIND "
      "NAME "
      "[--out DIR]");
}

}  // namespace viwo::app
