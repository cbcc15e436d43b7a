// viwo_conformance: checks a plugin against the contract of viwo/api.
// Exit codes: 0 every check passed; 1 one failed; 2 the plugin is refused or the input is wrong.
#include <exception>
#include <iostream>
#include <string>

#include <boost/program_options.hpp>

#include "viwo/api/status.hpp"
#include "viwo/conformance/conformance.hpp"
#include "viwo/plugin_host/build_record_check.hpp"

namespace viwo::conformance {
namespace {

namespace po = boost::program_options;

po::options_description described() {
  po::options_description options("viwo_conformance PLUGIN.so [--config FILE] [--verbose]");
  options.add_options()("help,h", "this text")("version", "the version of viwo")(
      "config", po::value<std::string>()->value_name("FILE"),
      "YAML with a section {type: NAME, ...} for parameters that have no default")(
      "plugin-path", po::value<std::vector<std::string>>()->composing()->value_name("DIR"),
      "where other plugins are that the section names")(
      "time-limit", po::value<int>()->value_name("SECONDS"), "for each check, 120 by default")(
      "verbose,v", "notes too: what could not be checked, what is worth knowing");
  return options;
}

int run(int argc, char** argv) {
  po::options_description all = described();
  all.add_options()("plugin", po::value<std::string>());
  po::positional_options_description positional;
  positional.add("plugin", 1);
  po::variables_map given;
  po::store(po::command_line_parser(argc, argv).options(all).positional(positional).run(), given);
  if (given.count("version") > 0) {
    std::cout << "viwo_conformance " VIWO_VERSION "\n";
    return 0;
  }
  if (given.count("help") > 0 || given.count("plugin") == 0) {
    std::cout << described()
              << "\nExit codes: 0 conformant; 1 a check failed; 2 the plugin is "
                 "refused or the input is wrong.\n";
    return given.count("help") > 0 ? 0 : 2;
  }
  Options options;
  if (given.count("config") > 0) options.config = given["config"].as<std::string>();
  if (given.count("time-limit") > 0) options.time_limit_s = given["time-limit"].as<int>();
  if (given.count("plugin-path") > 0) {
    for (const auto& folder : given["plugin-path"].as<std::vector<std::string>>()) {
      options.plugin_path.emplace_back(folder);
    }
  }
  const Conformance result = check_plugin(given["plugin"].as<std::string>(), options);
  const PluginInfo& plugin = result.plugin;
  std::cout << plugin.kind << " " << plugin.name << " " << plugin.version << " ("
            << plugin.file.string() << ")\n";
  for (const CheckResult& check : result.checks) {
    std::cout << to_text(check, given.count("verbose") > 0);
  }
  std::cout << (result.passed() ? "conformant\n" : "not conformant\n");
  return result.passed() ? 0 : 1;
}

}  // namespace
}  // namespace viwo::conformance

int main(int argc, char** argv) {
  try {
    if (!viwo::host_record_is_consistent()) {
      std::cerr << "viwo_conformance was built differently from its libviwo_api.so: rebuild both\n";
      return 1;
    }
    return viwo::conformance::run(argc, argv);
  } catch (const viwo::InputError& error) {
    std::cerr << error.what() << "\n";
  } catch (const boost::program_options::error& error) {
    std::cerr << "viwo_conformance: " << error.what() << "\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 2;
}
