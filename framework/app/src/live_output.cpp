#include "live_output.hpp"

#include <iostream>
#include <string>

#include "viwo/config/yaml.hpp"
#include "viwo/files/files.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/results/run_output.hpp"

namespace viwo::app {
namespace {

const std::filesystem::path& begun(const RunSetup& setup, const std::filesystem::path& folder) {
  files::remove_results(folder, kResultsOfRun);
  files::write_text(folder / "config.resolved.yaml", config::to_yaml(setup.resolved));
  return folder;
}

}  // namespace

LiveOutput::LiveOutput(const RunSetup& setup, const std::filesystem::path& folder, RunHooks& hooks)
    : stream_(begun(setup, folder)) {
  hooks.on_epoch = [this, then = hooks.on_epoch](const RunResult& result) {
    const bool was_written = stream_.failure().empty();
    stream_.epoch(result);
    if (was_written && !stream_.failure().empty()) {
      std::cerr << stream_.failure() << "; the run goes on" << std::endl;
    }
    if (then) then(result);
  };
  hooks.on_warning = [](double t_s, const std::string& text) {
    std::cerr << "at " << significant(t_s, 6) << " s: " << text << std::endl;
  };
  std::cerr << setup.name << ": listening; ctrl-C ends the run and writes its results\n";
}

void LiveOutput::finish(RunResult& result) {
  const std::string failure = stream_.finish();
  result.on_disk = failure.empty();
  if (!failure.empty()) result.warnings.push_back(failure + "; what is there is thinned");
}

}  // namespace viwo::app
