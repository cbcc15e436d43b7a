#include "viwo/results/keep_inputs.hpp"

#include "viwo/files/files.hpp"
#include "viwo/setup/input_files.hpp"

namespace viwo {

void keep_inputs(const std::filesystem::path& folder, std::initializer_list<const char*> results,
                 const std::vector<std::filesystem::path>& inputs) {
  for (const char* const name : results) refuse_to_replace(folder / name, inputs);
  refuse_to_empty(folder / files::kUnfinishedResults, inputs);
}

}  // namespace viwo
