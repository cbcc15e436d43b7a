#include "command_line.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "viwo/api/status.hpp"
#include "viwo/config/suggest.hpp"

namespace viwo::app {
namespace {

namespace po = boost::program_options;

/// Each is a thread.
constexpr int kMostJobs = 1024;

enum class Takes { kNothing, kText, kRequired, kTexts, kInteger, kLong, kNumber };

struct Option {
  std::string_view name;  ///< in Command::options
  const char* spelled;
  Takes takes;
  const char *value_name, *help;
  const char* fallback = nullptr;
};

/// Every option of any command.
constexpr Option kOptions[] = {
    {"out", "out,o", Takes::kText, "DIR", "folder for the results"},
    {"out!", "out,o", Takes::kRequired, "DIR", "folder for the log"},
    {"out-file", "out,o", Takes::kText, "FILE", "the file to write (default: the terminal)"},
    {"to!", "to", Takes::kRequired, "FORMAT",
     "urdf, ros2_control, wpilib (Java), kalibr (cameras) or csv"},
    {"seed", "seed", Takes::kLong, "N", "overrules the configured seed"},
    {"seeds", "seeds", Takes::kInteger, "N", "overrules the configured number of seeds"},
    {"jobs", "jobs,j", Takes::kInteger, "N", "runs in parallel (default: one per core)"},
    {"set", "set", Takes::kTexts, "KEY=VALUE",
     "overrides a value of the run configuration, e.g. --set odometry.epoch_s=0.05"},
    {"keep-runs", "keep-runs", Takes::kNothing, "", "one folder with all files for each run"},
    {"resume", "resume", Takes::kNothing, "", "goes on with an experiment that was interrupted"},
    {"shard", "shard", Takes::kText, "I/N",
     "runs the cells k with k mod N = I only, again what failed, and leaves them in the folder; "
     "I and N may be environment variables: SLURM_ARRAY_TASK_ID/SLURM_ARRAY_TASK_COUNT"},
    {"collect", "collect", Takes::kNothing, "",
     "runs nothing: tables and page of the runs that shards have left in the folder"},
    {"figures", "figures", Takes::kText, "FORMAT",
     "every plot also as a static figure for a paper: svg or pdf (needs gnuplot)"},
    {"fix", "fix", Takes::kText, "FILE",
     "the configuration with all that is to be written into it, as a file of its own"},
    {"plan", "plan", Takes::kText, "PLAN",
     "a plan file of this base (viwo plan): which piece of motion the calibration lacks most, "
     "and what it would tell; said at the end, of live sensors also when it changes"},
    {"lockstep", "lockstep", Takes::kNothing, "",
     "live sensors that can (ros2_topics) are played: the run waits for what comes, nothing is "
     "dropped, and the results are those of the same messages in a bag"},
    {"show", "show", Takes::kNothing, "",
     "a window with the tracks in the images, the trajectory and the calibration"},
    {"video", "video", Takes::kText, "FILE",
     "the same pictures, one for each epoch, as a video file: .mp4 or .avi"},
    {"mcap", "mcap", Takes::kText, "FILE",
     "while the run goes on: odometry, path, tf, tracks, calibration and diagnostics as ROS 2 "
     "messages in an MCAP file, for Foxglove, PlotJuggler and RViz"},
    {"reference", "reference", Takes::kRequired, "A.tum", "true trajectory"},
    {"estimate", "estimate", Takes::kRequired, "B.tum", "trajectory to evaluate"},
    {"align", "align", Takes::kText, "MODE",
     "alignment for the ATE: none, start, yaw_position or se3", "yaw_position"},
    {"max-gap", "max-gap", Takes::kNumber, "SECONDS",
     "between poses of the reference that are further apart nothing is compared", "0.5"}};

template <class T>
po::typed_value<T>* value_of(const Option& option) {
  return po::value<T>()->value_name(option.value_name);
}

const po::value_semantic* semantic_of(const Option& option) {
  switch (option.takes) {
    case Takes::kText: {
      auto* const text = value_of<std::string>(option);
      return option.fallback != nullptr ? text->default_value(option.fallback) : text;
    }
    case Takes::kRequired:
      return value_of<std::string>(option)->required();
    case Takes::kTexts:
      return value_of<std::vector<std::string>>(option)->composing();
    case Takes::kInteger:
      return value_of<int>(option);
    case Takes::kLong:
      return value_of<std::int64_t>(option);
    case Takes::kNumber:
      return value_of<double>(option)->default_value(std::stod(option.fallback), option.fallback);
    case Takes::kNothing:
      break;
  }
  return new po::untyped_value(true);  // the description owns it, like the others
}

po::options_description options_of(const Command& command) {
  po::options_description options("Options");
  std::istringstream names(command.options);
  for (std::string name; names >> name;) {
    const auto* const option = std::ranges::find(kOptions, name, &Option::name);
    if (option == std::end(kOptions)) throw std::logic_error("no option " + name);
    options.add_options()(option->spelled, semantic_of(*option), option->help);
  }
  options.add_options()("plugin-path",
                        po::value<std::vector<std::string>>()->composing()->value_name("DIR"),
                        "folder with plugins, searched first (then VIWO_PLUGIN_PATH)");
  options.add_options()("help,h", "this text");
  return options;
}

[[noreturn]] void refuse(const Command& command, const std::string& text) {
  throw InputError(std::string("viwo ") + command.name + ": " + text + " (see viwo " +
                   command.name + " --help)");
}

/// Converts what Boost found wrong into a message with the nearest option.
[[noreturn]] void refuse(const Command& command, const po::options_description& options,
                         const po::error& error) {
  std::string text = error.what();
  if (const auto* unknown = dynamic_cast<const po::unknown_option*>(&error)) {
    std::vector<std::string> names;
    for (const auto& option : options.options()) names.push_back("--" + option->long_name());
    text += config::did_you_mean(unknown->get_option_name(), names);
  }
  refuse(command, text);
}

/// What Boost accepts, but no command can do. (Boost itself would read a negative number into an
/// unsigned one.)
void check_ranges(const Command& command, const po::variables_map& values) {
  if (values.contains("seed") && values["seed"].as<std::int64_t>() < 0) {
    refuse(command, "--seed must not be negative");
  }
  if (values.contains("seeds") && values["seeds"].as<int>() < 1) {
    refuse(command, "--seeds must be at least 1");
  }
  if (values.contains("jobs") && values["jobs"].as<int>() < 0) {
    refuse(command, "--jobs must not be negative");
  }
  if (values.contains("jobs") && values["jobs"].as<int>() > kMostJobs) {
    refuse(command, "--jobs must be at most " + std::to_string(kMostJobs));
  }
  if (values.contains("max-gap") && !(values["max-gap"].as<double>() > 0.)) {
    refuse(command, "--max-gap must be above 0");
  }
  if (values.contains("figures") && values["figures"].as<std::string>() != "svg" &&
      values["figures"].as<std::string>() != "pdf") {
    refuse(command, "--figures takes svg or pdf");
  }
  if (values.contains("shard") && values.contains("collect")) {
    refuse(command, "--collect takes what all shards have left: not with --shard");
  }
  if ((values.contains("shard") || values.contains("collect")) && !values.contains("out")) {
    refuse(command, "--shard and --collect need --out, the folder that all shards share");
  }
  if (values.contains("out") && values["out"].as<std::string>().empty()) {
    refuse(command,
           std::string("--out needs the name of a ") + (values.contains("to") ? "file" : "folder"));
  }
  if (values.contains("fix") && values["fix"].as<std::string>().empty()) {
    refuse(command, "--fix needs the name of a file");
  }
  if (values.contains("mcap") && values["mcap"].as<std::string>().empty()) {
    refuse(command, "--mcap needs the name of a file");
  }
  if (values.contains("video") && values["video"].as<std::string>().empty()) {
    refuse(command, "--video needs the name of a file");
  }
}

void check_positional(const Command& command, const std::vector<std::string>& given) {
  const auto n = static_cast<int>(given.size());
  if (n < std::abs(command.n_positional)) {
    // The usage reads "run CONFIG [--out DIR] ...": its second word is what is missing.
    std::istringstream usage(command.usage);
    std::string what;
    usage >> what >> what;
    if (command.n_positional < 0) what = "what to do";
    refuse(command, what + " is missing - usage: viwo " + command.usage);
  }
  if (command.n_positional >= 0 && n > command.n_positional) {
    refuse(command, "what is '" + given[static_cast<std::size_t>(command.n_positional)] +
                        "'? - usage: viwo " + command.usage);
  }
}

Arguments arguments_of(const po::variables_map& values) {
  Arguments arguments;
  const auto texts = [&](const char* name) {
    return values.contains(name) ? values[name].as<std::vector<std::string>>()
                                 : std::vector<std::string>{};
  };
  const auto text = [&](const char* name) {
    return values.contains(name) ? values[name].as<std::string>() : std::string();
  };
  arguments.positional = texts("positional");
  arguments.assignments = texts("set");
  for (const std::string& folder : texts("plugin-path")) arguments.plugin_path.emplace_back(folder);
  if (values.contains("out")) arguments.out = text("out");
  if (values.contains("seed")) {
    arguments.seed = static_cast<std::uint64_t>(values["seed"].as<std::int64_t>());
  }
  if (values.contains("seeds")) arguments.seeds = values["seeds"].as<int>();
  if (values.contains("jobs")) arguments.jobs = values["jobs"].as<int>();
  arguments.keep_runs = values.contains("keep-runs");
  arguments.resume = values.contains("resume");
  if (values.contains("shard")) arguments.shard = text("shard");
  arguments.collect = values.contains("collect");
  arguments.lockstep = values.contains("lockstep");
  arguments.show = values.contains("show");
  arguments.video = text("video");
  arguments.mcap = text("mcap");
  arguments.figures = text("figures");
  arguments.fix = text("fix");
  arguments.plan = text("plan");
  arguments.reference = text("reference");
  arguments.estimate = text("estimate");
  arguments.align = text("align");
  if (values.contains("max-gap")) arguments.max_gap_s = values["max-gap"].as<double>();
  arguments.to = text("to");
  return arguments;
}

}  // namespace

std::optional<Arguments> parse(const Command& command, const std::vector<std::string>& words) {
  const po::options_description options = options_of(command);
  for (const std::string& word : words) {
    if (word != "--help" && word != "-h") continue;
    std::cout << "Usage: viwo " << command.usage << "\n\n" << command.summary << "\n\n" << options;
    return std::nullopt;
  }
  po::options_description all;
  all.add(options).add_options()("positional", po::value<std::vector<std::string>>());
  po::positional_options_description positional;
  positional.add("positional", -1);
  po::variables_map values;
  try {
    namespace style = po::command_line_style;
    po::store(po::command_line_parser(words)
                  .options(all)
                  .positional(positional)
                  .style(style::unix_style & ~style::allow_guessing)
                  .run(),
              values);
    po::notify(values);
  } catch (const po::error& error) {
    refuse(command, options, error);
  }
  check_ranges(command, values);
  Arguments arguments = arguments_of(values);
  check_positional(command, arguments.positional);
  return arguments;
}

PluginRegistry make_registry(const Arguments& arguments) {
  return PluginRegistry(PluginRegistry::default_search_path(arguments.plugin_path));
}

}  // namespace viwo::app
