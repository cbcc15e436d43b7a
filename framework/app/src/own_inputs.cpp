#include "own_inputs.hpp"

#include <system_error>

#include "viwo/api/status.hpp"
#include "viwo/files/files.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/results/run_stream.hpp"
#include "viwo/setup/input_files.hpp"

namespace viwo::app {
namespace {

namespace fs = std::filesystem;

/// Also of files that are not there yet.
bool are_one(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  return fs::weakly_canonical(fs::absolute(a, ignored), ignored) ==
         fs::weakly_canonical(fs::absolute(b, ignored), ignored);
}

/// Paths are relative to the file that they are written in.
void add_files_in(const config::Node& node, Files& out) {
  for (const config::Node& item : node.items()) add_files_in(item, out);
  for (const config::Node::Entry& entry : node.entries()) add_files_in(entry.value, out);
  if (!node.is_scalar()) return;
  const fs::path from = node.mark().line > 0 ? node.mark().file : "";
  const fs::path file = from.parent_path() / node.scalar();
  std::error_code not_there;
  if (fs::is_regular_file(file, not_there)) out.push_back(file);
}

}  // namespace

Files inputs_of(const Arguments& arguments, const experiment::ExperimentSetup& setup) {
  Files inputs{arguments.positional[0], setup.base.mark().file};
  for (const experiment::Variant& variant : setup.variants) {
    for (const Recording& recording : setup.recordings) {
      add_files_in(experiment::configuration_of(setup, variant, recording), inputs);
    }
  }
  return inputs;
}

Files inputs_of(const Arguments& arguments, const RunSetup& setup) {
  Files inputs = input_files(setup);
  inputs.emplace_back(arguments.positional[0]);
  return inputs;
}

void keep_inputs_of_run(const fs::path& folder, const Files& inputs) {
  keep_inputs(folder, kResultsOfRun, inputs);
  std::error_code not_there;
  for (const auto& entry : fs::directory_iterator(folder, not_there)) {
    if (is_piece_file(entry.path())) refuse_to_replace(entry.path(), inputs);
  }
}

void keep_apart(const std::string& option, const fs::path& file, const fs::path& folder,
                Names results, const Files& inputs, const fs::path& other) {
  if (file.empty()) return;
  refuse_to_write_into(file, inputs);
  const auto refuse = [&](const std::string& why) {
    throw InputError(option + " " + file.string() + ": " + why + " - name another file");
  };
  for (const char* const name : results) {
    if (are_one(file, folder / name)) refuse("is one of the results of this command");
  }
  if (are_one(file.parent_path(), folder / files::kUnfinishedResults)) {
    refuse("is in a folder that this command removes");
  }
  if (!other.empty() && are_one(file, other)) refuse("is another result of this command, too");
}

}  // namespace viwo::app
