// viwo: visual-inertial-wheel odometry from the command line.
// Exit codes: 0 done; 1 the run failed, diverged or is doubtful; 2 the input is wrong.
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "out_of_memory.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/files/printable_output.hpp"
#include "viwo/plugin_host/build_record_check.hpp"
#include "viwo/plugin_host/installation.hpp"

namespace viwo::app {
namespace {

constexpr Command kCommands[] = {
    {"run", "run CONFIG [--out DIR] [--seed N] [--set KEY=VALUE]...",
     "Runs one configuration, the filter or wheel odometry alone; writes trajectory, summary.json "
     "and report.html.",
     "out seed set figures show video mcap plan lockstep", 1, run_command},
    {"inspect", "inspect CONFIG [--out DIR] [--set KEY=VALUE]... [--fix FILE]",
     "Looks at what the sensors of a run configuration gave, before any filter: rates and gaps, "
     "units, signs, axes, noises, order of the joints, clocks. Says what is wrong and what to "
     "write "
     "into the configuration; writes inspection.json and report.html. Exit code 1: there are "
     "findings. Sensors that work on images are left out (docs/inspect.md).",
     "out seed set fix", 1, inspect_command},
    {"experiment",
     "experiment EXPERIMENT [--out DIR] [--jobs N] [--seeds N] [--resume] [--shard I/N | "
     "--collect] [--set KEY=VALUE]...",
     "Runs variants x recordings x seeds side by side and writes tables and report.html.",
     "out jobs seeds set keep-runs resume shard collect figures", 1, experiment_command},
    {"observability", "observability CONFIG [--out DIR] [--set KEY=VALUE]...",
     "Tells which directions of the state and of the calibration a run's motion and updates can "
     "observe; CONFIG is a run or an experiment (variants x motions).",
     "out set figures", 1, observability_command},
    {"calibrate", "calibrate CONFIG [--out DIR] [--set KEY=VALUE]...",
     "Estimates the wheel intrinsics from recordings with a gyro, reference poses or a measured "
     "distance; says when they are not to be trusted (exit code 1). Keys of CONFIG: viwo plugins "
     "describe calibration.",
     "out set", 1, calibrate_command},
    {"export", "export FILE --to urdf|ros2_control|wpilib|kalibr|csv [--out FILE]",
     "Writes a calibration.yaml, of calibrate or of a run, as other programs take it; says what "
     "the format cannot hold (docs/export.md).",
     "to! out-file", 1, export_command},
    {"plan", "plan CONFIG [--out DIR] [--set KEY=VALUE]...",
     "Tells how to drive so that a calibration will know the intrinsics as well as goals ask, on "
     "the "
     "shortest path on a floor of given size; writes plan.csv, report.html and summary.json. Exit "
     "code 1: it takes too long (docs/plan.md). Keys of CONFIG: viwo plugins describe plan.",
     "out set", 1, plan_command},
    {"simulate", "simulate CONFIG --out DIR [--seed N] [--set KEY=VALUE]...",
     "Writes what the sensors of a configuration yield (IMU, images' tracks, encoders, truth) as a "
     "log folder.",
     "out! seed set", 1, simulate_command},
    {"evaluate",
     "evaluate --reference A.tum --estimate B.tum [--align MODE] [--max-gap S] [--out DIR]",
     "Compares two trajectories (ATE, RPE, end error).", "reference estimate align max-gap out", 0,
     evaluate_command},
    {"plugins", "plugins list | describe NAME | schema | check FILE | new KIND NAME [--out DIR]",
     "Lists the plugins that are found (kinematics, sensors, updates), the parameters of one or of "
     "a section (estimator, imu, cameras, wheels, odometry, evaluation, run, calibration, plan), "
     "or why "
     "a file is "
     "refused; schema gives a JSON Schema of run configurations, for editors; new writes the "
     "source "
     "of a plugin (kinematics, sensor or update) that "
     "builds, runs and passes its tests, as a start for one of your own.",
     "out", -1, plugins_command}};

void print_help() {
  std::cout << "viwo " VIWO_VERSION " - visual-inertial-wheel odometry\n\nUsage:\n";
  for (const Command& command : kCommands) {
    std::cout << "  viwo " << command.usage << "\n      " << command.summary << "\n";
  }
  std::cout
      << "  viwo --version | --help, and --help for each command\n\n"
         "Exit codes: 0 done; 1 the run failed, diverged or is doubtful; 2 the input is wrong.\n";
}

int dispatch(const std::vector<std::string>& words) {
  if (words.empty()) {
    print_help();
    return 2;
  }
  if (words[0] == "--help" || words[0] == "-h") {
    print_help();
    return 0;
  }
  if (words[0] == "--version") {
    std::cout << "viwo " VIWO_VERSION "\n";
    return 0;
  }
  for (const Command& command : kCommands) {
    if (words[0] != command.name) continue;
    const auto arguments = parse(command, {words.begin() + 1, words.end()});
    return arguments ? command.run(*arguments) : 0;
  }
  std::vector<std::string> names{"--help", "--version"};
  for (const Command& command : kCommands) names.emplace_back(command.name);
  throw InputError("viwo: unknown command '" + words[0] + "'" +
                   config::did_you_mean(words[0], names));
}
}  // namespace
}  // namespace viwo::app

int main(int argc, char** argv) {
  viwo::app::end_well_without_memory();
  // A pipe that nobody reads and a limit of the size of files are errors of writing.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  const viwo::files::PrintableOutput out(std::cout), err(std::cerr);
  try {
    viwo::become_faster_copy(argv);
    if (!viwo::host_record_is_consistent()) {
      std::cerr << "viwo was built differently from its libviwo_api.so: rebuild both\n";
      return 1;
    }
    const int code = viwo::app::dispatch({argv + 1, argv + argc});
    viwo::files::flush_output("viwo");
    return code;
  } catch (const viwo::InputError& error) {
    std::cerr << error.what() << "\n";
    return 2;
  } catch (const std::bad_alloc&) {
    std::cerr << "viwo: there is not enough memory\n";
    return 1;
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
