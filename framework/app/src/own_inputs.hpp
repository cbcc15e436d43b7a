// What a command reads is not what it writes: found out before any work.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "viwo/experiment/experiment.hpp"
#include "viwo/results/keep_inputs.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo::app {

using Files = std::vector<std::filesystem::path>;
using Names = std::initializer_list<const char*>;

/// The configuration that is named on the command line, and all that it names.
Files inputs_of(const Arguments& arguments, const RunSetup& setup);

/// The same of all runs of an experiment, but for folders: by what is written, without reading it.
Files inputs_of(const Arguments& arguments, const experiment::ExperimentSetup& setup);

/// keep_inputs() for all that a run leaves.
void keep_inputs_of_run(const std::filesystem::path& folder, const Files& inputs);

/// InputError where the file of `option` ("" for none), which is written beside the results, would
/// replace one of them, an input, or `other`, which is written, too.
void keep_apart(const std::string& option, const std::filesystem::path& file,
                const std::filesystem::path& folder, Names results, const Files& inputs,
                const std::filesystem::path& other = {});

}  // namespace viwo::app
