// Options that the commands share, and how a command is described and parsed.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <boost/program_options.hpp>

#include "viwo/plugin_host/registry.hpp"

namespace viwo::app {

/// What the user asked for on the command line of one command.
struct Arguments {
  std::vector<std::string> positional;
  std::vector<std::string> assignments;  ///< --set
  std::vector<std::filesystem::path> plugin_path;
  std::optional<std::filesystem::path> out;
  std::optional<std::uint64_t> seed;
  std::optional<int> seeds;
  int jobs = 0;
  bool keep_runs = false;
  bool resume = false;
  std::optional<std::string> shard;  ///< "I/N"
  bool collect = false;
  bool lockstep = false;
  bool show = false;
  std::filesystem::path video;  ///< none if empty
  std::filesystem::path mcap;   ///< none if empty
  std::string figures;          ///< "svg", "pdf" or none
  std::filesystem::path fix;    ///< none if empty
  std::string reference, estimate, align;
  double max_gap_s = 0.;
  std::string to;              ///< a format of export
  std::filesystem::path plan;  ///< of which pieces a run says what is missing; none if empty
};

/// One command: what it is called, what it takes, what it does.
struct Command {
  const char* name;
  const char* usage;    ///< "run CONFIG [options]"
  const char* summary;  ///< one line
  const char* options;  ///< names of the options it takes, separated by spaces
  int n_positional;     ///< required; -1: at least one
  int (*run)(const Arguments& arguments);
};

/// Parses the arguments of a command. Prints its help and returns nothing for --help. Throws
/// InputError (with the nearest spelling) for what it does not take.
std::optional<Arguments> parse(const Command& command, const std::vector<std::string>& words);

PluginRegistry make_registry(const Arguments& arguments);

int run_command(const Arguments& arguments);
int experiment_command(const Arguments& arguments);
int observability_command(const Arguments& arguments);
int evaluate_command(const Arguments& arguments);
int inspect_command(const Arguments& arguments);
int simulate_command(const Arguments& arguments);
int calibrate_command(const Arguments& arguments);
int export_command(const Arguments& arguments);
int plan_command(const Arguments& arguments);
int plugins_command(const Arguments& arguments);

}  // namespace viwo::app
